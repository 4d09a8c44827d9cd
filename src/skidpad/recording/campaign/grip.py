"""Rows of the friction campaign: one per run, like those of the matrix (B-125, B-126)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.core.errors import FileError
from skidpad.core.files.names import inside
from skidpad.recording.campaign.ledger import Entry
from skidpad.recording.campaign.results import Columns, metric
from skidpad.recording.files import read_parquet, require_columns, write_parquet

SERIES, STOPPING = "series", "stopping.parquet"
STOPPING_COLUMNS = {
    "weather": "name of the weather",
    "model": "model of grip",
    "ratio": "friction at standstill over the dry friction of the same tyres",
    "mu_80": "friction at 80 km/h",
    "stop_50_m": "m, of a full stop from 50 km/h",
    "stop_80_m": "m, of a full stop from 80 km/h",
    "stop_100_m": "m, of a full stop from 100 km/h",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class GripKey:
    """Which run a row is about, and how it ended."""

    scenario: str  # name of the scenario
    weather: str  # name of the weather
    friction: str  # original or reduced
    seed: int  # seed of the run
    cutin: str  # variant of the cut-in
    controller: str  # driver of the ego
    sensors: str  # objects or pixels
    model: str  # model of grip of the reduced friction
    overlay: bool  # rain drops on the cameras
    outcome: str  # how the run ended
    version: str = ""  # of Skidpad
    log_hash: str | None = None  # content hash of the tick log; equal hashes are equal drives


@dataclass(frozen=True, slots=True, kw_only=True)
class GripMetrics:
    """What the log of one run says; None where there is nothing to say (decision X-3)."""

    triggered: bool | None = metric("every event of the scenario began", "G-2")
    completion: bool | None = metric(
        "no accident: no contact, and never off the road", "B-104, B-106"
    )
    score: float | None = metric("route completion times penalties, 0 to 100", "B-105")
    route_completion: float | None = metric("share of the route driven, percent", "BD-07")
    off_lanes_pct: float | None = metric("share of the way off all lanes", "B-106")
    min_cvip_m: float | None = metric("least distance of box centres, ego to nearest NPC", "B-149")
    loss_of_control_ego: bool | None = metric("ego slid or spun before any contact", "B-145")
    loss_of_control_npc: bool | None = metric("an NPC slid or spun before any contact", "B-145")
    npc_contact: bool | None = metric("two NPCs touched", "B-092")
    max_slip_ego_deg: float | None = metric("largest side slip of the ego above 3 m/s", "B-145")
    max_slip_npc_deg: float | None = metric("largest side slip of an NPC above 3 m/s", "B-145")
    max_yaw_rate_npc_deg_s: float | None = metric("largest yaw rate of an NPC", "B-145")
    steer_std: float | None = metric("deviation of the steering command", "B-144")
    steer_corrections: float | None = metric("reversals of steering per second", "B-144")
    ratio: float | None = metric("friction ratio at standstill", "B-068")
    mu: float | None = metric("friction at the ego's tyres, mean", "B-068")
    impact_kmh: float | None = metric("closing speed of the ego's first contact", "B-149")
    duration_s: float | None = metric("simulated time", "B-094")
    distance_m: float | None = metric("way of the ego", "B-105")


GRIP = Columns(
    GripKey, GripMetrics, ("scenario", "cutin", "overlay", "weather", "friction", "seed")
)
GripEntry = Entry[GripKey, GripMetrics]
COLUMNS = {
    "x": "m, across the road, left positive, of the ego",
    "y": "m, along the road, of the ego",
    "v": "m/s, of the ego",
    "cvip": "m, between box centres, ego to nearest NPC",
    "steer": "-1 to 1",
    "brake": "1 while the pedal is pressed, else 0",
    "throttle": "0 to 1",
    "npc_x": "m, as x, of the first NPC",
    "npc_y": "m, as y, of the first NPC",
}


def series_path(folder: Path, cell: str, seed: int) -> Path:
    """Returns the file of the recorded series of a run."""
    return inside(folder / SERIES, cell) / f"{seed:06d}.parquet"


def write_series(path: Path, series: NDArray[np.float32]) -> None:
    """Writes the series (T, 9) of one run, atomically; columns as in COLUMNS."""
    write_parquet(path, pl.DataFrame(series, schema=dict.fromkeys(COLUMNS, pl.Float32)))


def read_series(folder: Path, run: str) -> pl.DataFrame:
    """Returns the series of the run of this name; FileError for a name without a seed, or no such file."""
    cell, _, seed = run.rpartition("-")
    if not (seed.isascii() and seed.isdigit()):
        raise FileError(f"the ledger of {folder} names a run {run!r:.200}, which has no seed")
    path = series_path(folder, cell, int(seed))
    return require_columns(read_parquet(path)[0], dict.fromkeys(COLUMNS, pl.Float32), path)


def read_stopping(folder: Path) -> pl.DataFrame:
    """Returns ratio, friction and stopping distances of each weather and model; empty if not computed."""
    path = folder / STOPPING
    return read_parquet(path)[0] if path.is_file() else pl.DataFrame()
