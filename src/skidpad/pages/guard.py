"""The guard before every page: pure ASGI, so that it stands before websockets too (R-10).

    Host      must be one of ours: a name that an attacker points at 127.0.0.1 is not
    Origin    must be ours where it is told; websockets and whatever changes state must tell it
    session   a cookie that came of an invitation, except below paths that check credentials alone

Whoever comes with `?token=...` gets the cookie and is sent to the same address without it.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, MutableMapping
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qsl, quote, urlencode

from skidpad.pages.sessions import Sessions

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

WHO = "skidpad.who"  # key of the scope: whose session it is
TOKEN = "token"  # of the address
READS = ("GET", "HEAD", "OPTIONS")
REFUSED = 1008  # close code of a websocket: against the rules (RFC 6455)
# nothing is fetched from elsewhere; NiceGUI needs its inline scripts and Vue's compiler
POLICY = (
    "default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; "
    "base-uri 'self'; form-action 'self'; frame-ancestors 'none'"
)
HEADERS = (
    (b"content-security-policy", POLICY.encode()),
    (b"referrer-policy", b"same-origin"),
    (b"x-content-type-options", b"nosniff"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Door:
    """Holds what is ours, and which sessions are let in."""

    hosts: frozenset[str]  # values of the header Host, with the port
    cookie: str  # its name; cookies of all ports of a host are one jar, so it has the port in it
    sessions: Sessions
    secure: bool = False  # pages come by https
    free: tuple[str, ...] = ()  # beginnings of paths whose handlers check credentials of their own
    log_in: Callable[[str], str] | None = None  # HTML of the refusal to a person without a session,
    # from what was wrong with their invitation ("" without one)


class Guard:
    """Wraps an ASGI application: only requests of our pages with a session, or to free paths, reach it."""

    def __init__(self, app: App, door: Door) -> None:
        self.app, self.door = app, door

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Passes a request on with its session's owner in the scope, or answers 403, or 303 for a token."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        wrong = self._foreign(scope)
        if wrong is not None:
            await _refuse(scope, receive, send, wrong)
            return
        token = _token(scope)
        if token is not None:
            await self._exchange(scope, receive, send, token)
            return
        who = self.door.sessions.who(_cookie(scope, self.door.cookie))
        if who is None and not self._is_free(scope["path"]):
            said = "this page needs the address that Skidpad printed when it started"
            await self._turn_away(scope, receive, send, (said, ""))
            return
        scope[WHO] = who
        await self.app(scope, receive, _with_headers(send))

    def _foreign(self, scope: Scope) -> str | None:
        """Returns why this request does not come from a page of ours; None: it does."""
        hosts, origins = _header(scope, b"host"), _header(scope, b"origin")
        if len(hosts) != 1 or hosts[0].lower() not in self.door.hosts:
            return "this server does not answer to that host name"
        ours = {f"{scheme}://{host}" for host in self.door.hosts for scheme in ("http", "https")}
        if len(origins) > 1 or any(origin.lower() not in ours for origin in origins):
            return "the page that asks is not one of this server"
        by_script = scope["type"] == "websocket" or scope["method"] not in READS
        if by_script and not origins and not self._is_free(scope["path"]):
            return "whoever asks must say which page it is (header Origin)"
        return None

    def _is_free(self, path: str) -> bool:
        """Returns True when a path is below a free prefix of the door and holds no ".."."""
        return ".." not in path and path.startswith(self.door.free)

    async def _turn_away(
        self, scope: Scope, receive: Receive, send: Send, said: tuple[str, str]
    ) -> None:
        """Refuses for want of a session; a browser gets the log-in page, with `said[1]` on it, as the body.

        said: sentence of the refusal, what was wrong with the last attempt.
        """
        sentence, wrong = said
        reads = scope["type"] == "http" and scope["method"] == "GET"
        html = any("text/html" in value for value in _header(scope, b"accept"))
        if self.door.log_in is None or not reads or not html:
            await _refuse(scope, receive, send, sentence)
            return
        await _forbid(send, b"text/html; charset=utf-8", self.door.log_in(wrong))

    async def _exchange(self, scope: Scope, receive: Receive, send: Send, token: str) -> None:
        """Answers a token with a session's cookie and a redirect to the address without it.

        A void token is refused, unless the browser has a session.
        """
        known = self.door.sessions.who(_cookie(scope, self.door.cookie)) is not None
        id = self.door.sessions.admit(token)
        if id is None and not known:
            wrong = "this address was used already, or never was ours"
            await self._turn_away(scope, receive, send, (wrong, wrong))
            return
        query = [(k, v) for k, v in _query(scope) if k != TOKEN]
        # one slash: a browser would read two as another host's name
        path = "/" + quote(scope["path"].lstrip("/\\")) + ("?" + urlencode(query) if query else "")
        headers = [(b"location", path.encode("ascii")), (b"cache-control", b"no-store")]
        if id is not None:
            headers.append((b"set-cookie", _set_cookie(self.door, id).encode("ascii")))
        await send({"type": "http.response.start", "status": 303, "headers": [*headers, *HEADERS]})
        await send({"type": "http.response.body", "body": b""})


def _header(scope: Scope, name: bytes) -> list[str]:
    """Returns the values of all headers of this lower-case name, decoded, in their order."""
    return [value.decode("latin-1") for key, value in scope["headers"] if key == name]


def _query(scope: Scope) -> list[tuple[str, str]]:
    """Returns the names and values of the query string in their order, blank values too."""
    text = scope.get("query_string", b"").decode("latin-1")
    return parse_qsl(text, keep_blank_values=True)


def _token(scope: Scope) -> str | None:
    """Returns the token in the address of a GET request; None without one."""
    if scope["type"] != "http" or scope["method"] != "GET":
        return None
    return dict(_query(scope)).get(TOKEN)


def _cookie(scope: Scope, name: str) -> str | None:
    """Returns the value of the cookie of this name; None when absent or when a cookie header is malformed."""
    jar: SimpleCookie = SimpleCookie()
    for text in _header(scope, b"cookie"):
        try:
            jar.load(text)
        except CookieError:
            return None
    return jar[name].value if name in jar else None


def _set_cookie(door: Door, id: str) -> str:
    """Returns the Set-Cookie text for the session `id`, marked Secure where the door is."""
    text = f"{door.cookie}={id}; Path=/; HttpOnly; SameSite=Strict"
    return text + "; Secure" if door.secure else text


def _with_headers(send: Send) -> Send:
    """Returns a `send` that adds HEADERS to the start of each response that lacks them."""

    async def sending(message: MutableMapping[str, Any]) -> None:
        if message["type"] == "http.response.start":
            told = {key for key, _ in message.get("headers", ())}
            more = [(key, value) for key, value in HEADERS if key not in told]
            message = {**message, "headers": [*message.get("headers", ()), *more]}
        await send(message)

    return sending


async def _refuse(scope: Scope, receive: Receive, send: Send, sentence: str) -> None:
    """Answers 403 with one sentence; a websocket is closed before it opens, which says 403 too."""
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": REFUSED, "reason": sentence})
        return
    await _forbid(send, b"text/plain; charset=utf-8", f"{sentence}\n")


async def _forbid(send: Send, kind: bytes, text: str) -> None:
    """Sends a response 403 with the text, of the content type `kind`, which must not be stored."""
    headers = [(b"content-type", kind), (b"cache-control", b"no-store"), *HEADERS]
    await send({"type": "http.response.start", "status": 403, "headers": headers})
    await send({"type": "http.response.body", "body": text.encode()})
