"""What all pages share: the head with those links that the role may open, and refusals as text."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from html import escape
from typing import Any, TypeVar

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from skidpad.core.errors import SkidpadError
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.acting import visitor
from skidpad.fleet.words import FIRST_PAGE, Action, Principal, Refused
from skidpad.pages.site import nicegui

Found = TypeVar("Found")  # what a page shows
LINKS = (
    ("Dashboard", "/", Action.READ_TRENDS),
    ("Work list", "/work", Action.READ_TRENDS),
    ("Alerts", "/alerts", Action.READ_ALERTS),
    ("Places", "/places", Action.READ_PLACES),
    ("Safety case", "/case", Action.READ_SAFETY_CASE),
    ("Changes", "/changes", Action.READ_CHANGES),
    ("Research", "/research", Action.READ_RESEARCH),
)
STYLE = """
.fleet, .parts { width: 100%; max-width: 1100px; margin: 0 auto; display: flex;
  flex-direction: column; gap: 10px; }
.fleet nav { display: flex; flex-wrap: wrap; gap: 12px; align-items: baseline; }
.fleet nav a { color: var(--accent); }
.fleet .h2 { font-size: 16px; margin: 6px 0 0; line-height: 1.3; }
.fleet section, .fleet .card { background: var(--card); border: 1px solid var(--line);
  border-radius: 6px; padding: 10px; }
.fleet .scroll { overflow-x: auto; max-width: 100%; }
.fleet table { border-collapse: collapse; }
.fleet td, .fleet th { padding: 3px 8px; text-align: left; border-bottom: 1px solid var(--line);
  white-space: nowrap; }
.fleet .few { display: grid; grid-template-columns: repeat(auto-fill, minmax(220px, 1fr)); gap: 10px; }
.fleet .dim { color: var(--dim); }
.fleet button { min-height: 40px; }
"""


def page(
    fleet: Fleet,
    action: Action,
    title: str,
    read: Callable[[Principal, Request], Found],
    draw: Callable[[Any, Found], None],
) -> Callable[[Request], Awaitable[None]]:
    """Returns a builder of a page: calls `read` in a thread, then `draw`, if the visitor may `action`.

    Else the page says what was refused; / leads to the role's first page.
    """

    async def build(request: Request) -> None:
        ui = nicegui().ui
        with ui.element("div").classes("fleet"):
            try:
                who = await run_in_threadpool(visitor, fleet, request)
                head(ui, who, title)
                if not who.may(action):
                    ui.label(f"The role {who.role.value} may not {action.value}.")
                    if request.url.path == "/":  # where the fleet's address leads
                        ui.navigate.to(FIRST_PAGE[who.role])
                    return
                draw(ui, await run_in_threadpool(read, who, request))
            except Refused as error:
                ui.label(str(error))
            except SkidpadError as error:
                ui.label(f"This could not be read: {error}")

    return build


def head(ui: Any, who: Principal, title: str) -> None:
    """Adds title, the visitor's name and role, and links to the pages that the role may open."""
    with ui.element("nav"):
        ui.label(title).style("font-size:20px")
        for name, path, action in LINKS:
            if who.may(action):
                ui.link(name, path)
        ui.label(f"{who.name}, {who.role.value}").classes("dim")


def table(ui: Any, heads: list[str], rows: list[list[str]]) -> None:
    """Adds a table of plain text that scrolls by itself on a phone."""
    top = "".join(f"<th>{escape(h)}</th>" for h in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    markup = f"<table><tr>{top}</tr>{body}</table>"
    ui.html(markup, sanitize=False).classes("scroll")


async def say(ui: Any, act: Callable[[], Any], done: str) -> None:
    """Calls `act` in a thread and shows `done`, or the sentence of its error."""
    try:
        await run_in_threadpool(act)
    except SkidpadError as error:
        ui.notify(str(error), type="negative")
    else:
        ui.notify(done)
