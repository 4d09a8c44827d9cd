"""The guard, asked by raw requests as any program could send them: nobody gets in by another way."""

import asyncio
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.pages.guard import WHO, Door, Guard
from skidpad.pages.server import host_headers
from skidpad.pages.sessions import Sessions

HOST, PORT = "127.0.0.1:8123", 8123
OURS, THEIRS = f"http://{HOST}", "http://evil.example"


class Behind:
    """The application that is guarded: remembers who came through."""

    def __init__(self):
        self.seen = []

    async def __call__(self, scope, receive, send):
        self.seen.append(scope[WHO])
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
        else:
            await send({"type": "http.response.start", "status": 200, "headers": []})
            await send({"type": "http.response.body", "body": b"in"})


class House:
    def __init__(self, **door):
        self.sessions, self.behind = Sessions(), Behind()
        self.door = Door(
            hosts=host_headers("127.0.0.1", PORT, ()),
            cookie="skidpad-8123",
            sessions=self.sessions,
            **door,
        )

    def session(self, who="owner"):
        return self.sessions.admit(self.sessions.invite(who))

    def ask(
        self, kind="http", *, host=HOST, origin=None, cookie=None, path="/", query="", method="GET",
        accept=None,
    ):  # fmt: skip
        headers = [(b"host", host.encode())] if host is not None else []
        headers += [(b"origin", origin.encode())] if origin is not None else []
        headers += [(b"cookie", f"skidpad-8123={cookie}".encode())] if cookie else []
        headers += [(b"accept", accept.encode())] if accept else []
        scope = {"type": kind, "path": path, "query_string": query.encode(), "headers": headers}
        scope |= {"method": method} if kind == "http" else {}
        answers = []

        async def receive():
            return (
                {"type": "websocket.connect"} if kind == "websocket" else {"type": "http.request"}
            )

        async def send(message):
            answers.append(message)

        asyncio.run(Guard(self.behind, self.door)(scope, receive, send))
        return answers


def status(answers):
    return answers[0].get("status", answers[0]["type"])


def headers(answers):
    return {k.decode(): v.decode() for k, v in answers[0]["headers"]}


@pytest.mark.parametrize("kind", ["http", "websocket"])
@pytest.mark.parametrize(
    "wrong",
    [
        {"origin": THEIRS},
        {"origin": "null"},
        {"origin": f"http://{HOST}.evil.example"},
        {"host": "evil.example:8123"},  # a name that was pointed at 127.0.0.1 (rebinding)
        {"host": "127.0.0.1:9999"},
        {"host": None},
        {"cookie": None},
        {"cookie": "guessed"},
    ],
)
def test_who_is_wrong_in_one_thing_stays_outside(kind, wrong):
    house = House()
    right = {"origin": OURS, "cookie": house.session()}
    refused = house.ask(kind, **(right | wrong))
    assert status(refused) in (403, "websocket.close")
    assert house.behind.seen == []
    assert status(house.ask(kind, **right)) in (200, "websocket.accept")
    assert house.behind.seen == ["owner"]


@pytest.mark.parametrize("asked", [{"kind": "websocket"}, {"method": "POST"}, {"method": "DELETE"}])
def test_scripts_must_say_which_page_they_are_of(asked):
    house = House()
    assert status(house.ask(cookie=house.session(), **asked)) in (403, "websocket.close")
    assert house.behind.seen == []


def test_a_token_opens_one_session_and_leaves_the_address():
    house = House()
    token = house.sessions.invite("owner")
    answer = house.ask(path="/run", query=f"a=1&token={token}")
    assert status(answer) == 303
    told = headers(answer)
    assert told["location"] == "/run?a=1"
    assert told["cache-control"] == "no-store"
    name, _, rest = told["set-cookie"].partition("=")
    assert name == "skidpad-8123"
    assert rest.split("; ")[1:] == ["Path=/", "HttpOnly", "SameSite=Strict"]
    cookie = rest.split("; ")[0]
    assert token not in cookie
    assert status(house.ask(cookie=cookie)) == 200
    again = house.ask(query=f"token={token}")
    assert status(again) == 403  # it was used
    assert "set-cookie" not in headers(again)
    reopened = house.ask(query=f"token={token}", cookie=cookie)
    assert (status(reopened), headers(reopened)["location"]) == (303, "/")
    assert "set-cookie" not in headers(reopened)
    house.sessions.end(cookie)
    assert status(house.ask(cookie=cookie)) == 403


def test_a_log_in_page_is_the_body_of_a_refusal_and_lets_nobody_in():
    house, html = House(log_in=lambda wrong: f"<p>log in{wrong}"), "text/html,*/*"
    first = house.ask(accept=html)
    assert (status(first), first[1]["body"]) == (403, b"<p>log in")
    assert "content-security-policy" in headers(first)
    used = house.ask(accept=html, query="token=never")
    assert status(used) == 403
    assert b"log in" in used[1]["body"]
    assert b"used already" in used[1]["body"]
    for rest in (
        {"host": "evil.example"},
        {"origin": THEIRS},
        {"method": "POST", "origin": OURS},
        {"accept": "application/json"},
    ):
        answer = house.ask(**{"accept": html} | rest)
        assert status(answer) == 403, rest
        assert b"log in" not in answer[1]["body"], rest
    assert status(house.ask("websocket", origin=OURS, accept=html)) == "websocket.close"
    assert house.behind.seen == []


def test_a_token_counts_for_pages_alone():
    house = House()
    token = house.sessions.invite("owner")
    assert status(house.ask("websocket", origin=OURS, query=f"token={token}")) == "websocket.close"
    assert status(house.ask(origin=OURS, query=f"token={token}", method="POST")) == 403
    assert status(house.ask(origin=THEIRS, query=f"token={token}")) == 403
    assert status(house.ask(query=f"token={token}")) == 303  # still unused


def test_an_address_leads_to_no_other_host():
    house = House()
    answer = house.ask(path="//evil.example/x", query=f"token={house.sessions.invite('owner')}")
    assert headers(answer)["location"] == "/evil.example/x"


def test_paths_with_credentials_of_their_own_need_no_cookie_but_the_right_host():
    house = House(free=("/api/",))
    assert status(house.ask(path="/api/records", method="POST")) == 200
    assert house.behind.seen == [None]
    for wrong in ({"host": "evil.example"}, {"origin": THEIRS}):
        assert status(house.ask(path="/api/records", method="POST", **wrong)) == 403
    assert status(house.ask(path="/api/../page")) == 403


def test_pages_fetch_from_nowhere_else():
    house = House()
    told = headers(house.ask(cookie=house.session()))
    assert told["content-security-policy"].startswith("default-src 'self'")
    assert "http" not in told["content-security-policy"]


def test_a_cookie_is_for_https_where_pages_are():
    house = House()
    house.door = replace(house.door, secure=True)
    answer = house.ask(query=f"token={house.sessions.invite('owner')}")
    assert headers(answer)["set-cookie"].endswith("; Secure")


@given(token=st.text(), path=st.text(max_size=20))
def test_no_token_that_was_not_given_opens_anything(token, path):
    house = House()
    house.sessions.invite("owner")
    assert house.sessions.admit(token) is None
    assert status(house.ask(path="/" + path)) == 403


def test_an_invitation_that_was_not_used_in_time_opens_nothing_and_is_forgotten():
    clock = [100.0]
    sessions = Sessions(valid_s=60.0, clock=lambda: clock[0])
    early, late = sessions.invite("ann"), sessions.invite("bob")
    clock[0] += 60.0
    id = sessions.admit(early)
    assert sessions.who(id) == "ann"
    clock[0] += 0.1
    assert sessions.admit(late) is None
    sessions.invite("cid")
    clock[0] += 61.0
    sessions.invite("dan")
    assert len(sessions) == 1  # nobody fills the memory with invitations
    assert sessions.who(id) == "ann"  # a session is as good as the credential behind it
