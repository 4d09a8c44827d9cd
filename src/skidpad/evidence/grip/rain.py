"""What rain does to the eye and what it does to the tyres, parted by four cells (B-160, B-161).

Each seed is driven four times: drops on the cameras or not, friction reduced or not.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import polars as pl

from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.statistics import Comparison, compare_pairs

CELLS = {
    "none": (False, "original"),
    "visual": (True, "original"),
    "physical": (False, "reduced"),
    "both": (True, "reduced"),
}
BY = ("scenario", "cutin", "weather", "seed")


@dataclass(frozen=True, slots=True)
class FourCells:
    """One quantity in one scenario and weather, over seeds that finished in all four cells."""

    scenario: str
    cutin: str
    weather: str
    n: int
    means: dict[str, float]  # by cell
    visual: Comparison  # drops alone, against neither
    physical: Comparison  # friction alone, against neither
    interaction: Comparison  # what both do beyond the sum of the two


def four_cells(results: pl.DataFrame, quantity: str) -> Iterator[FourCells]:
    """Yields the cells of every scenario and weather; results: both overlays, both frictions."""
    finished = results.filter(~pl.col("outcome").is_in(NOT_RUN)).drop_nulls(quantity)
    wide: pl.DataFrame | None = None
    for name, (drops, friction) in CELLS.items():
        here = (pl.col("overlay") == drops) & (pl.col("friction") == friction)
        side = finished.filter(here).select(*BY, pl.col(quantity).cast(pl.Float64).alias(name))
        wide = side if wide is None else wide.join(side, on=BY)
    assert wide is not None
    for (scenario, cutin, weather), rows in wide.sort(BY).group_by(BY[:3], maintain_order=True):
        value = {name: rows[name].to_numpy() for name in CELLS}
        visual, physical = value["visual"] - value["none"], value["physical"] - value["none"]
        yield FourCells(
            str(scenario), str(cutin), str(weather), len(rows),
            {name: float(v.mean()) for name, v in value.items()},
            compare_pairs(visual),
            compare_pairs(physical),
            compare_pairs(value["both"] - value["none"] - visual - physical),
        )  # fmt: skip
