"""Rows of the threshold map: one per run of a lead that brakes, by driver, start and friction."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.recording.campaign.grip import GripMetrics
from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdKey:
    """Which run a row is about, and how it ended."""

    driver: str
    actors: str  # core.run.ActorMode
    start: str  # headway or distance behind the lead, in words
    speed_kmh: float  # of both, before a seed varies it
    gap_m: float  # bumper to bumper, likewise
    deceleration: float  # m/s^2 demanded of the lead, likewise
    road_mu: float  # friction of every tyre
    preset: str  # weather of the study whose statistical ratio leaves it; empty: none
    seed: int
    outcome: str  # core.Outcome
    version: str = ""
    log_hash: str | None = None  # equal hashes are equal drives


THRESHOLD = Columns(
    ThresholdKey, GripMetrics, ("driver", "actors", "start", "deceleration", "road_mu", "seed")
)
ThresholdEntry = Entry[ThresholdKey, GripMetrics]
