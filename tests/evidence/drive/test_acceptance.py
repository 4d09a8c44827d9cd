"""The verdicts of the printed checks follow the data: turned round, they turn."""

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.drive.acceptance import ACCEPTANCE, broken_cells
from skidpad.evidence.verdicts import judge

BY_ID = {f.id: f for f in ACCEPTANCE}


def verdict(id, table):
    return judge([BY_ID[id]], [table])[0].verdict.value


def matrix(collisions, invasions, seeds=8):
    rng = np.random.default_rng(2)
    return pl.DataFrame(
        [
            {
                "config": c,
                "weather": w,
                "seed": s,
                "outcome": "completed",
                "log_hash": f"{c}{w}{s}",
                "fatal_collisions": collisions[c],
                "lane_invasions": invasions[c] + int(rng.integers(0, 2)),
            }
            for c in collisions
            for w in ("clear-noon", "rain-noon")
            for s in range(seeds)
        ]
    )


FEW = {"0": 4, "1": 9, "2": 0, "3": 0, "4": 0}
MANY = {"0": 9, "1": 0, "2": 8, "3": 8, "4": 8}


@pytest.mark.req("A-276")
def test_one_cell_decides_the_collision_check():
    published = {"0": 5, "1": 1, "2": 1, "3": 1, "4": 0}
    assert verdict("A-276", matrix(published, FEW)) == "supported"
    assert verdict("A-276", matrix({**published, "4": 1}, FEW)) == "contradicted"
    assert verdict("A-276", matrix({**published, "0": 0}, FEW)) == "contradicted"
    assert verdict("A-276", matrix({"1": 3}, FEW)) == "not testable"


@pytest.mark.req("A-276")
def test_a_claim_that_one_case_decides_counts_cases_in_words():
    once = {"0": 5, "1": 1, "2": 1, "3": 1, "4": 1}
    (judged,) = judge([BY_ID["A-276"]], [matrix(once, FEW)])
    assert "cells that break it over all seeds: 2 of 4; one is enough" in judged.text
    assert "0.5" not in judged.text
    assert "p " not in judged.text, "nothing is tested"
    assert judged.is_counted
    (shown,) = judge([BY_ID["A-277"]], [matrix(dict.fromkeys("01234", 1), FEW)])
    assert not shown.is_counted


@pytest.mark.req("A-276")
def test_a_cell_that_drove_as_an_earlier_one_counts_once():
    once = matrix({"0": 5, "4": 1}, FEW)
    night = once.filter(pl.col("weather") == "clear-noon").with_columns(
        weather=pl.lit("clear-night")
    )
    one = night.filter(pl.col("seed") == 0)  # driven once, as it moves alike
    for more in (night, one):
        assert broken_cells(once) == broken_cells(pl.concat([once, more])) == (2, 4)
        assert broken_cells(pl.concat([more, once])) == (2, 4)
    other = night.with_columns(log_hash=pl.lit("n") + pl.col("log_hash"))
    assert broken_cells(pl.concat([once, other])) == (3, 6)


@pytest.mark.req("A-277")
def test_the_lane_check_follows_the_counts():
    collisions = dict.fromkeys("01234", 1)
    assert verdict("A-277", matrix(collisions, FEW)) == "supported"
    assert verdict("A-277", matrix(collisions, MANY)) == "contradicted"


@pytest.mark.req("A-278")
def test_the_radar_check_follows_the_rates():
    def study(sign):
        return pl.DataFrame(
            [
                {
                    "variant": v,
                    "config": "2",
                    "weather": "clear-noon",
                    "seed": s,
                    "outcome": "completed",
                    "log_hash": f"{v}{s}",
                    "radar_fpr_pct": 50.0 + 10.0 * sign * (v == "final") + 0.1 * s,
                    "radar_fnr_pct": 5.0 - 3.0 * sign * (v == "final") + 0.1 * s,
                }
                for v in ("preliminary", "final")
                for s in range(8)
            ]
        )

    assert verdict("A-278", study(1.0)) == "supported"
    assert verdict("A-278", study(-1.0)) == "contradicted"
