"""Sets of functions and cruise targets as factors of the matrix: cells, columns, report."""

from __future__ import annotations

from pathlib import Path

import pytest

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.matrix import cruising, drivers_with, published_drivers
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.recipes.matrix import RECIPE, run_key, warm_up
from skidpad.campaign.runs.run import run
from skidpad.campaign.workers.pool import local
from skidpad.cli.campaigns.adas_plan import plan
from skidpad.cli.options.asked import Climate, Drivers
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.run import AdasDriver, Function, ReferenceDriver, RunSpec
from skidpad.core.settings.stack import StackSettings
from skidpad.core.vocabulary import Outcome, SensorLevel, TrafficStart
from skidpad.physics.presets import find_weather
from skidpad.recording.campaign.results import read_results
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.recording.run.motion import motion_hash
from skidpad.report.matrix.page import write_report
from skidpad.stack.configurations import functions_of
from skidpad.stack.control.caps import cap_rules

ONE = Climate(weather="clear-noon")


def drivers(**asked: object) -> list[AdasDriver]:
    chosen = Drivers(**asked).find_drivers()  # type: ignore[arg-type]
    assert all(isinstance(d, AdasDriver) for d in chosen)
    return chosen  # type: ignore[return-value]


def test_every_set_of_functions_with_every_target() -> None:
    asked = drivers(configs="2", functions=("aeb", "acc,lca,bend"), cruise="60:150:30")
    assert len(asked) == 3 * 4
    assert {d.cruise_kmh for d in asked} == {60.0, 90.0, 120.0, 150.0}
    assert {d.functions for d in asked} == {
        functions_of(2),
        frozenset({Function.AEB}),
        frozenset({Function.ACC, Function.LCA, Function.BEND}),
    }
    assert asked[0].label == "2 at 60 km/h"
    cells = plan(
        RunSpec(), Drivers(functions=("aeb",), cruise="80").find_drivers(), ONE.find_weathers(), 2
    )
    assert [c.driver.label for c in cells] == ["aeb at 80 km/h"] * 2


def test_without_factors_all_is_as_published() -> None:
    *published, reference = Drivers().find_drivers()
    assert published == published_drivers("all")
    assert reference == ReferenceDriver()
    assert drivers(functions=("",))[0].label == "none"


@pytest.mark.parametrize(
    ("text", "word"),
    [("fast", "numbers"), ("60:150", "numbers"), ("0:10:5", "between"), ("150:60:10", "A <= B")],
)
def test_a_wrong_target_is_named(text: str, word: str) -> None:
    with pytest.raises(ConfigError, match=word):
        cruising(published_drivers("1"), text)


def test_a_limiter_never_raises_the_target() -> None:
    for target, limit, expected in ((60.0, 80.0, 60.0), (150.0, 80.0, 80.0)):
        caps = cap_rules(functions_of(4), target, limit, StackSettings(), 0.05)
        assert caps.cruise_kmh == expected


def test_the_columns_say_what_was_varied() -> None:
    (aeb,) = drivers_with(["aeb"])
    roads = Roads(traffic=TrafficStart.PACK)
    spec = RunSpec(driver=aeb, course=roads, weather=find_weather("clear-noon"))
    key = run_key(spec, Outcome.COMPLETED)
    assert (key.functions, key.cruise_kmh, key.traffic) == ("aeb", 150.0, "pack")
    (slow,) = cruising(published_drivers("4"), "110")
    key = run_key(RunSpec(driver=slow), Outcome.COMPLETED)
    assert (key.functions, key.cruise_kmh) == ("acc+lca+limiter+resume+tla", 80.0)


def test_a_car_cruises_at_its_target() -> None:
    (driver,) = cruising(drivers_with(["acc,lca"]), "60")
    spec = RunSpec(
        driver=driver, course=Roads(vehicles=0), sensors=SensorLevel.OBJECTS, duration=20.0
    )
    assert stage_of(spec).cruise_kmh is None
    v = run(spec).log.v_ego
    assert v[-1] * 3.6 == pytest.approx(60.0, abs=2.0)


def test_the_report_shows_factors(tmp_path: Path) -> None:
    spec = RunSpec(sensors=SensorLevel.OBJECTS, duration=2.0, course=Roads(vehicles=2))
    cells = plan(
        spec,
        Drivers(configs="1", functions=("aeb",), cruise="60:90:30").find_drivers(),
        ONE.find_weathers(),
    )
    Campaign(RECIPE, cells).run(tmp_path, local(1, warm_up))
    table = read_results(tmp_path, RECIPE.columns)
    assert sorted(table.select("functions", "cruise_kmh").rows()) == [
        ("acc", 60.0),
        ("acc", 90.0),
        ("aeb", 60.0),
        ("aeb", 90.0),
    ]
    logs = [read_log(tmp_path / "runs" / cell.name) for cell in cells]
    assert set(table["motion_hash"]) == {motion_hash(log) for log in logs}
    assert set(table["log_hash"]) == {log_hash(log) for log in logs}
    assert table["undisturbed_s"].to_list() == pytest.approx([2.0] * 4)
    assert table["serious_contacts"].to_list() == table["interventions"].to_list() == [0] * 4
    page = write_report(tmp_path).read_text(encoding="utf-8")
    assert "By functions and cruise target" in page
    assert "Crashes against the cruise target" in page


def test_a_control_character_around_a_number_is_a_space() -> None:
    assert published_drivers("4, 0\x1d") == published_drivers("4,0")
