from __future__ import annotations

from pathlib import Path

import polars as pl
import pytest

import skidpad
from skidpad.recording.campaign.matrix import Metrics, RunKey
from skidpad.recording.campaign.results import schema
from skidpad.report.published import Source, published_matrix, read_published

PACKAGE = Path(skidpad.__file__).parent


def test_published_numbers_lie_in_one_place() -> None:
    names = {f"{s.value}.csv" for s in Source}
    found = {p.relative_to(PACKAGE) for p in PACKAGE.rglob("*.csv") if p.name in names}
    assert found == {Path("report", "published", name) for name in names}
    assert {p.name for p in (PACKAGE / "report" / "published").glob("*.csv")} == names


@pytest.mark.parametrize("source", Source)
def test_every_table_opens(source: Source) -> None:
    assert len(read_published(source)) > 2


@pytest.mark.req("A-258")
def test_the_matrix_speaks_the_language_of_results() -> None:
    table = published_matrix()
    assert len(table) == 30
    assert set(table.columns) <= set(schema(RunKey, Metrics))
    totals = table.group_by("config").agg(
        pl.col("fatal_collisions", "lane_invasions").sum(), pl.col("mean_speed_kmh").count()
    )
    assert totals.sort("config")["fatal_collisions"].to_list() == [28, 3, 6, 10, 0]
    assert totals.sort("config")["lane_invasions"].to_list() == [5, 15, 2, 1, 1]
    assert totals.sort("config")["mean_speed_kmh"].to_list() == [2, 6, 6, 0, 0]
