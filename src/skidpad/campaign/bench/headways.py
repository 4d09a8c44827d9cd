"""Headways of the field beside those of background traffic.

The field's are inputs (`headways.csv`): one source per road type is there to be fitted, another one to
judge by. Mean and deviation of a source are taken for those of a log-normal distribution (ours).
"Statistical Models for Preferred Time Headway and Time Headway of Drivers in Steady State
Car-Following" (9th Int. Conf. on Applications of Advanced Technology in Transportation, ASCE 2006)
found a shifted one to fit best. Only abstracts could be read.
"""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from math import log, sqrt
from typing import Any

import numpy as np

from skidpad.core.maths.space import STANDARD, Normal

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
QUANTILE_TOLERANCE = 0.15  # of the field's quantile (issue: at most 15 %)
SHARE_TOLERANCE = 0.05  # of all headways


@dataclass(frozen=True, slots=True)
class Source:
    """What one source says of headways on one type of road."""

    road: str  # motorway, town
    role: str  # fit, judge, beside
    headway: str  # gap: from bumper to bumper; front to front; not said
    kind: str  # of drivers
    mean: float | None  # s
    deviation: float | None  # s
    below_1_s: float | None  # share
    below_2_s: float | None
    name: str
    read: str  # what of it could be read

    def distribution(self) -> Normal:
        """Returns the log-normal of the source's mean and deviation, else through its two shares.

        Raises ValueError when it has neither.
        """
        if self.mean is not None and self.deviation is not None:
            variance = log(1.0 + (self.deviation / self.mean) ** 2)
            return Normal(log(self.mean) - 0.5 * variance, sqrt(variance), is_log=True)
        if self.below_1_s is None or self.below_2_s is None:
            raise ValueError(f"{self.name}: neither mean and deviation nor two shares are known")
        z_1, z_2 = (STANDARD.inv_cdf(share) for share in (self.below_1_s, self.below_2_s))
        sigma = log(2.0) / (z_2 - z_1)
        return Normal(-z_1 * sigma, sigma, is_log=True)


def field_sources() -> list[Source]:
    """Returns every source of headways.csv, in its order."""
    text = resources.files(__package__).joinpath("headways.csv").read_text(encoding="utf-8")
    return [_source(row) for row in csv.DictReader(text.splitlines())]


def _source(row: dict[str, str]) -> Source:
    """Returns the headways of a row of the CSV file; empty cells become None."""
    return Source(
        row["road"],
        row["role"],
        row["headway"],
        row["kind"],
        _number(row["mean_s"]),
        _number(row["deviation_s"]),
        _number(row["below_1_s"]),
        _number(row["below_2_s"]),
        row["source"],
        row["read"],
    )


def _number(cell: str) -> float | None:
    """Returns a cell's number; None where it is empty."""
    return float(cell) if cell else None


def headways_of(seconds: Sequence[float]) -> dict[str, Any]:
    """Returns number, QUANTILES in s and shares below 1 and 2 s of headways; without any the number alone."""
    if not seconds:
        return {"samples": 0}
    found = np.array(seconds)
    return {
        "samples": len(found),
        "quantiles_s": [round(float(q), 3) for q in np.quantile(found, QUANTILES)],
        "share_below_1_s": round(float(np.mean(found < 1.0)), 4),
        "share_below_2_s": round(float(np.mean(found < 2.0)), 4),
    }


def judge(seconds: Sequence[float], source: Source) -> dict[str, Any]:
    """Returns headways beside a source's: relative differences of quantiles, and whether they hold.

    They hold within QUANTILE_TOLERANCE and SHARE_TOLERANCE; None without headways.
    """
    ours, field = headways_of(seconds), source.distribution()
    result: dict[str, Any] = {
        "source": source.name,
        "role": source.role,
        "field_s": [round(field.value(q), 3) for q in QUANTILES],
        "field_below_1_s": round(field.share_below(1.0), 4),
    }
    if not ours["samples"]:
        return {**result, "holds": None}
    pairs = zip(ours["quantiles_s"], result["field_s"], strict=True)
    result["differences"] = [round(mine / theirs - 1.0, 3) for mine, theirs in pairs]
    result["difference_below_1_s"] = round(ours["share_below_1_s"] - result["field_below_1_s"], 4)
    near = all(abs(d) <= QUANTILE_TOLERANCE for d in result["differences"])
    result["holds"] = near and abs(result["difference_below_1_s"]) <= SHARE_TOLERANCE
    return result
