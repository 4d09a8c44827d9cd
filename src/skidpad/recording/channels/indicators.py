"""Indicator values of a drive as Parquet: one row per cycle, subject and indicator (C-17)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl

from skidpad.core.arrays import Floats
from skidpad.recording.files import read_parquet, require_columns, write_parquet

FILE = "indicators.parquet"
TYPES = {
    "cycle": pl.Int64,  # number of the cycle
    "t": pl.Float64,  # s, time of the cycle
    "subject": pl.String,  # name of the channel, or of a pair as a+b
    "indicator": pl.String,  # name of the indicator
    "value": pl.Float64,  # in the units of the indicator; null: not evaluated
    "evaluated": pl.Boolean,  # whether there is a value
    "threshold": pl.Float64,  # bound of the value; null: none
    "violated": pl.Boolean,  # the value is beyond its bound
    "claim": pl.String,  # id of the claim in monitor.json that the bound belongs to; null: none
}


@dataclass(frozen=True, slots=True)
class Column:
    """One indicator of one channel or pair, with its bound and claim."""

    indicator: str
    subject: str  # channel, or pair "a+b"
    threshold: float | None
    upper: bool  # the threshold is an upper bound
    claim: str | None


class IndicatorLog:
    """Gathers one row of values per cycle; NaN is written as null, not evaluated."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self.columns = tuple(columns)
        self._k: list[int] = []
        self._t: list[float] = []
        self._rows: list[Floats] = []

    def add(self, k: int, t: float, values: Floats) -> None:
        """Adds the values (len(columns),) of cycle k at `t` s."""
        self._k.append(k)
        self._t.append(t)
        self._rows.append(values)

    def table(self) -> pl.DataFrame:
        """Returns the rows in long form, by cycle and then in the order of the columns."""
        n, m = len(self._k), len(self.columns)
        values = np.array(self._rows, dtype=np.float64).reshape(n, m)
        low = np.array([_threshold_in(c, upper=False) for c in self.columns])
        high = np.array([_threshold_in(c, upper=True) for c in self.columns])
        violated = (values < low) | (values > high)
        return pl.DataFrame(
            {
                "cycle": np.repeat(np.array(self._k, dtype=np.int64), m),
                "t": np.repeat(np.array(self._t, dtype=np.float64), m),
                "subject": _repeat_values([c.subject for c in self.columns], n),
                "indicator": _repeat_values([c.indicator for c in self.columns], n),
                "value": pl.Series(values.ravel(), nan_to_null=True),
                "evaluated": np.isfinite(values).ravel(),
                "threshold": _repeat_values([c.threshold for c in self.columns], n, pl.Float64()),
                "violated": violated.ravel(),
                "claim": _repeat_values([c.claim for c in self.columns], n),
            }
        )

    def write(self, folder: Path) -> None:
        """Writes the table into `folder`."""
        write_parquet(folder / FILE, self.table())


def read_indicators(folder: Path) -> pl.DataFrame:
    """Returns the table in a monitor's output folder."""
    return require_columns(read_parquet(folder / FILE)[0], TYPES, folder / FILE)


def _threshold_in(column: Column, upper: bool) -> float:
    """Returns the column's threshold on that side, an infinite one where it has none."""
    if column.threshold is None or column.upper is not upper:
        return np.inf if upper else -np.inf
    return column.threshold


def _repeat_values(
    values: Sequence[str | float | None], n: int, dtype: pl.DataType | None = None
) -> pl.Series:
    """Returns the values in their order, repeated n times."""
    base = pl.Series(list(values), dtype=dtype or pl.String())
    return base.gather(np.tile(np.arange(len(values), dtype=np.uint32), n))
