"""The card of one run of a scenario: replay, speeds, time to collision, storyboard over time."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.geometry import kmh_from_mps
from skidpad.evidence.bodies import body
from skidpad.evidence.drive.conflict import time_to_collision
from skidpad.evidence.pairs import EGO, following, together
from skidpad.evidence.play_verdicts import Counterpart
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log
from skidpad.recording.run.surfaces import read_surfaces
from skidpad.report.elements.page import Card, Figure, anchor
from skidpad.report.elements.replay import replay_run
from skidpad.report.elements.timeline import Mark, Strip, timelines
from skidpad.report.play.runs import PlayRun, find_road

STORY = "storyboard.csv"
OF_FILE = "file"  # name of the weather that a file describes
OTHERS, EVENTS = 3, 14  # shown at most
TTC_SHOWN, TTC_CRITICAL = 10.0, 1.5  # s
GAP_SHOWN = 60.0  # m
EVENT_LEVEL = 5  # story, act, group, manoeuvre, event
BEGINS, ENDS = ("startTransition",), ("endTransition", "stopTransition")
LABEL = 34  # characters


def run_card(run: PlayRun, out: Path) -> Card:
    """Returns the card of one run of the folder `out`."""
    if run.folder is None:
        return Card(run.name, chain=list(run.judged.reasons), id=run_anchor(run))
    log = read_log(run.folder)
    if not len(log):
        return Card(
            run.name,
            id=run_anchor(run),
            chain=[*run.judged.reasons, "the run ended before its first tick"],
        )
    road = find_road(out, log.header)
    at = None if run.contact is None else int(np.searchsorted(log.t, run.contact[0] - 1e-9))
    return Card(
        title=run.name,
        subtitle=f"{run.duration:.1f} s of simulated time",
        tags=[run.verdict.value],
        facts=facts(run),
        chain=list(run.judged.reasons),
        replay=replay_run(
            log,
            road,
            None if at is None else min(at, len(log) - 1),
            read_surfaces(run.folder),
        ),
        charts=[chart(run, log)],
        id=run_anchor(run),
    )


def run_anchor(run: PlayRun) -> str:
    """Returns the name of the card's place in the page."""
    return "run-" + anchor(run.name)


def run_title(run: PlayRun) -> str:
    """Returns scenario, weather and verdict in one line."""
    where = f" in {run.weather}" if run.weather else ""
    if run.weather == OF_FILE:
        where = " in the weather of its file"
    return f"{run.scenario}{where}: {run.verdict.value}"


def facts(run: PlayRun) -> list[tuple[str, str]]:
    """Returns the numbers of a run and its criterion; what was not there is left out."""
    rows = [
        ("criterion", run.judged.criterion or None),
        ("least gap", _unit(run.least("min_gap_m"), "m")),
        ("least TTC", _unit(run.least("min_ttc_s"), "s")),
        ("largest required deceleration", _unit(run.most("max_required_mps2"), "m/s²")),
    ]
    if run.contact is not None:
        t, what, v = run.contact
        rows.append(
            ("first contact", f"{what} at {t:.2f} s, closing at {kmh_from_mps(v):.0f} km/h")
        )
    return [(name, value) for name, value in rows if value is not None]


def _unit(value: float | None, unit: str) -> str | None:
    """Returns a value with two digits and its unit as text; None stays None."""
    return None if value is None else f"{value:.2f} {unit}"


def chart(run: PlayRun, log: RunLog) -> Figure:
    """Returns a figure of speeds, gaps, times to collision and events over time."""
    strips = [_speed(log, EGO, "speed of the ego")]
    for other in _choose_counterparts(run):
        strips += _of_other(log, other)
    assert run.folder is not None
    events = list(_events(run.folder / STORY, log.t))
    strips += events[:EVENTS]
    marks = [
        Mark(c.contact_t, c.contact_t, f"contact with {c.name}")
        for c in run.others
        if c.contact_t is not None
    ]
    svg = timelines(strips, marks, float(log.t[0]), float(log.t[-1]))
    more = len(events) - EVENTS
    left_out = f"; {more} more event{'s' * (more > 1)} in {STORY}" if more > 0 else ""
    return Figure(
        svg,
        "Speed, gap and time to collision (TTC) over time, then the events of the storyboard while "
        f"they run. Grey: no conflict. Dashes: a TTC of {TTC_CRITICAL} s. Triangles: contacts{left_out}.",
    )


def _choose_counterparts(run: PlayRun) -> list[Counterpart]:
    """Returns the OTHERS counterparts that matter most: those hit, then partners, then the nearest."""
    order = sorted(
        run.others,
        key=lambda c: (
            c.contact_t is None,
            not c.staged,
            not c.encounter.met,
            c.encounter.distance,
        ),
    )
    return order[:OTHERS]


def _speed(log: RunLog, i: int, label: str) -> Strip:
    """Returns the strip of actor `i`'s speed in km/h over time."""
    a = log.actors
    v = np.where(log.present[:, i], kmh_from_mps(1.0) * np.hypot(a.vx[:, i], a.vy[:, i]), np.nan)
    top = float(np.nanmax(v, initial=0.0))
    return _strip(log, label, v, max(10.0, top), f"up to {top:.0f} km/h")


def _of_other(log: RunLog, other: Counterpart) -> list[Strip]:
    """Returns three strips: the counterpart's speed in km/h, its gap in m and TTC in s with the ego."""
    i = log.table.names.index(other.name)
    both = together(log, EGO, i)
    one, two = body(log, EGO), body(log, i)
    ways = [following(one, two), following(two, one)]
    gap = np.fmin(ways[0].gap, ways[1].gap)
    times = [time_to_collision(w.gap, np.nan_to_num(w.v_closing)) for w in ways]
    ttc = np.fmin(*times)
    gap, ttc = np.where(both, gap, np.nan), np.where(both & np.isfinite(ttc), ttc, np.nan)
    return [
        _speed(log, i, f"speed of {other.name}"),
        _strip(log, f"gap to {other.name}", gap, GAP_SHOWN, _least(other.pair.min_gap_m, "m")),
        _strip(
            log, f"TTC with {other.name}", ttc, TTC_SHOWN, _least(other.pair.min_ttc_s, "s"),
            TTC_CRITICAL,
        ),
    ]  # fmt: skip


def _least(value: float | None, unit: str) -> str:
    """Returns "least" with the value and unit as text, "no conflict" for None."""
    return "no conflict" if value is None else f"least {value:.2f} {unit}"


def _strip(
    log: RunLog, label: str, value: Floats, high: float, note: str, threshold: float | None = None
) -> Strip:
    """Returns a strip from 0 to `high`, in alarm where the value is below the threshold; None: never."""
    value = np.asarray(value, np.float64)
    with np.errstate(invalid="ignore"):
        alarm = value < threshold if threshold is not None else np.zeros(len(log), bool)
    return Strip(_short(label), log.t, value, alarm, 0.0, high, threshold, note)


def _events(path: Path, t: Floats) -> Iterator[Strip]:
    """Yields one strip per event that began, 1 while it runs; t: (n,) s of the log."""
    spans: dict[str, list[list[float]]] = {}
    for row in csv.DictReader(path.read_text(encoding="utf-8").splitlines()):
        levels = row["element"].split("::")
        if len(levels) != EVENT_LEVEL:
            continue
        if row["what"] in BEGINS:
            spans.setdefault(row["element"], []).append([float(row["time"]), float(t[-1])])
        elif row["what"] in ENDS and row["element"] in spans:
            spans[row["element"]][-1][1] = float(row["time"])
    for element, found in spans.items():
        runs = np.zeros(len(t))
        for begin, end in found:
            runs[(t >= begin - 1e-9) & (t <= max(end, begin) + 1e-9)] = 1.0
        note = f"from {found[0][0]:.2f} s"
        quiet = np.zeros(len(t), bool)
        yield Strip(_short(f"event {element.rpartition('::')[2]}"), t, runs, quiet, note=note)


def _short(text: str) -> str:
    """Returns the text cut to LABEL characters, with an ellipsis where it was longer."""
    return text if len(text) <= LABEL else text[: LABEL - 1] + "…"
