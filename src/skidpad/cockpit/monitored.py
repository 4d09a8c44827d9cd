"""What a monitor said of a recording, along its time: hazards, and indicators beyond their bounds."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl

from skidpad.cockpit.indicators import every
from skidpad.core.setup import DT
from skidpad.live.links import MONITORED
from skidpad.recording.channels.indicators import FILE, read_indicators
from skidpad.recording.hazards.records import INDEX_FILE, read_index


class MonitoredRun(NamedTuple):
    """Of one recording; empty where no monitor looked at it."""

    hazards: list[tuple[int, int, str]]  # first and last tick, and what it was
    violated: list[int]  # indicators beyond their bounds, the most up to the next shown moment

    @property
    def marks(self) -> list[tuple[int, str, str]]:
        """Where each hazard begins: tick, kind and text."""
        return [(first, "hazard", f"hazard: {text}") for first, _, text in self.hazards]


def read_judgements(recording: Path, ticks: Sequence[int]) -> MonitoredRun:
    """What the folder NAME.monitor beside a recording with moments at `ticks` says."""
    folder = recording.with_suffix(MONITORED)
    hazards, violated = [], np.zeros(len(ticks), dtype=np.int64)
    if (folder / INDEX_FILE).is_file():
        for row in read_index(folder):
            first, last = (round(row[name] / DT) for name in ("t_start", "t_end"))
            words = row["type"].replace("_", " ")
            hazards.append((first, last, f"{words} ({row['id']})"))
    if (folder / FILE).is_file():
        beyond = read_indicators(folder).filter(pl.col("violated")).group_by("t").len()
        at = np.searchsorted(ticks, np.round(beyond["t"].to_numpy() / DT))
        within = at < len(ticks)
        np.add.at(violated, at[within], beyond["len"].to_numpy()[within])
    starts = np.arange(len(ticks))[every(len(ticks))]
    most = np.maximum.reduceat(violated, starts).tolist() if violated.any() else []
    return MonitoredRun(sorted(hazards), most)
