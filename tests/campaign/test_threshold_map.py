"""The threshold map from its command to its page, and wrong input to it."""

from __future__ import annotations

import re

import polars as pl
import pytest
from msgspec.structs import replace
from typer.testing import CliRunner

from skidpad.campaign.cells.grip import template
from skidpad.campaign.cells.threshold import PRESETS, default_shares, preset_of
from skidpad.campaign.recipes.threshold import SITUATION
from skidpad.cli.campaigns.threshold_plan import plan_map
from skidpad.cli.main import app
from skidpad.cli.options.asked import EgoStack, GripCross, MapAsked
from skidpad.core.errors import InputError
from skidpad.recording.campaign.results import read_results

SMALL = (
    "--map-of", "threshold", "--drivers", "acc", "--headways", "0.6,25m", "--decelerations", "8",
    "--levels", "1,0.11", "--repeats", "2", "--workers", "1",
)  # fmt: skip


def plan(ego=None, cross=None, repeats=20, **asked):
    ask = MapAsked(map_of=asked.pop("map_of", "threshold"), **asked)
    return plan_map(ask, cross or GripCross(), ego or EgoStack(), template(), repeats)


def test_every_combination_is_a_run_of_its_own():
    found = plan()
    # drivers x actors x starts x decelerations x levels x seeds
    assert len(found) == 2 * 2 * 6 * 4 * len(default_shares()) * 20
    assert len({task.name for task in found}) == len(found)


def test_seeds_are_common_to_all_levels_so_that_runs_are_paired():
    found = plan(repeats=2, drivers="acc", headways="1", decelerations="4")
    by_seed = {}
    for task in found:
        by_seed.setdefault(task.run.seed, set()).add(str(task.run.course.parameters))
    assert [len(drawn) for drawn in by_seed.values()] == [1, 1]


def test_the_first_seed_is_the_one_asked_for():
    asked = MapAsked(map_of="threshold", drivers="acc", headways="1", decelerations="4")
    found = plan_map(asked, GripCross(), EgoStack(), replace(template(), seed=5501), 3)
    assert {task.run.seed for task in found} == {5501, 5502, 5503}


def test_levels_hold_what_the_weathers_of_the_study_leave():
    shares = default_shares()
    assert shares[0] == 1.0
    assert {preset_of(s) for s in shares} >= set(PRESETS)
    assert preset_of(0.5) == ""


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"map_of": "speed"}, "choose one of: threshold"),
        ({"drivers": "acc,tesla"}, "unknown --drivers 'tesla'"),
        ({"headways": "0.1"}, "--headways must be between 0.3 and 5, got 0.1"),
        ({"headways": "near"}, "--headways takes numbers between 0.3 and 5 or 25m, got 'near'"),
        ({"decelerations": "20"}, "--decelerations must be between 0.5 and 10"),
        ({"levels": "0.5,0.2"}, "--levels needs dry road, 1"),
        ({"levels": "1,nan"}, "--levels takes numbers between 0.06 and 1, got 'nan'"),
        ({"cross": GripCross(weather="icy_30")}, "leave away --scenarios, --weather"),
        ({"ego": EgoStack(stack="ideal")}, "--stack"),
    ],
)
def test_wrong_input_is_one_sentence(wish, message):
    with pytest.raises(InputError, match=re.escape(message)):
        plan(**wish)


@pytest.mark.req("B-001", "B-102", "B-143")
def test_friction_alone_decides_and_the_page_says_so(tmp_path):
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["grip", "--out", str(out), *SMALL], catch_exceptions=False)
    assert done.exit_code == 0
    table = read_results(out)
    assert len(table) == 2 * 2 * 2 * 2
    ideal = table.filter((pl.col("actors") == "ideal") & (pl.col("speed_kmh") > 50.0))
    dry, ice = (
        ideal.filter((pl.col("road_mu") > 0.5) == yes)["completion"] for yes in (True, False)
    )
    assert dry.all()
    assert not ice.any()  # a lead that brakes on any road, behind it tyres that cannot
    page = (out / "report.html").read_text(encoding="utf-8")
    for part in ("Threshold of grip", "The map", "Completion over friction", "BF-02", "25 m at 36"):
        assert part in page, part
    kept = [p.name for p in (out / "runs").iterdir() if (p / "ticks.parquet").exists()]
    crashed = table.filter(~pl.col("completion"))
    assert len(kept) == crashed.select(SITUATION).n_unique()  # the first accident of each
    again = CliRunner().invoke(app, ["report", str(out)], catch_exceptions=False)
    assert again.exit_code == 0
    assert (out / "report.html").read_text(encoding="utf-8") == page
