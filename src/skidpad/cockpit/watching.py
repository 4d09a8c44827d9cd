"""How a campaign stands while it runs: read from its ledger, which is whole up to its last line."""

from __future__ import annotations

import base64
import time
import webbrowser
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from pathlib import Path
from shlex import quote
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import msgspec

from skidpad.campaign.recipes.recipe import cell_of
from skidpad.cockpit.serving import has_screen
from skidpad.core.errors import FileError, InputError
from skidpad.core.files.names import inside
from skidpad.core.vocabulary import ENDED, Outcome
from skidpad.evidence.statistics import clopper_pearson
from skidpad.pages.server import Place, Server
from skidpad.pages.site import nicegui, site
from skidpad.recording.campaign.folder import RUNS, last_snapshot
from skidpad.recording.campaign.ledger import CAMPAIGN, LEDGER, latest, read_identity, read_ledger

if TYPE_CHECKING:
    from skidpad.cockpit.crash_film import CrashFilms

WRAPPED = "overflow-wrap: anywhere"  # the name of a folder may be wider than a phone
GOOD = "without a crash"
REFRESH = 2.0  # s
FATAL = (
    "fatal_collisions",
    "collisions",
    "contacts",
)  # columns that count crashes, first one there
IMPACTS = ("max_impact_kmh", "impact_kmh")  # columns: closing speed, largest or of first contact
LEFT_OUT = (Outcome.CRASHED.value, Outcome.TIMEOUT.value, Outcome.AGENT_ERROR.value)


class Key(msgspec.Struct, frozen=True):
    """What every campaign's key has."""

    outcome: str


class Line(msgspec.Struct, frozen=True):
    """A line of any campaign's ledger."""

    run: str
    key: Key
    metrics: dict[str, Any] | None = None
    error: str = ""


@dataclass(frozen=True, slots=True)
class Cell:
    """The runs of a cell so far."""

    name: str
    runs: int
    good: int
    low: float  # share of good ones, 95 % interval (Clopper and Pearson)
    high: float


@dataclass(frozen=True, slots=True)
class Standing:
    """Holds how far a campaign has come, and with which outcomes."""

    command: str
    done: int
    planned: int | None  # None: the campaign does not say
    outcomes: dict[str, int]
    cells: tuple[Cell, ...]
    worst_crash: str  # name of the run with the hardest one; "": none yet
    picture: Path | None = None  # the last one that was taken in that run
    run: Path | None = None  # folder of that run; None: not kept


def standing(folder: Path) -> Standing:
    """Reads how far the campaign in `folder` has come; FileError when it is none."""
    if not (folder / CAMPAIGN).is_file() and not (folder / LEDGER).is_file():
        raise FileError(f"{folder} is not the folder of a campaign: it has no {LEDGER}")
    identity = read_identity(folder)
    in_order = read_ledger(folder, Line)  # type: ignore[type-var]
    lines: list[Line] = latest(in_order)  # type: ignore[type-var]
    counted = [one for one in lines if one.key.outcome not in LEFT_OUT]
    cells: dict[str, list[bool]] = {}
    for one in counted:
        cells.setdefault(cell_of(one.run), []).append(not has_crashed(one))
    crashed = [one for one in in_order if has_crashed(one)]
    worst = max(reversed(crashed), key=impact_of).run if crashed else ""
    run = inside(folder / RUNS, worst) if worst else None
    return Standing(
        command=str(identity.get("command", "adas")),
        done=len(lines),
        planned=identity.get("runs"),
        outcomes=dict(sorted(Counter(one.key.outcome for one in lines).items())),
        cells=tuple(_cell(name, good) for name, good in sorted(cells.items())),
        worst_crash=worst,
        picture=None if run is None else last_snapshot(run),
        run=run if run is not None and run.is_dir() else None,
    )


def has_crashed(line: Line) -> bool:
    """Returns True when the ego hit something or lay on its side, by outcome or by counts."""
    if line.key.outcome in ENDED:
        return True
    metrics = line.metrics or {}
    counts = [metrics[name] for name in FATAL if metrics.get(name) is not None]
    return bool(counts) and counts[0] > 0


def impact_of(line: Line) -> float:
    """Returns the closing speed in km/h by which crashes are ranked; -1 where it is not known.

    The largest of the run; of `grip`, that of the first contact. Infinite where the ego lay on its
    side, which ranks above every contact.
    """
    metrics = line.metrics or {}
    if line.key.outcome == Outcome.ROLL_OVER.value or (metrics.get("roll_overs") or 0) > 0:
        return inf
    return max((metrics[name] for name in IMPACTS if metrics.get(name) is not None), default=-1.0)


def _cell(name: str, good: list[bool]) -> Cell:
    """Returns a cell's share of good runs with its 95 % interval."""
    interval = clopper_pearson(sum(good), len(good))
    return Cell(name, len(good), sum(good), float(interval.low), float(interval.high))


def lines(now: Standing) -> list[str]:
    """Returns the standing of a campaign as lines of text."""
    planned = "" if now.planned is None else f" of {now.planned}"
    told = [f"{now.command}: {now.done}{planned} runs done"]
    told.append(", ".join(f"{n} {outcome}" for outcome, n in now.outcomes.items()) or "none yet")
    told += [
        f"{c.name}: {c.good} of {c.runs} {GOOD}, 95 % {c.low:.2f} to {c.high:.2f}"
        for c in now.cells
    ]
    told.append(f"worst crash: {now.worst_crash or 'none'}")
    if now.run is not None:
        replay = f"skidpad replay {quote(str(now.run))}"
        told[-1] += f"  ({replay} begins before its fastest crash)"
    return told


COLUMNS: list[dict[str, Any]] = [
    {"name": "name", "label": "cell", "field": "name", "align": "left", "sortable": True},
    {"name": "runs", "label": "runs", "field": "runs", "sortable": True},
    {"name": "good", "label": GOOD, "field": "good", "sortable": True},
    {"name": "interval", "label": "95 %", "field": "interval"},
]


def build(folder: Path, films: CrashFilms) -> Callable[[], None]:
    """Returns a function that builds the page of a campaign's standing, read anew every REFRESH s.

    films: of its worst crash; the last picture of that run where there is none.
    """

    def page() -> None:
        from nicegui import ui

        ui.label(str(folder)).style(f"font-size: 18px; font-weight: 600; {WRAPPED}")
        bar = ui.linear_progress(value=0.0, show_value=False).props("size=14px rounded")
        said = ui.label()
        crash = ui.label().style(WRAPPED)
        picture = ui.image().props("no-spinner").style("width: 100%; max-width: 640px")
        table = ui.table(columns=COLUMNS, rows=[], row_key="name").props("dense flat dark")
        table.style("width: 100%")
        shown: list[Path | None] = [None]

        def refresh() -> None:
            try:
                now = standing(folder)
            except InputError as error:
                said.text = str(error)
                return
            films.draw(now.run)
            head = lines(now)
            said.text = f"{head[0]}; {head[1]}"
            found = films.find(now.run) or now.picture
            pictured = "last picture of that run" if now.picture else ""
            seen = films.describe(now.run) or pictured
            crash.text = f"{head[-1]}; {seen}" if seen else head[-1]
            if found != shown[0]:
                picture.set_source("" if found is None else as_address(found))
                shown[0] = found
            picture.set_visibility(found is not None)
            bar.value = now.done / now.planned if now.planned else 0.0
            table.rows = [
                {
                    "name": c.name,
                    "runs": c.runs,
                    "good": c.good,
                    "interval": f"{c.low:.2f} to {c.high:.2f}",
                }
                for c in now.cells
            ]
            table.update()

        refresh()
        ui.timer(REFRESH, refresh)

    return page


def as_address(picture: Path) -> str:
    """Returns a picture's file, .png or .webp, as a data URI, so that no folder is served."""
    kind = picture.suffix.removeprefix(".")
    return f"data:image/{kind};base64," + base64.b64encode(picture.read_bytes()).decode()


def serve_watch(folder: Path, place: Place, say: Callable[[str], None], browser: bool) -> None:
    """Serves the page until Ctrl-C; FileError when `folder` is no campaign's.

    say: takes the address. browser: opens one where there is a screen.
    """
    from skidpad.cockpit.crash_film import CrashFilms  # draws: `--once` needs none of it

    standing(folder)
    nicegui()
    with TemporaryDirectory() as drawn, CrashFilms(Path(drawn)) as films:
        application = site("Skidpad watch", {"/": build(folder, films)})
        with Server(application, place) as server:
            address = server.address()
            say(f"watch: {address}  (Ctrl-C ends it)")
            if browser and has_screen():
                webbrowser.open(address)
            try:
                while True:
                    time.sleep(REFRESH)
            except KeyboardInterrupt:
                say("ended")
