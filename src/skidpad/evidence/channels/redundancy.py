"""Does redundancy pay? The same seeds driven by each channel alone and by the arbiter (C-9)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

from skidpad.core.run import ARBITER
from skidpad.evidence.statistics import Comparison, Rate, compare_pairs, event_rate
from skidpad.recording.channels.drives import DriveOutcome

EVENTS = ("collisions", "collisions_struck", "red_lights_run", "stalls")
Key = tuple[str, int]  # route and seed


@dataclass(frozen=True, slots=True)
class DriverRow:
    """One driver on the segments that all drivers have driven."""

    drive_by: str
    segments: int
    hours: float
    km: float
    rates: dict[str, Rate]  # per hour, by name of the event


@dataclass(frozen=True, slots=True)
class Difference:
    """A channel alone less the arbiter, per segment."""

    drive_by: str
    event: str
    pairs: Comparison


def compare_drivers(outcomes: Sequence[DriveOutcome]) -> list[DriverRow]:
    """Returns rates per driver over the routes and seeds that every driver has: paired by seed (X-8).

    Without a shared one the rates are empty.
    """
    runs = _by_driver(outcomes)
    shared = set.intersection(*(set(r) for r in runs.values())) if runs else set()
    rows = []
    for driver, driven in sorted(runs.items()):
        chosen = [driven[key] for key in sorted(shared)]
        hours = [o.driven_s / 3600.0 for o in chosen]
        rates = {
            event: event_rate([getattr(o, event) for o in chosen], hours)
            for event in EVENTS
            if chosen
        }
        km = sum(o.distance_m for o in chosen) / 1000.0
        rows.append(DriverRow(driver, len(chosen), sum(hours), km, rates))
    return rows


def differences(outcomes: Sequence[DriveOutcome]) -> list[Difference]:
    """Returns each channel alone less the arbiter where both drove the same route and seed, per event."""
    runs = _by_driver(outcomes)
    arbiter = runs.pop(ARBITER, {})
    found = []
    for driver, alone in sorted(runs.items()):
        both = sorted(set(alone) & set(arbiter))
        for event in EVENTS:
            less = [getattr(alone[k], event) - getattr(arbiter[k], event) for k in both]
            if less:
                found.append(Difference(driver, event, compare_pairs(less)))
    return found


def _by_driver(outcomes: Sequence[DriveOutcome]) -> dict[str, dict[Key, DriveOutcome]]:
    """Returns the outcomes by driver, and by route and seed."""
    runs: dict[str, dict[Key, DriveOutcome]] = defaultdict(dict)
    for o in outcomes:
        runs[o.drive_by][o.route, o.seed] = o
    return runs
