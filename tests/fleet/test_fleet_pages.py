"""The pages in a real browser, served by the command: who sees what, alerts live, phone width."""

from __future__ import annotations

import gzip
import json
import os
import signal
import time
from pathlib import Path

import httpx
import pytest
from test_fleet_insight import row
from test_fleet_upload import served

from chromium import CHROMIUM, FLAGS
from fleet_world import make_world, packed, record
from skidpad.fleet.alerting.keeping import What
from skidpad.fleet.alerting.orders import Order
from skidpad.fleet.site.acting import click_analyse, click_answer, click_order
from skidpad.fleet.words import Refused

WAIT_MS = 120_000
SCENE = {"map": "town", "ego": {"x": 1.0, "y": 2.0, "heading": 0.1}, "v": 8.0}
ALERT = {"kind": "hazard", "text": "<b>car</b> ahead stopped", "scene": SCENE}


def call(method: str, url: str, **rest) -> httpx.Response:
    """One request with patience: a busy machine is no fault."""
    with httpx.Client(timeout=WAIT_MS / 1000, trust_env=False) as client:
        return client.request(method, url, **rest)


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


def filled(data: Path) -> dict[str, str]:
    """A store with hazards, indicators and people; their credentials by name."""
    world = make_world(data, None)
    world.clock.now = time.time()
    for k in range(3):
        name = ("red-1", "red-2", "blue-1")[k]
        hazards = [record(10 * k + i, (120.0 + i, 30.0)) for i in range(3)]
        assert world.send(name, packed(*hazards), f"batch-key-{k}").status_code == 200
        rows = gzip.compress(json.dumps(row(0, 200 + 20 * k)).encode())
        assert world.send(name, rows, f"rows-key-{k}", "indicators").status_code == 200
    world.post("red operator", "/api/v1/analyses")
    tokens = {name: account.token for name, account in world.accounts.items()}
    world.close()
    return tokens


def opened(address: str, token: str) -> str:
    answer = call("POST", f"{address}/api/v1/session", headers={"Authorization": f"Bearer {token}"})
    assert answer.status_code == 200, answer.text
    return address + answer.json()["path"]


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="chromium is not installed")
@pytest.mark.req("C-195")
def test_the_pages_in_a_browser(tmp_path):
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright, for chromium, is not installed"
    )
    tokens = filled(tmp_path / "data")
    child, address = served(tmp_path / "data")
    with child, playwright.sync_playwright() as driver:
        try:
            browser = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS, timeout=WAIT_MS)
            asked = []
            for size in ({"width": 1280, "height": 900}, {"width": 390, "height": 844}):
                dashboard(browser, address, tokens["red operator"], size, asked)
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


def dashboard(browser, address, token, size, asked) -> None:
    page = visit(browser, opened(address, token), size, asked)
    assert "token" not in page.url
    page.get_by_text("replay the representative").wait_for()
    assert page.get_by_text("9 x ego").count() == 0
    page.get_by_text("6 x ego tailgating, 2 vehicles").wait_for()  # not the blue one's
    page.get_by_text("ego location similarity").wait_for()
    assert page.locator("svg polyline").count() > 10  # the roads of the map
    assert page.evaluate("document.documentElement.scrollWidth") <= size["width"]
    picture = os.environ.get("SKIDPAD_PICTURES")
    if picture:
        page.screenshot(path=f"{picture}/dashboard-{size['width']}.png", full_page=True)
    page.get_by_text("replay the representative").click()
    page.get_by_text("Play or pause").wait_for()
    first = page.locator("svg[aria-label]").get_attribute("aria-label")
    page.get_by_text("Play or pause").click()
    page.wait_for_function(
        "before => document.querySelector('svg[aria-label]').getAttribute('aria-label') != before",
        arg=first,
    )
    if picture:
        page.screenshot(path=f"{picture}/replay-{size['width']}.png", full_page=True)
    page.context.close()


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
    page.get_by_text("1 open alerts").wait_for()
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


def strangers(browser, address, tokens) -> None:
    """Roles see their own pages; nobody without a session sees any."""
    page = visit(browser, opened(address, tokens["authority"]))
    page.get_by_text("may not read trends").wait_for()
    page.goto(f"{address}/places")
    page.get_by_text("9 hazards").wait_for()
    page.goto(f"{address}/case")
    page.get_by_text(": open").first.wait_for()  # three vehicles prove nothing
    page.context.close()
    page = visit(browser, f"{address}/")
    assert "this page needs the address" in page.content()
    page.context.close()
    socket = f"{address}/_nicegui_ws/socket.io/?EIO=4&transport=polling"
    assert call("GET", socket).status_code == 403
    assert (
        call("GET", f"{address}/api/v1/hazards", headers={"Host": "evil.example"}).status_code
        == 403
    )
    cross = {"Authorization": f"Bearer {tokens['axle']}", "Origin": "https://evil.example"}
    assert call("GET", f"{address}/api/v1/hazards", headers=cross).status_code == 403
