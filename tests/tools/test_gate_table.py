"""The gate on driven seeds: the tables of docs/statistics.md, from the rows of the pool."""

import re
from functools import cache

import numpy as np
import polars as pl
import pytest

import gate_table as gate

PAGE = gate.ROOT / "docs" / "statistics.md"
LEAST_SEEDS = 200  # per weather


@cache
def pool():
    return pl.read_parquet(gate.POOL / "results.parquet")


def shown():
    """Cells of the pool's two tables on the page, by row and seeds."""
    text = PAGE.read_text(encoding="utf-8")
    block = re.search(
        r"<!-- gate pool: begin -->(.*)<!-- gate pool: end -->", text, re.DOTALL
    ).group(1)
    tables = []
    for part in re.findall(r"(?:^\|.*\n)+", block, re.MULTILINE):
        rows = [[c.strip() for c in line.strip()[1:-1].split("|")] for line in part.splitlines()]
        tables.append({row[0]: dict(zip(gate.SEEDS, row[1:], strict=True)) for row in rows[2:]})
    return tables


def test_the_pool_has_200_seeds_in_each_of_six_weathers():
    seeds = pool().group_by("weather").agg(pl.col("seed").n_unique())
    assert len(seeds) == 6
    assert seeds["seed"].min() >= LEAST_SEEDS
    assert pool()["outcome"].unique().to_list() == ["completed"]


@pytest.mark.req("T-6")
def test_no_more_null_comparisons_are_red_than_the_band_allows():
    alarms, _ = shown()
    band = 100.0 * (0.05 + 2.0 * (0.05 * 0.95 / gate.TRIALS) ** 0.5)
    cells = [float(cell) for row in alarms.values() for cell in row.values()]
    assert len(cells) == 7 * 4, "six weathers, and all of them together"
    assert max(cells) <= band


@pytest.mark.req("T-6")
@pytest.mark.parametrize(
    ("name", "n"), [("all 6 weathers", 100), ("rain-noon", 50), ("icy_30", 10)]
)
def test_the_alarms_on_the_page_are_those_of_the_rows(name, n):
    rows = pool() if name.startswith("all") else pool().filter(pl.col("weather") == name)
    alarms, _ = shown()
    share = gate.pool_alarms(gate.seed_values(rows), n, gate.TRIALS)
    assert alarms[name][n] == f"{100.0 * share:.1f}"


@pytest.mark.req("T-6")
def test_the_power_on_the_page_is_that_of_the_rows():
    _, power = shown()
    values = gate.seed_values(pool())
    for row, (column, name) in zip(power.values(), gate.DOUBLED.items(), strict=True):
        assert any(key.startswith(name) for key in power)
        assert row[50] == f"{100.0 * gate.pool_power(values, column, 50, gate.TRIALS):.1f}"
        assert row[100] == "", "three groups of 100 do not fit into the pool"


def test_groups_share_no_seed():
    values = np.arange(40.0)[None, :] * np.ones((2, 1))
    groups = gate.picked(values, 10, 3, trials=7)
    assert groups.shape == (3, 7, 2, 10)
    for trial in range(7):
        assert len(np.unique(groups[:, trial, 0])) == 30
    assert np.array_equal(groups[:, :, 0], groups[:, :, 1])


def test_a_seed_that_was_not_driven_in_every_weather_is_left_out():
    row = dict.fromkeys(gate.JUDGED, 1.0)
    rows = [row | {"weather": w, "seed": s} for w in ("a", "b") for s in (1, 2)]
    rows.append(row | {"weather": "a", "seed": 3})
    assert gate.seed_values(pl.DataFrame(rows)).shape == (len(gate.JUDGED), 2)
