"""Four cells part the visual from the physical effect of rain."""

import polars as pl
import pytest

from skidpad.evidence.grip.rain import CELLS, four_cells

VISUAL, PHYSICAL, TOGETHER = -2.0, -5.0, 1.5


def world(seeds=range(8)) -> pl.DataFrame:
    """A least distance made of known parts and of a level of each seed's own."""
    rows = []
    for seed in seeds:
        for drops, friction in CELLS.values():
            reduced = friction == "reduced"
            distance = 20.0 + 3.0 * seed + VISUAL * drops + PHYSICAL * reduced
            rows.append(
                {
                    "scenario": "lead_slowdown", "cutin": "fixed", "weather": "rain_100",
                    "seed": seed, "overlay": drops, "friction": friction, "outcome": "completed",
                    "min_cvip_m": distance + TOGETHER * (drops and reduced),
                }
            )  # fmt: skip
    return pl.DataFrame(rows)


@pytest.mark.req("B-160", "B-161")
def test_each_effect_is_found_and_the_seed_drops_out():
    (found,) = four_cells(world(), "min_cvip_m")
    effects = (found.visual, found.physical, found.interaction)
    assert [e.mean for e in effects] == pytest.approx([VISUAL, PHYSICAL, TOGETHER])
    assert all(e.spread < 1e-9 for e in effects)
    assert all(e.interval is None for e in effects), "all pairs are alike"
    assert found.n == 8


@pytest.mark.req("B-161")
def test_a_seed_without_all_four_runs_is_left_out():
    runs = world()
    crashed = (pl.col("seed") == 3) & pl.col("overlay") & (pl.col("friction") == "reduced")
    runs = runs.with_columns(
        outcome=pl.when(crashed).then(pl.lit("timeout")).otherwise(pl.col("outcome"))
    )
    (found,) = four_cells(runs, "min_cvip_m")
    assert found.n == 7
