"""What stands beside the recording of a driven segment: what was asked for, what became of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum
from math import dist
from pathlib import Path
from typing import Any

import msgspec

from skidpad.core.files.reading import UNUSABLE
from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns

WAY_STEP = 10.0  # m between two places of a way


class Ending(str, Enum):
    """Why the drive of a segment ended."""

    TIME = "time"
    STALLED = "stalled"
    OFF_ROUTE = "off the route"


def column(meaning: str, source: str) -> Any:
    """Returns the field of a results column that every driven segment has."""
    return field(metadata={"meaning": meaning, "source": source})


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveKey:
    """Which segment a row is about, and how it ended."""

    route: str  # name of the route
    seed: int  # seed of the segment
    drive_by: str  # the arbiter, or the channel that drives alone
    outcome: str  # how the run ended
    version: str = ""  # of Skidpad
    log_hash: str | None = None  # content hash of the recording


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveMetrics:
    """What became of a segment; counts unless said otherwise."""

    driven_s: float = column("simulated time", "C-12")
    distance_m: float = column("way of the ego", "C-9")
    collisions: int = column("collisions of the ego, once per 3 s with the same actor", "C-9")
    collisions_struck: int = column("of these: the ego hit, seen by who closed in", "C-9")
    red_lights_run: int = column("stop lines passed at red", "C-9")
    stalls: int = column("standing for a minute without a cause", "C-9")
    ended: Ending = column("why it ended", "C-9")
    switches: int = column("changes of the driving channel", "C-9")
    minimal_risk_s: float = column("time in a minimal-risk stop", "C-9")


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveOutcome(DriveMetrics):
    """The same with the segment's identity, as it stands beside the recording."""

    route: str  # name of the route
    seed: int  # seed of the segment
    drive_by: str  # the arbiter, or the channel that drives alone
    driving_s: dict[str, float]  # s, that each channel drove
    content_hash: str = ""  # of the recording
    cpu_s: float = 0.0  # s, of the processor; outside every hash
    way: tuple[tuple[float, float], ...] = ()  # m, places of the ego WAY_STEP apart


def extend_way(way: list[tuple[float, float]], x: float, y: float) -> None:
    """Appends a place in m to a way, unless it is less than WAY_STEP from the last one."""
    if not way or dist((x, y), way[-1]) >= WAY_STEP:
        way.append((round(x, 1), round(y, 1)))


DRIVES = Columns(DriveKey, DriveMetrics, ("route", "seed", "drive_by"))
DriveEntry = Entry[DriveKey, DriveMetrics]


class DriveRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file: the plan as plain data, and the outcome."""

    plan: dict[str, Any]  # the run value
    outcome: DriveOutcome


def read_record(path: Path) -> DriveRecord | None:
    """Returns the record in a file; None where the file is absent or is not such a record."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=DriveRecord)
    except (*UNUSABLE, OSError):
        return None


def read_records(folders: Iterable[Path]) -> list[DriveRecord]:
    """Returns the records of all finished segments below the folders, in order of their paths."""
    found = (read_record(p) for folder in folders for p in sorted(folder.rglob("*.json")))
    return [record for record in found if record is not None]


def read_outcomes(folders: Iterable[Path]) -> list[DriveOutcome]:
    """Returns the outcomes of all finished segments below the folders, in order of their paths."""
    return [record.outcome for record in read_records(folders)]
