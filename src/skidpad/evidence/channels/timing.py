"""What the parts of a cycle take, and against which budget (C-232 to C-238)."""

from __future__ import annotations

from enum import Enum
from typing import Any, Protocol

import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.core.channels import Cycle

BUDGET_MS = 25.0  # C-006, C-233
MODULES = ("comfort", "similarity", "motion_prediction", "risk", "hazards")
TIMES: dict[str, Any] = {
    "cycle": pl.Int64,  # number of the cycle
    "objects": pl.Int64,  # number of objects of all channels
    "prepare": pl.Float64,  # ms, to bring the channels' frames into one form
    "comfort": pl.Float64,  # ms, indicators of comfort
    "similarity": pl.Float64,  # ms, indicators that compare channels
    "motion_prediction": pl.Float64,  # ms, prediction of all objects
    "risk": pl.Float64,  # ms, indicators of risk
    "hazards": pl.Float64,  # ms, rules of hazards
    "writing": pl.Float64,  # ms, of the hazard records
    "total": pl.Float64,  # ms, all parts but the writing
}
LIVE_TIMES: dict[str, Any] = TIMES | {
    "wall_ms": pl.Float64,  # ms, from the sending of the cycle to its verdict
    "waited_ms": pl.Float64,  # ms, that the thread was ready and had no processor
    "faults": pl.Float64,  # page faults in the cycle
}


class Stopwatch(Protocol):
    """Measures a monitor at work; the caller brings its own clock."""

    def begin(self, cycle: Cycle) -> None:
        """Starts the measurements of a cycle."""

    def lap(self, name: str) -> None:
        """Notes that the part `name` of the cycle is done."""

    def table(self) -> pl.DataFrame:
        """Returns a row of TIMES per cycle."""


def timing_statistics(timing: pl.DataFrame) -> pl.DataFrame:
    """Returns the table of C-233: per module mean, extremes, deviation and shares against its threshold.

    Threshold of the total: 25 ms; of a module: its own maximum. "Within 90 %" is 0.9 T <= t <= T
    (C-234, DC-64).
    """
    rows = []
    for module in ("total", "prepare", *MODULES, "writing"):
        t = timing[module].to_numpy()
        p999 = float(np.percentile(t, 99.9))
        rows.append({"module": module, **time_figures(t, module), "p999_ms": p999})
    return pl.DataFrame(rows)


def time_figures(t: NDArray[np.float64], module: str) -> dict[str, float]:
    """Returns mean, extremes and deviation of times (k,) in ms, and shares against the module's threshold.

    The threshold is BUDGET_MS for `total`, else the largest of the times.
    """
    return {
        "mean_ms": float(t.mean()),
        "max_ms": float(t.max()),
        "min_ms": float(t.min()),
        "std_ms": float(t.std()),
        **time_shares(t, BUDGET_MS if module == "total" else float(t.max())),
    }


def time_shares(t: NDArray[np.float64], limit: float) -> dict[str, float]:
    """Returns the percent of times (k,) in ms above the limit, within 90 % of it and under half of it."""
    return {
        "breaches_pct": float(100.0 * (t > limit).mean()),
        "within_90_pct": float(100.0 * ((t >= 0.9 * limit) & (t <= limit)).mean()),
        "under_50_pct": float(100.0 * (t < 0.5 * limit).mean()),
    }


def time_by_objects(timing: pl.DataFrame) -> pl.DataFrame:
    """Returns mean times in ms per module by the number of objects of all channels, rising (C-238)."""
    return (
        timing.group_by("objects", maintain_order=True)
        .agg(pl.len().alias("cycles"), pl.col("total", *MODULES).mean())
        .sort("objects")
    )


class LateCause(str, Enum):
    """Why a cycle was judged later than the budget allows."""

    OWN = "own work"
    WAITED = "no processor was free"
    BEHIND = "behind an earlier late cycle"
    FAULTS = "page faults"
    UNKNOWN = "unknown"


FAULTS_MANY = 64  # in a cycle; a warm one has next to none


def late_cycles(timing: pl.DataFrame) -> pl.DataFrame:
    """Returns the cycles of a live drive judged over BUDGET_MS after their last message, with causes.

    timing: LIVE_TIMES; waited_ms: in the queue for a processor.
    """
    late = pl.col("wall_ms") > BUDGET_MS
    excess = pl.col("wall_ms") - BUDGET_MS
    cause = (
        pl.when(pl.col("total") + pl.col("writing") > BUDGET_MS)
        .then(pl.lit(LateCause.OWN.value))
        .when(pl.col("waited_ms") >= excess)
        .then(pl.lit(LateCause.WAITED.value))
        .when(late.shift(1, fill_value=False))
        .then(pl.lit(LateCause.BEHIND.value))
        .when(pl.col("faults") >= FAULTS_MANY)
        .then(pl.lit(LateCause.FAULTS.value))
        .otherwise(pl.lit(LateCause.UNKNOWN.value))
    )
    columns = ("cycle", "wall_ms", "total", "waited_ms", "faults", "cause")
    return timing.with_columns(cause=cause).filter(late).select(columns)


def delay_sentence(timing: pl.DataFrame) -> str:
    """Returns in words how long after its last message a cycle was judged, and why some came late."""
    wall = timing["wall_ms"].to_numpy()
    causes = late_cycles(timing)["cause"].value_counts(sort=True).rows()
    late = ", ".join(f"{n} {cause}" for cause, n in sorted(causes, key=lambda c: (-c[1], c[0])))
    return (
        f"judged {np.median(wall):.2f} ms after the last word (99.9 %: "
        f"{np.percentile(wall, 99.9):.1f}, most: {wall.max():.1f}), own work "
        f"{np.median(timing['total'].to_numpy()):.2f} ms; later than {BUDGET_MS:g} ms: {late or 'none'}"
    )
