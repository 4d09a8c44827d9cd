"""Does redundancy pay? The same seeds driven by each channel alone and by the arbiter (C-9)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from skidpad.campaign.channel_outcomes import DriveOutcome
from skidpad.campaign.channels import DriveRecord
from skidpad.core.errors import FileError
from skidpad.evidence.statistics import Rate, event_rate

EVENTS = ("collisions", "collisions_struck", "red_lights_run", "stalls")


@dataclass(frozen=True, slots=True)
class DriverRow:
    """One driver on the segments that all drivers have driven."""

    drive_by: str
    segments: int
    hours: float
    km: float
    rates: dict[str, Rate]  # per hour, by name of the event


def read_outcomes(folders: Iterable[Path]) -> list[DriveOutcome]:
    """All finished segments below the folders; FileError when there is none."""
    outcomes = []
    folders = list(folders)
    for folder in folders:
        for path in sorted(folder.rglob("*.json")):
            try:
                record = msgspec.json.decode(path.read_bytes(), type=DriveRecord)
            except (msgspec.DecodeError, OSError):
                continue  # some other command's file
            outcomes.append(record.outcome)
    if not outcomes:
        raise FileError(f"no driven segments below {', '.join(map(str, folders))}")
    return outcomes


def compare_drivers(outcomes: Sequence[DriveOutcome]) -> list[DriverRow]:
    """Rates per driver over the routes and seeds that every driver has: paired by seed (X-8)."""
    by_driver: dict[str, dict[tuple[str, int], DriveOutcome]] = defaultdict(dict)
    for o in outcomes:
        by_driver[o.drive_by][o.route, o.seed] = o
    shared = set.intersection(*(set(runs) for runs in by_driver.values()))
    rows = []
    for driver, runs in sorted(by_driver.items()):
        chosen = [runs[key] for key in sorted(shared)]
        hours = [o.driven_s / 3600.0 for o in chosen]
        rates = {
            event: event_rate([getattr(o, event) for o in chosen], hours)
            for event in EVENTS
            if chosen
        }
        rows.append(
            DriverRow(
                driver, len(chosen), sum(hours), sum(o.distance_m for o in chosen) / 1000.0, rates
            )
        )
    return rows
