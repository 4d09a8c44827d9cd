"""`skidpad effects`: arms differ in their effect alone, pairs are compared, and what is not read says so."""

from pathlib import Path

import numpy as np
import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.campaign.studies.effects import (
    EFFECTS,
    NO_CHANGE,
    NONE,
    NOT_READ,
    OFF,
    compare_effects,
    plan_arm,
    settings_of_arm,
)
from skidpad.cli.campaigns.effects import difference_text
from skidpad.cli.main import app
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import SensorLevel
from skidpad.roads.bundled import load_map


def rows(stack="2", **arms):
    """Rows of some arms: interventions, speeds and hashes by seed."""
    found = [
        {"stack": stack, "weather": "rain-noon", "arm": arm, "seed": seed, "interventions": i,
         "mean_speed_kmh": v, "log_hash": h}
        for arm, drives in arms.items()
        for seed, (i, v, h) in enumerate(drives)
    ]  # fmt: skip
    return pl.DataFrame(found)


def test_an_arm_is_none_but_for_its_effect_and_all_is_every_effect():
    none = load_profile("recommended", settings_of_arm(NONE)).to_plain()
    assert {k: v for k, v in none.items() if k in OFF} == OFF
    for name, effect in EFFECTS.items():
        own = load_profile("recommended", settings_of_arm(name)).to_plain()
        assert {k for k in own if own[k] != none[k]} == set(effect.values)
    everything = settings_of_arm("all")
    assert all(everything[k] == v for effect in EFFECTS.values() for k, v in effect.values.items())
    assert plan_arm("camera", "rain-noon", NONE, 1, 5.0).sensors is SensorLevel.PIXELS
    assert plan_arm("2", "rain-noon", NONE, 1, 5.0).sensors is SensorLevel.OBJECTS


def test_puddles_lie_on_every_road_in_their_arm_and_in_all_together():
    wet, dry, both = (plan_arm("2", "rain-noon", arm, 1, 5.0) for arm in ("puddles", NONE, "all"))
    assert dry.surface == ()
    assert wet.surface == both.surface
    assert {p.side for p in wet.surface} == {"left"}
    assert {p.road for p in wet.surface} == set(load_map("figure8").lanes.road.tolist())


def test_arms_drive_on_the_map_that_is_asked_for():
    on_motorway = plan_arm("2", "rain-noon", "puddles", 1, 5.0, "motorway")
    assert on_motorway.course.map == "motorway"
    assert {p.road for p in on_motorway.surface} == set(load_map("motorway").lanes.road.tolist())
    assert plan_arm("2", "rain-noon", NONE, 1, 5.0).course.map == "figure8"


def test_differences_are_of_equal_seeds_with_intervals_from_eight():
    none = [(0, 60.0 + k, f"n{k}") for k in range(8)]
    wind = [(k % 2, 59.0 + k - 0.1 * k, f"w{k}") for k in range(8)]
    (found,) = compare_effects(rows(none=none, wind=wind))
    assert found.interventions.mean == pytest.approx(0.5)
    assert found.speed.mean == pytest.approx(np.mean([-1.0 - 0.1 * k for k in range(8)]))
    assert found.speed.interval is not None
    assert found.speed.is_clear
    assert found.changed == 8
    assert not found.note


@pytest.mark.parametrize(
    ("stack", "arm", "note"),
    [
        ("2", "lidar", NOT_READ), ("2", "radar", NO_CHANGE), ("2", "wind", NO_CHANGE),
        ("camera", "radar", NOT_READ), ("camera", "pictures", NO_CHANGE),
        ("mine:Stack", "lidar", NOT_READ), ("2", "spray", NOT_READ),
        ("camera", "ghosts", NOT_READ), ("2", "window", NOT_READ), ("camera", "rivals", NOT_READ),
        ("2", "lens", NOT_READ), ("2", "roll_over", NO_CHANGE),
    ],
)  # fmt: skip
def test_what_is_not_read_says_so_and_never_0(stack, arm, note):
    same = [(0, 60.0, "h")]
    (found,) = compare_effects(rows(stack, **{NONE: same, arm: same}))
    assert found.note == note


def test_a_sensor_through_which_another_effect_acts_is_read():
    same, moved = [(0, 60.0, "h")], [(0, 50.0, "g")]
    found = compare_effects(rows("mine:Stack", none=same, lidar=moved, window=same, radar=same))
    assert [result.note for result in found] == ["", NO_CHANGE, NOT_READ]


def test_the_command_prints_a_table_and_writes_its_rows(tmp_path):
    out = tmp_path / "rows.csv"
    call = ["effects", "--effect", "lidar", "--effect", "wind", "--seeds", "1", "--duration", "2"]
    found = CliRunner().invoke(app, [*call, "--workers", "1", "--out", str(out)])
    assert found.exit_code == 0, found.output
    assert "| lidar: lost and false returns | not read by this stack |" in found.output
    assert "| wind with gusts of 0.2 | +0.00 |" in found.output
    table = pl.read_csv(out)
    assert table["arm"].to_list() == ["none", "lidar", "wind", "all"]
    assert table["log_hash"][0] == table["log_hash"][1] != table["log_hash"][2]


RESULTS = Path(__file__).parents[2] / "docs" / "results"


def plain(text):
    """A cell without the sign of what is positive or rounds to nothing."""
    return (
        text.removeprefix("+").replace("-0.00", "0.00")
        if text[1:5] == "0.00"
        else text.removeprefix("+")
    )


@pytest.mark.parametrize("name", ["ours", "motorway", "fog", "lidar", "camera"])
def test_the_page_shows_what_its_rows_say(name):
    page = (RESULTS / "effects.md").read_text(encoding="utf-8")
    table = pl.read_csv(RESULTS / f"effects-{name}.csv", schema_overrides={"stack": pl.String})
    seeds = table["seed"].n_unique()
    for found in compare_effects(table):
        cells = [
            found.note or plain(difference_text(d)) for d in (found.interventions, found.speed)
        ]
        line = f"| {found.title} | {cells[0]} | {cells[1]} | {found.changed} of {seeds} |"
        assert line in page.split(f"(effects-{name}.csv)")[1].split("\n```console")[0]


def test_our_stack_has_a_row_for_every_effect():
    arms = pl.read_csv(RESULTS / "effects-ours.csv")["arm"].unique().to_list()
    assert set(arms) == {NONE, *EFFECTS, "all"}
