"""The pages in a real browser, served by the command: who sees what, alerts live, phone width."""

from __future__ import annotations

import json
import os
import signal

import pytest

from skidpad.cli.fleet.links import map_lines, open_maps
from skidpad.core.errors import FileError, InputError
from skidpad.fleet.alerting.keeping import What
from skidpad.fleet.alerting.orders import Order
from skidpad.fleet.site.acting import click_analyse, click_answer, click_order
from skidpad.fleet.site.build import pages_of
from skidpad.fleet.site.login import log_in_page
from skidpad.fleet.words import FIRST_PAGE, NOT_THERE, RIGHTS, Action, Refused
from support.chromium import CHROMIUM, FLAGS
from support.fleet_maker import released
from support.fleet_server import WAIT_MS, call, filled, loaded, opened, someone, start_fleet
from support.fleet_world import make_world, packed, record
from support.stadium import RADIUS, STRAIGHT, WIDTH, written

SCENE = {"map": "town", "ego": {"x": 1.0, "y": 2.0, "heading": 0.1}, "v": 8.0}
ALERT = {"kind": "hazard", "text": "<b>car</b> ahead stopped", "scene": SCENE}


def test_every_click_for_every_role_and_foreign_id(world):
    """A click is asked for its right anew; another tenant's alert is absent."""
    headers = {"Idempotency-Key": "alert-key"}
    raised = world.post("red-1", "/api/v1/alerts", content=json.dumps(ALERT), headers=headers)
    id = raised.json()["alert"]

    def answer(who: str):
        click_answer(world.fleet, who, id, What.ACKNOWLEDGED)

    clicks = {
        "answer": (answer, {"operator", "teleoperator"}),
        "order": (lambda who: click_order(world.fleet, who, id, Order.SLOW), {"teleoperator"}),
        "analyse": (lambda who: click_analyse(world.fleet, who), {"operator", "manufacturer"}),
    }
    for name, account in world.accounts.items():
        who = account.principal
        for click, (act, roles) in clicks.items():
            foreign = click != "analyse" and name.startswith("blue")
            if who.role.value in roles and not foreign:
                if not (click == "answer" and who.role.value == "teleoperator"):
                    act(who.id)
                continue
            with pytest.raises(Refused) as refused:
                act(who.id)
            assert refused.value.status == (404 if who.role.value in roles else 403), (name, click)
    with pytest.raises(Refused):
        clicks["order"][0]("nobody")


RED = "redtown"  # a map where only red vehicles drove


@pytest.mark.slow
@pytest.mark.req("C-195")
def test_every_page_for_every_role_and_foreign_id(tmp_path):
    """Over HTTP: no session, 403; no right, one sentence; another tenant's id and rows, absent."""
    world = make_world(tmp_path / "data", None)
    red = [record(k, (120.0 + k, 30.0), map=RED) for k in range(3)]
    hazard, *_ = world.send("red-1", packed(*red)).json()["ids"]
    change, release = released(world, tmp_path, hazard)
    headers = {"Idempotency-Key": "alert-key"}
    text = json.dumps(ALERT | {"text": f"seen in {RED}"})
    alert = world.post("red-1", "/api/v1/alerts", content=text, headers=headers).json()["alert"]
    name = world.get("axle", "/api/v1/releases").json()[0]["payload"]
    people = {n: a for n, a in world.accounts.items() if a.principal.may(Action.VISIT)}
    world.close()
    shown = {"/": RED, "/replay/{hazard}": RED, "/alerts": RED, "/changes": name}
    pages = pages_of(None, None)  # what they read and draw is not asked for here
    assert set(shown) | {"/places", "/case", "/research", "/work"} == set(pages)
    child, address = start_fleet(tmp_path / "data")
    with child:
        try:
            for path in pages:
                url = address + path.replace("{hazard}", hazard)
                assert call("GET", url).status_code == 403, path
                token = world.accounts["red-1"].token
                bearer = {"Authorization": f"Bearer {token}"}
                assert call("GET", url, headers=bearer).status_code == 403, path
            for who, account in people.items():
                role, own = account.principal.role, who == "axle" or who.startswith("red")
                with someone(address, account.token) as client:
                    for path, one in pages.items():
                        text = loaded(client, path.replace("{hazard}", hazard))
                        about, may = (who, path), role in RIGHTS[one.action]
                        refused = f"The role {role.value} may not {one.action.value}."
                        assert (refused in text) is not may, about
                        if path in shown:
                            assert (shown[path] in text) is (may and own), about
                        if "{" in path:
                            assert (NOT_THERE in text) is (may and not own), about
                            absent = loaded(client, path.replace("{hazard}", "0" * 32))
                            assert (NOT_THERE in absent) is may, about
                        if not own:
                            ids = (RED, name, change, release, alert)
                            assert [i for i in ids if i in text] == [], about
        finally:
            os.kill(child.pid, signal.SIGTERM)
    assert "researcher" in people
    assert "red-1" not in people


def test_each_role_that_may_visit_lands_on_a_page_that_it_may_read():
    pages = pages_of(None, None)
    first = {role.value: path for role, path in FIRST_PAGE.items()}
    assert first == {
        "manufacturer": "/", "operator": "/", "teleoperator": "/alerts", "authority": "/places",
        "researcher": "/research",
    }  # fmt: skip
    assert set(FIRST_PAGE) == RIGHTS[Action.VISIT]
    for role, path in FIRST_PAGE.items():
        assert role in RIGHTS[pages[path].action], role


def test_a_log_in_page_asks_in_one_sentence_and_shows_what_was_wrong_as_text():
    page = log_in_page("<b>used</b>")
    assert "&lt;b&gt;used" in page
    assert page.count("<input") == 1
    assert page.split("<p>")[1].split("</p>")[0].count(".") == 1
    assert "action=" not in page  # a credential never goes into an address


def test_roads_are_those_of_ones_own_maps_and_of_bundled_ones(tmp_path):
    """A name leads to no file: maps are read when the service starts."""
    written(tmp_path, "elsewhere.xodr")
    own, bundled = map_lines(open_maps(tmp_path)), map_lines(open_maps(None))
    outside = RADIUS + WIDTH + 1.0  # the middle of the 2 m beside the street
    xs = [x for line in own("elsewhere") for x, _ in line]
    assert max(xs) == pytest.approx(STRAIGHT + outside, abs=0.1)
    assert min(xs) == pytest.approx(-outside, abs=0.1)
    assert own("town") == bundled("town") != []
    for name in ("elsewhere", "", "../elsewhere", str(tmp_path / "elsewhere.xodr")):
        assert not bundled(name)
    assert not own("../elsewhere")
    with pytest.raises(FileError, match="no such folder"):
        open_maps(tmp_path / "nowhere")
    (tmp_path / "broken.xodr").write_text("<OpenDRIVE>")
    with pytest.raises(InputError, match=r"broken\.xodr"):
        open_maps(tmp_path)


@pytest.mark.slow
def test_the_dashboard_draws_a_map_of_ones_own(tmp_path):
    (tmp_path / "maps").mkdir()
    written(tmp_path / "maps", "elsewhere.xodr")
    world = make_world(tmp_path / "data", None)
    assert world.send("red-1", packed(record(1, map="elsewhere"))).status_code == 200
    token = world.accounts["axle"].token
    world.close()
    for words, drawn in ((), False), (("--maps", str(tmp_path / "maps")), True):
        child, address = start_fleet(tmp_path / "data", *words)
        with child:
            try:
                with someone(address, token) as client:
                    text = loaded(client, "/")
            finally:
                os.kill(child.pid, signal.SIGTERM)
        assert "elsewhere: " in text
        assert ("polyline" in text) is drawn


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.req("C-195")
def test_the_pages_in_a_browser(tmp_path):
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright, for chromium, is not installed"
    )
    tokens = filled(tmp_path / "data")
    child, address = start_fleet(tmp_path / "data")
    with child, playwright.sync_playwright() as driver:
        try:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS, timeout=WAIT_MS)
            asked = []
            for size in ({"width": 1280, "height": 900}, {"width": 390, "height": 844}):
                dashboard(browser, address, tokens, size, asked)
            teleoperator(browser, address, tokens)
            strangers(browser, address, tokens)
            ours = (address, address.replace("http", "ws"))
            assert [url for url in asked if not url.startswith(ours)] == []
            browser.close()
        finally:
            os.kill(child.pid, signal.SIGTERM)


def visit(browser, url: str, size=None, asked: list | None = None):
    context = browser.new_context(viewport=size or {"width": 1000, "height": 800})
    page = context.new_page()
    page.set_default_timeout(WAIT_MS)
    if asked is not None:
        page.on("request", lambda request: asked.append(request.url))
    page.goto(url)
    return page


def dashboard(browser, address, tokens, size, asked) -> None:
    page = visit(browser, opened(address, tokens["red operator"]), size, asked)
    assert "token" not in page.url
    page.get_by_role("link", name="replay", exact=True).first.wait_for()
    assert page.get_by_text("9 x ego").count() == 0
    page.get_by_text("6 x ego tailgating, 2 vehicles").wait_for()  # not the blue one's
    page.get_by_text("ego location similarity").wait_for()
    assert page.locator("svg polyline").count() > 10  # the roads of the map
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    comes(page, address, tokens, f"map-{size['width']}")
    picture = os.environ.get("SKIDPAD_PICTURES")
    if picture:
        page.screenshot(path=f"{picture}/dashboard-{size['width']}.png", full_page=True)
    work_list(page, address, size, picture)
    page.get_by_role("link", name="replay", exact=True).first.click()
    page.get_by_text("Play or pause").wait_for()
    page.get_by_text("0.0 s: before the hazard (1.0 to 1.5 s, worst at 1.2 s)").wait_for()
    page.get_by_text("circle: what the hazard is about").wait_for()
    first = page.locator("svg[aria-label]").get_attribute("aria-label")
    page.get_by_text("Play or pause").click()
    page.wait_for_function(
        "before => document.querySelector('svg[aria-label]').getAttribute('aria-label') != before",
        arg=first,
    )
    if picture:
        page.screenshot(path=f"{picture}/replay-{size['width']}.png", full_page=True)
    page.context.close()


def work_list(page, address, size, picture) -> None:
    """A hazard is triaged, found by its state, and its scenario is one click away."""
    page.goto(f"{address}/work")
    page.get_by_text("6 x ego tailgating, 2 vehicles").wait_for()
    state = "new" if size["width"] > 1000 else "open"  # what the other window's visit left
    page.get_by_text(f"state {state}").first.wait_for()
    page.get_by_text("set state").first.click()
    page.get_by_text("The state is open now").wait_for()
    page.goto(f"{address}/work?state=open")
    page.get_by_text("state open, owner red operator").wait_for()
    with page.expect_download() as download:
        page.get_by_text("scenario (.xosc)").first.click()
    assert download.value.suggested_filename.endswith(".zip")
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    if picture:
        page.screenshot(path=f"{picture}/work-{size['width']}.png", full_page=True)
    page.goto(f"{address}/work?state=rejected")
    page.get_by_text("No recurring hazard matches these filters.").wait_for()
    page.goto(f"{address}/")


def comes(page, address, tokens, name) -> None:
    """A record shows on a page that is open already; another operator's does not."""
    for number, vehicle in enumerate(("blue-1", "red-1")):
        headers = {"Authorization": f"Bearer {tokens[vehicle]}", "Idempotency-Key": name + vehicle}
        body = packed(record(100 + number, (5000.0, 5000.0), map=name + vehicle))
        sent = call("POST", f"{address}/api/v1/batches/hazards", headers=headers, content=body)
        assert sent.status_code == 200, sent.text
    page.get_by_text(f"{name}red-1: 1 mark", exact=True).wait_for()
    assert page.get_by_text(f"{name}blue-1").count() == 0


def teleoperator(browser, address, tokens) -> None:
    """An alert shows while the page is open; clicks acknowledge it and order."""
    page = visit(
        browser, opened(address, tokens["red teleoperator"]), {"width": 390, "height": 844}
    )
    page.goto(f"{address}/alerts")
    page.get_by_text("0 open alerts").wait_for()
    vehicle = {"Authorization": f"Bearer {tokens['red-1']}"}
    raised = call(
        "POST",
        f"{address}/api/v1/alerts",
        headers=vehicle | {"Idempotency-Key": "alert-key-1"},
        json=ALERT,
    )
    assert raised.status_code == 200
    page.get_by_text("1 open alert").wait_for()
    page.get_by_text("<b>car</b> ahead stopped").wait_for()  # as text, not as markup
    page.get_by_role("button", name="Acknowledge").click()
    page.get_by_text("8.0 m/s, acknowledged").wait_for()
    page.get_by_role("button", name="Order to stop").click()
    page.get_by_text("acknowledged; stop ordered").wait_for()
    page.get_by_role("button", name="Slow to walking pace").click()
    page.get_by_text("stop ordered; slow ordered").wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    if picture := os.environ.get("SKIDPAD_PICTURES"):
        page.screenshot(path=f"{picture}/alerts-390.png", full_page=True)
    page.context.close()


def logs_in(page, address, tokens) -> None:
    """A wrong credential is refused, a good one opens the role's first page, an address too, once."""
    invitation = opened(address, tokens["red teleoperator"])
    for given, end in (
        ("no credential", "is not known"),
        (tokens["researcher"], f"{address}/research"),
        (invitation, f"{address}/alerts"),
        (invitation, "was used already"),
    ):
        page.context.clear_cookies()
        page.goto(f"{address}/")
        page.get_by_label("One-time address or credential").fill(given)
        if picture := os.environ.get("SKIDPAD_PICTURES"):
            page.screenshot(path=f"{picture}/log-in-{page.viewport_size['width']}.png")
        page.get_by_role("button", name="Log in").click()
        if end.startswith("http"):
            page.wait_for_url(end)
            page.get_by_text("may not").first.wait_for(state="detached")
        else:
            page.get_by_role("alert").get_by_text(end).wait_for()
        assert "token" not in page.url or "used" in end


def strangers(browser, address, tokens) -> None:
    """Roles see their own pages; nobody without a session sees any."""
    page = visit(browser, opened(address, tokens["authority"]))
    page.get_by_text("9 hazards").wait_for()
    page.goto(f"{address}/")  # leads on to the first page of the role
    page.wait_for_url(f"{address}/places")
    page.goto(f"{address}/case")
    page.get_by_text(": open").first.wait_for()  # three vehicles prove nothing
    page.context.close()
    page = visit(browser, f"{address}/")
    logs_in(page, address, tokens)
    page.context.close()
    assert "/api/v1/hazards" in call("GET", f"{address}/api/v1/openapi.json").json()["paths"]
    socket = f"{address}/_nicegui_ws/socket.io/?EIO=4&transport=polling"
    assert call("GET", socket).status_code == 403
    assert (
        call("GET", f"{address}/api/v1/hazards", headers={"Host": "evil.example"}).status_code
        == 403
    )
    cross = {"Authorization": f"Bearer {tokens['axle']}", "Origin": "https://evil.example"}
    assert call("GET", f"{address}/api/v1/hazards", headers=cross).status_code == 403
