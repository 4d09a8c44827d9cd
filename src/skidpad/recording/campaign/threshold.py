"""Rows of the threshold map: one per run of a lead that brakes, by driver, start and friction."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.recording.campaign.grip import GripMetrics
from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns


@dataclass(frozen=True, slots=True, kw_only=True)
class ThresholdKey:
    """Which run a row is about, and how it ended."""

    driver: str  # driver of the ego
    actors: str  # how the others are moved
    start: str  # headway or distance behind the lead, in words
    speed_kmh: float  # km/h, of both, before a seed varies it
    gap_m: float  # m, bumper to bumper, before a seed varies it
    deceleration: float  # m/s^2, demanded of the lead, before a seed varies it
    road_mu: float  # friction of every tyre
    preset: str  # weather of the study whose statistical ratio leaves it; empty: none
    seed: int  # seed of the run
    outcome: str  # how the run ended
    version: str = ""  # of Skidpad
    log_hash: str | None = None  # content hash of the tick log; equal hashes are equal drives


THRESHOLD = Columns(
    ThresholdKey, GripMetrics, ("driver", "actors", "start", "deceleration", "road_mu", "seed")
)
ThresholdEntry = Entry[ThresholdKey, GripMetrics]
