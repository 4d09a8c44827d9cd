"""How a hazard went: signals of the rules over its record, as one series of fixed length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.recording.hazards.records import HazardRecord

Floats = NDArray[np.float64]
POINTS = 20  # of a series; records have 11 s, so one point stands for about half a second
VERSION = 1  # of what a series means; another one is computed anew
# signal, what it is divided by, and what stands where there is no conflict or no value
SIGNALS: tuple[tuple[Signal, float, float], ...] = (
    (Signal.TTC_AHEAD, 10.0, 1.0),
    (Signal.TTC_BEHIND, 10.0, 1.0),
    (Signal.SAFETY_SCORE, 1.0, 1.0),
    (Signal.GAP, 1.0, 0.0),
    (Signal.EGO_LOCATION, 1.0, 1.0),
    (Signal.CROSS_PATH, 1.0, 1.0),
)


def series_of(record: HazardRecord) -> Floats:
    """The signals of a record's worlds, (POINTS, len(SIGNALS)) within [0, 1]."""
    monitor = Monitor(record.channels, MonitorSettings(keep_worlds=False))
    rows = [monitor.update(cycle).signals.values for cycle in record.worlds]
    if not rows:
        return np.tile([neutral for _, _, neutral in SIGNALS], (POINTS, 1))
    table = np.array([[_scale_value(row[s], by, rest) for s, by, rest in SIGNALS] for row in rows])
    return _resample_table(table)


def _scale_value(value: float, by: float, neutral: float) -> float:
    return neutral if np.isnan(value) else float(np.clip(value / by, 0.0, 1.0))


def _resample_table(table: Floats) -> Floats:
    """Means of POINTS equal stretches of a table (n, k); a short one repeats its rows."""
    edges = np.linspace(0.0, len(table), POINTS + 1)
    first = np.floor(edges[:-1]).astype(int)
    last = np.maximum(np.ceil(edges[1:]).astype(int), first + 1)
    return np.array([table[a:b].mean(axis=0) for a, b in zip(first, last, strict=True)])


def to_plain(series: Floats) -> list[list[float]]:
    """For JSON, in the resolution that it is compared in."""
    return [[round(v, 4) for v in row] for row in series.tolist()]


def from_plain(plain: Sequence[Sequence[float]]) -> Floats:
    """Returns the array of `to_plain`'s values."""
    return np.array(plain, dtype=np.float64).reshape(POINTS, len(SIGNALS))
