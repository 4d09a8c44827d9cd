"""Pages that are read: places for the road authority, the safety case, changes and their roll-out."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timezone
from typing import Any

from sqlalchemy import select

from skidpad.evidence.statistics_text import share_text
from skidpad.fleet.insight.places import PlaceRow, places
from skidpad.fleet.insight.research import CELL, HOUR, K, export
from skidpad.fleet.insight.safety import Claim, claims
from skidpad.fleet.insight.trends import trends
from skidpad.fleet.loop.rollout import Rollout, rollouts
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.frame import table
from skidpad.fleet.store.tables import changes
from skidpad.fleet.words import Principal

ROWS = 200  # of the export that its page shows, newest first


def places_of(fleet: Fleet, who: Principal) -> list[PlaceRow]:
    """Returns visible hazards by place and weather, most frequent first; from 3 vehicles on."""
    with fleet.engine.connect() as connection:
        return places(connection, who)


def draw_places(ui: Any, found: Sequence[PlaceRow]) -> None:
    """Adds the table of hazards by place and weather to the page."""
    ui.label(
        f"{sum(r.count for r in found)} hazards; places of fewer than 3 vehicles are left out."
    )
    heads = ["map", "x, y in m", "hazard", "weather", "count", "vehicles", "what to look at"]
    rows = [
        [r.map, f"{r.x:.0f}, {r.y:.0f}", r.hazard.replace("_", " "), r.weather, str(r.count),
         str(r.vehicles), r.advice]
        for r in found
    ]  # fmt: skip
    table(ui, heads, rows)
    ui.label("As HTML and PDF: /api/v1/places.html and /api/v1/places.pdf").classes("dim")


def research_of(fleet: Fleet, who: Principal) -> list[dict[str, Any]]:
    """Returns the rows of the anonymised export, after publishing the hours that are due."""
    del who  # the export is the same for everybody with the right
    return export(fleet)


def draw_research(ui: Any, found: Sequence[dict[str, Any]]) -> None:
    """Adds the newest ROWS rows of the anonymised export to the page, and where all of them are."""
    count = f"{len(found)} row{'' if len(found) == 1 else 's'}"
    ui.label(
        f"{count}: places of {CELL:g} m in one hour where at least {K} vehicles reported a hazard;"
        " an hour appears a day after it ended."
    )
    heads = ["hour (UTC)", "map", "x, y in m", "hazard", "weather", "at least"]
    rows = [
        [f"{datetime.fromtimestamp(r['hour'] * HOUR, timezone.utc):%Y-%m-%d %H}:00", r["map"],
         f"{r['x']:.0f}, {r['y']:.0f}", r["hazard"].replace("_", " "), r["weather"],
         str(r["hazards_at_least"])]
        for r in found[: -ROWS - 1 : -1]
    ]  # fmt: skip
    if rows:
        table(ui, heads, rows)
    ui.label("All rows as JSON, with your credential: /api/v1/research").classes("dim")


def case_of(fleet: Fleet, who: Principal) -> list[Claim]:
    """Returns the claims of the safety case by the newest trends of visible vehicles."""
    return claims(trends(fleet, who))


def draw_case(ui: Any, found: Sequence[Claim]) -> None:
    """Adds the safety case with current evidence to the page."""
    last = ""
    for claim in found:
        if claim.argument != last:
            last = claim.argument
            ui.label(claim.argument).style("font-size: 16px")
        with ui.element("div").classes("card"):
            ui.label(f"{claim.id} {claim.claim}: {claim.verdict}")
            if claim.share is not None and claim.interval is not None:
                share = share_text(claim.share, claim.interval)
                text = f"worst indicator beyond its bound: {share} of cycles"
                ui.label(f"{text}, {claim.vehicles} vehicles").classes("dim")


def changes_of(fleet: Fleet, who: Principal) -> list[tuple[Rollout, str]]:
    """Returns the releases with the reason that each change was proposed for."""
    with fleet.engine.connect() as connection:
        query = select(changes.c.id, changes.c.reason).where(changes.c.tenant == who.tenant)
        reasons = {row.id: row.reason for row in connection.execute(query)}
        return [(one, reasons[one.row.change]) for one in rollouts(connection, who.tenant)]


def draw_changes(ui: Any, found: Sequence[tuple[Rollout, str]]) -> None:
    """Adds the releases to the page, newest first, with every look."""
    if not found:
        ui.label("Nothing was released yet.").classes("dim")
    for one, reason in reversed(found):
        _release(ui, one, reason)


def effect_text(one: Rollout) -> str:
    """Returns what the last look measured of the update, in errors per drive."""
    measured = [e.detail for e in one.events if isinstance(e.detail.get("mean"), float)]
    if not measured:
        return "not measured yet"
    mean, drives = measured[-1]["mean"], measured[-1]["drives"]
    many = f"{drives} drive{'' if drives == 1 else 's'}"
    if mean == 0.0:
        return f"as many errors per drive as before, over {many}"
    return f"{abs(mean):.2f} {'more' if mean > 0.0 else 'fewer'} errors per drive, over {many}"


def _release(ui: Any, one: Rollout, reason: str) -> None:
    """Adds the card of a release to the page: state, effect and events so far."""
    with ui.element("div").classes("card"):
        state = one.outcome or f"stage {one.stage + 1} of {len(one.plan.stages)}"
        ui.label(f"{reason}: {state}")
        ui.label(effect_text(one))
        ui.label(f"{one.name}, in place of {one.row.before or 'what vehicles came with'}").classes(
            "dim"
        )
        rows = [
            [e.what, str(e.detail.get("decision", e.detail.get("reason", ""))),
             str(e.detail.get("drives", "")), _number(e.detail.get("mean")),
             _number(e.detail.get("p_worse")), _number(e.detail.get("p_no_worse"))]
            for e in one.events
        ]  # fmt: skip
        heads = ["what", "decision", "drives", "errors per drive", "p worse", "p no worse"]
        table(ui, heads, rows)


def _number(value: Any) -> str:
    """Returns a float with three digits as text, "" for anything else."""
    return f"{value:.3g}" if isinstance(value, float) else ""
