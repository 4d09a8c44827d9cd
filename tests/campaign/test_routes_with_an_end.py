"""`--route-km`: a run ends where its way ends, and says how much of it was driven."""

import pytest
from typer.testing import CliRunner

from skidpad.campaign.driving.run_setup import journey_of
from skidpad.campaign.recipes.matrix import drive_one, roads_of
from skidpad.campaign.runs.drive import drive
from skidpad.cli.main import app
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.evidence.drive.route import measure_route
from skidpad.recording.campaign.added_metrics import METRICS_FILE, read_added_metrics
from skidpad.roads.bundled import load_map

MAP = load_map("straight")
COMPLETE = {"route_completion_pct": 100.0, "route_unaided_pct": 100.0}


class Straight:
    """Drives straight on with half of the throttle, and brakes from `stop_s` on."""

    def __init__(self, specs, map, settings):
        self.stop_s = settings.get("stop_s", 1e9)

    def tick(self, frame):
        if frame.tick * 0.05 > self.stop_s:
            return VehicleCommand(brake=1.0)
        return VehicleCommand(throttle=0.5)


def drive_straight(route_km, **settings):
    """One run of 30 s without traffic, and what it says of its route."""
    run = drive(
        Straight, map="straight", vehicles=0, duration=30.0, sensors="objects",
        route_km=route_km, stack_settings=settings,
    )  # fmt: skip
    journey = journey_of(Roads(map="straight", route_km=route_km), MAP)
    return run, {m.name: m.value for m in measure_route(run.log, journey)}


def test_a_run_ends_where_its_way_ends():
    run, told = drive_straight(0.2)
    assert len(run.log) * 0.05 < 25.0
    x = run.log.actors.x[:, 0]
    assert abs(x[-1] - x[0]) == pytest.approx(200.0, abs=4.0)
    assert told == COMPLETE


def test_a_run_that_stands_ends_with_its_time_and_tells_its_share():
    run, told = drive_straight(1.0, stop_s=8.0)
    x = run.log.actors.x[:, 0]
    assert len(run.log) * 0.05 == pytest.approx(30.0, abs=0.1)
    assert told["route_completion_pct"] == pytest.approx(abs(x[-1] - x[0]) / 10.0, abs=0.6)
    assert told["route_completion_pct"] < 50.0


def test_a_description_without_a_route_is_as_before_and_one_with_it_comes_back():
    assert "route_km" not in RunSpec().to_plain()["course"]
    run = RunSpec(course=Roads(route_km=3.0))
    assert run_from_plain(run.to_plain(), "here") == run
    assert journey_of(roads_of(RunSpec()), MAP) is None


def test_the_column_is_in_the_results_of_a_campaign(tmp_path):
    course = Roads(map="straight", vehicles=0, route_km=0.1)
    cell = RunSpec(course=course, sensors=SensorLevel.OBJECTS, duration=20.0)
    row = drive_one(tmp_path, cell)
    (run,) = tmp_path.rglob(METRICS_FILE)
    assert read_added_metrics(run.parent) == row.added
    assert {m.name: m.value for m in row.added} == COMPLETE


@pytest.mark.parametrize(
    ("km", "words"),
    [
        ("40", "route-km must be at most .* on map straight"),
        ("-1", "--route-km must be between 0 and 1000, got -1"),
        ("2000", "--route-km must be between 0 and 1000"),
    ],
)
def test_a_wrong_length_gets_one_sentence(tmp_path, km, words):
    call = ["adas", "--map", "straight", "--route-km", km, "--out", str(tmp_path / "out")]
    with pytest.raises(ConfigError, match=words):
        CliRunner().invoke(app, call, catch_exceptions=False)
    assert not (tmp_path / "out").exists()
