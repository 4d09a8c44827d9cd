"""What stands beside the recording of a driven segment: what was asked for, what became of it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import msgspec

ARBITER = "arbiter"  # who drives, when it is not one of the channels


class DriveOutcome(msgspec.Struct, frozen=True, kw_only=True):
    """One row per segment; counts unless said otherwise."""

    route: str
    seed: int
    drive_by: str
    driven_s: float
    distance_m: float
    collisions: int
    collisions_struck: int  # of these: the ego hit, seen by who closed in with its front
    red_lights_run: int
    stalls: int
    ended: str  # "time", "stalled" or "off the route"
    switches: int
    minimal_risk_s: float
    driving_s: dict[str, float]
    content_hash: str = ""
    cpu_s: float = 0.0  # outside every hash


class DriveRecord(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file: the plan as plain data, and the outcome."""

    plan: dict[str, object]
    outcome: DriveOutcome


def read_record(path: Path) -> DriveRecord | None:
    """A record; None when there is none, or something else."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=DriveRecord)
    except (msgspec.DecodeError, OSError):
        return None


def read_outcomes(folders: Iterable[Path]) -> list[DriveOutcome]:
    """All finished segments below the folders, in order of their paths."""
    found = (read_record(p) for folder in folders for p in sorted(folder.rglob("*.json")))
    return [record.outcome for record in found if record is not None]
