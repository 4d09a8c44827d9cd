"""What one drive says for the findings: sums per segment, gathered while the monitor runs (X-7)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from enum import Enum

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.indicators.layout import Place
from skidpad.evidence.channels.judging.causes import V_STANDING, YAW_RATE_TURN
from skidpad.evidence.channels.monitor import Monitor
from skidpad.evidence.channels.recorder import CycleEvidence
from skidpad.evidence.channels.timefilter import Event
from skidpad.evidence.channels.timing import BUDGET_MS, MODULES, time_figures, time_shares

COMPARED = MODULES[:3]  # those of C-232
TIMED = ("total", *COMPARED)
MANY_OBJECTS = 5  # objects of the busiest channel (C-238)
WARM_CYCLES = 20  # whose times are left out
CYCLES_MIN = 20  # on either side of a comparison
SERIES = (
    ("object_location", Indicator.OBJECT_LOCATION),
    ("object_trajectory", Indicator.OBJECT_TRAJECTORY),
    ("cross_path", Indicator.CROSS_PATH),
)


CAUSE_PREFIX = "cause_"


class ViolationCause(str, Enum):
    """What was going on when an indicator went beyond its threshold."""

    SILENT = "a channel reported nothing"
    STANDING = "ego standing or nearly so"
    TURN = "ego turning"
    UNEQUAL = "a channel saw objects that another did not"
    MANY = "many objects, as many in every channel"
    NOISE = "none of these: the channels' errors alone"


class Observer:
    """Watches a monitor at work on one drive."""

    def __init__(self, monitor: Monitor, motion: Mapping[str, Floats]) -> None:
        n = motion["t"].size
        self.monitor, self.motion = monitor, motion
        self.series = {name: np.full(n, np.nan) for name, _ in SERIES}
        self.steady = np.full(n, np.nan)
        self.objects = np.zeros(n)
        self.silent = np.zeros(n, dtype=bool)  # a channel reported nothing
        self.unequal = np.zeros(n, dtype=bool)  # channels reported different numbers of objects

    def see(self, k: int, evidence: CycleEvidence) -> None:
        """Stores what cycle number k of the drive showed; k counts from 0."""
        for name, indicator in SERIES:
            values = evidence.readings[indicator]
            self.series[name][k] = np.fmin.reduce(values) if values.size else np.nan
        self.steady[k] = evidence.signals.values[Signal.STEADY_SHARE]
        counts = [len(f.objects) for f in evidence.cycle.frames if f is not None]
        self.objects[k] = max(counts, default=0)
        self.silent[k] = len(counts) < len(evidence.cycle.frames)
        self.unequal[k] = len(set(counts)) > 1

    def facts(self) -> dict[str, float | None]:
        """Returns the numbers of the drive, by column; None where there was too little to say.

        Ends the monitor's open violations.
        """
        v, turning = self.motion["v"], np.abs(self.motion["yaw_rate"]) > YAW_RATE_TURN
        standing = v < V_STANDING
        few = (self.objects > 0) & (self.objects < MANY_OBJECTS)
        many = self.objects >= MANY_OBJECTS
        path = self.series["cross_path"]
        out: dict[str, float | None] = {
            "object_location_few_minus_many": _apart(self.series["object_location"], few, many),
            "object_trajectory_few_minus_many": _apart(self.series["object_trajectory"], few, many),
            "cross_path_straight_minus_turn": _apart(path, ~turning & ~standing, turning),
            "cross_path_moving_minus_standing": _apart(path, ~standing & ~turning, standing),
            "steady_standing_minus_moving": _apart(self.steady, standing, ~standing),
            "objects_mean": float(self.objects.mean()) if self.objects.size else None,
        }
        events = self.monitor.violations.finish()
        return out | self._violations(events) | self._causes(events)

    def _violations(self, events: Sequence[Event[Place]]) -> dict[str, float | None]:
        """Returns the number of violation events of each indicator with a threshold, by column name."""
        counted = [e.key[0] for e in events]
        return {
            f"violations_{i.value}": float(counted.count(i))
            for i, entry in self.monitor.thresholds.items()
            if entry.threshold is not None
        }

    def _causes(self, events: Sequence[Event[Place]]) -> dict[str, float | None]:
        """Returns the number of violations by indicator and by cause when they began, by column (C-215)."""
        counted = Counter((e.key[0], self._cause(e.t_start)) for e in events)
        return {
            f"{CAUSE_PREFIX}{cause.name.lower()}_{indicator.value}": float(n)
            for (indicator, cause), n in counted.items()
        }

    def _cause(self, t: float) -> ViolationCause:
        """Returns the first cause, in the order of ViolationCause, that applies at time t s."""
        k = int(np.argmin(np.abs(self.motion["t"] - t)))
        if self.silent[k]:
            return ViolationCause.SILENT
        if self.motion["v"][k] < V_STANDING:
            return ViolationCause.STANDING
        if abs(self.motion["yaw_rate"][k]) > YAW_RATE_TURN:
            return ViolationCause.TURN
        if self.unequal[k]:
            return ViolationCause.UNEQUAL
        return ViolationCause.MANY if self.objects[k] >= MANY_OBJECTS else ViolationCause.NOISE


def times_of(times: pl.DataFrame) -> dict[str, float]:
    """Returns figures of a drive's processor times in ms by name, its first WARM_CYCLES left out.

    {} for a drive of at most twice as many cycles.
    """
    if len(times) <= 2 * WARM_CYCLES:
        return {}
    warm = times[WARM_CYCLES:]
    means = {m: float(warm[m].to_numpy().mean()) for m in COMPARED}
    out = {
        "total_p999_ms": float(np.percentile(warm["total"].to_numpy(), 99.9)),
        "motion_prediction_share": means["motion_prediction"] / max(sum(means.values()), 1e-9),
    }
    for module in TIMED:
        figures = time_figures(warm[module].to_numpy(), module)
        out |= {f"{module}_{name}": value for name, value in figures.items()}
    return out


def warm_times(times: pl.DataFrame) -> Floats:
    """Returns the times in ms (k, 4) of TIMED, without the first cycles; none of a short drive."""
    if len(times) <= 2 * WARM_CYCLES:
        return np.empty((0, len(TIMED)))
    return np.asarray(times[WARM_CYCLES:].select(TIMED).to_numpy(), dtype=np.float64)


def route_shares(times: Floats, greatest: Floats) -> dict[str, float]:
    """Returns shares of a drive's times (k, 4) against BUDGET_MS and the modules' route maxima (C-233).

    greatest: (4,) ms, the route's maxima in the order TIMED. {} without times.
    """
    if not len(times):
        return {}
    limits = [BUDGET_MS, *greatest[1:].tolist()]
    return {
        f"{module}_{name}": value
        for k, (module, limit) in enumerate(zip(TIMED, limits, strict=True))
        for name, value in time_shares(times[:, k], limit).items()
    }


def _apart(values: Floats, a: NDArray[np.bool_], b: NDArray[np.bool_]) -> float | None:
    """Returns the mean over cycles a less that over cycles b, values that are not finite left out.

    None with fewer than CYCLES_MIN values on either side.
    """
    known = np.isfinite(values)
    a, b = a & known, b & known
    if a.sum() < CYCLES_MIN or b.sum() < CYCLES_MIN:
        return None
    return float(values[a].mean() - values[b].mean())
