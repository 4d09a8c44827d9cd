"""The work list: recurring hazards, ranked, filtered, and triaged."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import datetime, timezone
from typing import Any, NamedTuple
from urllib.parse import urlencode

from starlette.concurrency import run_in_threadpool
from starlette.requests import Request

from skidpad.core.environment.localities import RoadKind
from skidpad.core.errors import SkidpadError
from skidpad.fleet.api.recurring import TriageText, work_list
from skidpad.fleet.insight.triage import SETTABLE, State
from skidpad.fleet.insight.worklist import NOTABLE_FROM, SEVERE_FROM, Severity, Work, WorkFilter
from skidpad.fleet.service import Fleet
from skidpad.fleet.site.acting import click_export, click_triage
from skidpad.fleet.site.frame import say
from skidpad.fleet.words import Action, Principal

SHOWN = 50
DAY = 86_400.0
ALL = "all"
PERIODS = {"7 days": 7, "30 days": 30, "90 days": 90}  # by the word of the filter

WORK_NOTE = (
    "Ranked by risk times the measured precision of the kind of alarm. Risk is 1 less the least safety"
    " score of the alarm. Alarms without a score, and kinds without a measured precision, count in full."
    f" Severity is of the worst alarm: severe from risk {SEVERE_FROM:g} on, notable from {NOTABLE_FROM:g}."
)


class WorkPage(NamedTuple):
    """What the page shows: the chosen filters by name, what can be chosen, and the list."""

    fleet: Fleet
    who: Principal
    chosen: dict[str, str]
    choices: dict[str, list[str]]
    work: list[Work]


def work_of(fleet: Fleet, who: Principal, request: Request) -> WorkPage:
    """Returns the work list as far as the address's filters ask; unknown filters and values are ignored."""
    chosen = {k: v for k, v in request.query_params.items() if v != ALL}
    everything = work_list(fleet, who, WorkFilter())
    choices = {
        "state": [s.value for s in State],
        "owner": _words(w.standing.owner for w in everything),
        "map": _words(w.cluster["map"] for w in everything),
        "weather": _words(a.weather for w in everything for a in w.alarms),
        "release": _words(a.release for w in everything for a in w.alarms),
        "severity": [s.value for s in Severity if s in {w.severity for w in everything}],
        "road": [k.value for k in RoadKind if k in {w.place.kind for w in everything if w.place}],
        "period": list(PERIODS),
    }
    chosen = {k: v for k, v in chosen.items() if v in choices.get(k, ())}
    days = PERIODS.get(chosen.get("period", ""))
    wanted = WorkFilter(
        state=State(chosen["state"]) if "state" in chosen else None,
        owner=chosen.get("owner"),
        map=chosen.get("map"),
        weather=chosen.get("weather"),
        release=chosen.get("release"),
        severity=Severity(chosen["severity"]) if "severity" in chosen else None,
        road=RoadKind(chosen["road"]) if "road" in chosen else None,
        since=None if days is None else fleet.clock() - days * DAY,
    )
    return WorkPage(fleet, who, chosen, choices, work_list(fleet, who, wanted))


def _words(values: Any) -> list[str]:
    """Returns the different values that are not empty, sorted."""
    return sorted({v for v in values if v})


def draw_work(ui: Any, found: WorkPage) -> None:
    """Adds the filters and a card for each of the first SHOWN recurring hazards to the page."""
    with ui.element("section"):
        ui.label(WORK_NOTE).classes("dim")
        with ui.element("div").classes("few"):
            for name, values in found.choices.items():
                ui.select(
                    [ALL, *values], value=found.chosen.get(name, ALL), label=name,
                    on_change=_navigate(ui, found.chosen, name),
                )  # fmt: skip
    for rank, one in enumerate(found.work[:SHOWN], 1):
        _card(ui, found, rank, one)
    if not found.work:
        ui.label("No recurring hazard matches these filters.")


def _navigate(ui: Any, chosen: dict[str, str], name: str) -> Callable[[Any], None]:
    """Returns the handler of a change of the filter `name`: it opens the list anew with it."""

    def change(event: Any) -> None:
        ui.navigate.to("/work?" + urlencode(chosen | {name: event.value}))

    return change


def _card(ui: Any, found: WorkPage, rank: int, one: Work) -> None:
    """Adds the card of a recurring hazard to the page, with what the principal may do."""
    with ui.element("div").classes("card"):
        ui.label(f"{rank}. {work_title(one)}")
        ui.label(work_text(one)).classes("dim")
        ui.label(standing_text(one))
        with ui.element("nav"):
            hazard = str(one.cluster["representative"])
            ui.link("replay", f"/replay/{hazard}")
            if found.who.may(Action.EXPORT_SCENARIO):
                ui.button("scenario (.xosc)", on_click=_export(ui, found, hazard))
        if found.who.may(Action.TRIAGE):
            _triage(ui, found, one)


def _export(ui: Any, found: WorkPage, hazard: str) -> Callable[[], Any]:
    """Returns the handler of a click on a scenario's button: downloads a .zip, or shows an error."""

    async def click() -> None:
        try:
            content = await run_in_threadpool(click_export, found.fleet, found.who.id, hazard)
        except SkidpadError as error:
            ui.notify(str(error), type="negative")
        else:
            ui.download(content, f"{hazard}.zip")

    return click


def _triage(ui: Any, found: WorkPage, one: Work) -> None:
    """Adds the fields for state, owner and release of a recurring hazard to the page."""
    with ui.element("nav"):
        state = ui.select([s.value for s in SETTABLE], value=State.OPEN.value, label="new state")
        state.style("min-width:120px")
        owner = ui.input("owner", value=one.standing.owner or found.who.name)
        release = ui.input("fixed by release", value=one.standing.release)

        async def click() -> None:
            text = TriageText(State(state.value), owner.value, release.value)
            await say(
                ui, lambda: click_triage(found.fleet, found.who.id, one.subject, text),
                f"The state is {state.value} now; open the page again to see it.",
            )  # fmt: skip

        ui.button("set state", on_click=click)


def work_title(one: Work) -> str:
    """Returns how many alarms of which kind there are, of how many vehicles, and where."""
    c, n = one.cluster, len(one.alarms)
    vehicles = f"{c['vehicles']} vehicle{'' if c['vehicles'] == 1 else 's'}"
    point = f"x {c['x']:.0f} m, y {c['y']:.0f} m"
    where = f"{c['map']}, {point if one.place is None else one.place.describe()}"
    return f"{n} x {c['type'].replace('_', ' ')}, {vehicles}, {where}"


def work_text(one: Work) -> str:
    """Returns the risk, how many alarms are likely true, the period (UTC) and the trend."""
    measured, risk = one.precision, one.mean_risk
    likely = (
        "precision not measured"
        if measured is None
        else f"about {one.likely_true:.1f} likely true ({measured.describe()})"
    )
    mean = "" if risk is None else f"{one.severity.value}, mean risk {risk:.2f}; "
    first, last = (
        f"{datetime.fromtimestamp(at, timezone.utc):%Y-%m-%d}" for at in (one.first, one.last)
    )
    period = first if first == last else f"{first} to {last}"
    if one.first == one.last:
        return f"{mean}{likely}; {period}, all at once"
    trend = f"{one.earlier} in the first half, {one.later} in the second"
    return f"{mean}{likely}; {period}, {trend}"


def standing_text(one: Work) -> str:
    """Returns state, owner, release and since when (UTC) in words; unknown ones are left out."""
    standing = one.standing
    parts = [f"state {standing.state.value}"]
    if standing.owner:
        parts.append(f"owner {standing.owner}")
    if standing.release:
        came_back = standing.state is State.REOPENED
        parts.append(f"{'came back in' if came_back else 'fixed by'} release {standing.release}")
    if standing.at is not None:
        parts.append(
            f"since {datetime.fromtimestamp(standing.at, timezone.utc):%Y-%m-%d %H:%M} UTC"
        )
    return ", ".join(parts)


def draw_top(ui: Any, work: Sequence[Work], most: int) -> None:
    """Adds the first `most` hazards of the list to the page, for the dashboard."""
    for rank, one in enumerate(work[:most], 1):
        with ui.element("div").classes("card"):
            ui.label(f"{rank}. {work_title(one)}")
            ui.label(f"{work_text(one)}; {standing_text(one)}").classes("dim")
            ui.link("replay", f"/replay/{one.cluster['representative']}")
    if work:
        ui.link("the whole work list, with filters and triage", "/work")
    else:
        ui.label("Nothing was found to recur.").classes("dim")
