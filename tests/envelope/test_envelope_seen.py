"""Sight of walkers and lane boundaries, and bridges: measured distances, and limits by a second route."""

from dataclasses import replace
from math import inf, radians
from pathlib import Path

import numpy as np
import pytest
from msgspec import structs

import skidpad
from skidpad.campaign.driving.governing import choose_envelope
from skidpad.campaign.runs.run import run as drive_run
from skidpad.core.courses import Roads, Scenario
from skidpad.core.geometry import Pose
from skidpad.core.run import RunSpec, StackDriver
from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Govern, SensorLevel
from skidpad.core.weather import Weather
from skidpad.envelope.belief import BRIDGE_K, COLD_C, prior_grip
from skidpad.envelope.bridges import BridgesAhead
from skidpad.envelope.limits import Binding, bridge_speed, preview_speed
from skidpad.envelope.seen import FORGET, LEAST, Direction, SeenDistances, boundary_end
from skidpad.envelope.sight import Way
from skidpad.roads.bundled import load_map
from skidpad.stack.configurations import numbered_driver

DT = 0.05
STRAIGHT = Path(skidpad.__file__).parent / "roads" / "maps" / "straight.xodr"
EXAMPLE = Path(__file__).parents[2] / "examples" / "pedestrian.xosc"
BRIDGE = '<objects><bridge id="b" s="300" length="40" name="" type="concrete"></bridge>'


class Forward:
    """Half throttle straight on."""

    def __init__(self, specs, map, settings):
        pass

    def tick(self, frame):
        return VehicleCommand(throttle=0.5)


def stops_on_bridge(v, distance, reach, on_bridge, approach, delay):
    """Slows after the delay up to the bridge, then brakes after the delay: does it stop within `reach`?"""
    x, t, step = 0.0, 0.0, 1e-3
    while x < distance and v > 0.0:
        if t >= delay:
            v -= approach * step
        x, t = x + v * step, t + step
    t, way = 0.0, 0.0
    while v > 0.0:
        if t >= delay:
            v -= on_bridge * step
        way, t = way + max(v, 0.0) * step, t + step
    return way <= reach


@pytest.mark.parametrize("distance", [0.0, 30.0, 80.0])
@pytest.mark.parametrize("on_bridge", [0.6, 2.0])
def test_a_car_stops_on_a_bridge_from_2_percent_below_and_not_from_15_percent_above(
    distance, on_bridge
):
    reach, approach, delay = 40.0, 1.5, 0.5
    limit = 1.0
    for _ in range(60):  # the limit depends on the speed, by the delay
        limit = 0.5 * (limit + bridge_speed(distance, reach, on_bridge, approach, delay, limit))
    assert stops_on_bridge(0.98 * limit, distance, reach, on_bridge, approach, delay)
    assert not stops_on_bridge(1.15 * limit, distance, reach, on_bridge, approach, delay)


def test_lane_boundaries_are_seen_for_the_time_of_preview():
    assert preview_speed(54.0, 1.8) == pytest.approx(30.0)
    assert preview_speed(-1.0, 1.8) == 0.0


def test_first_and_last_sight_dropouts_and_directions_are_noted():
    seen = SeenDistances(DT)
    left, ahead = radians(30.0), radians(-3.0)
    for d in (50.0, 49.0, None, None, 48.0, 30.0):  # a short loss is a dropout
        seen.note(None if d is None else (d, ahead))
    for _ in range(round(FORGET / DT) + 2):
        seen.note(None)
    seen.note((12.0, left))
    assert list(seen.first[Direction.AHEAD]) == [50.0]
    assert list(seen.last[Direction.AHEAD]) == [30.0]
    assert list(seen.first[Direction.LEFT]) == [12.0]
    assert seen.dropouts == 1
    assert seen.reach(inf) == inf
    for k in range(LEAST):
        seen = SeenDistances(DT) if k == 0 else seen
        seen.note((40.0 + k, ahead))
        for _ in range(round(FORGET / DT) + 2):
            seen.note(None)
    assert 40.0 <= seen.reach(inf) <= 42.0


def way(n=30):
    """A straight lane."""
    s = 5.0 * np.arange(n)
    return Way(s, s, 0.0 * s, 0.0 * s, 0.0 * s, 0.0)


def test_a_broken_line_is_seen_over_its_gaps_and_ends_where_nothing_follows():
    places = np.repeat([1, 2, 5, 6, 9, 16, 17], 5)  # gaps of 10 m, then one of 30 m
    assert boundary_end(places, np.full(35, 1.8), way()) == 45.0
    assert (
        boundary_end(places, np.full(35, 0.2), way()) is None
    )  # arrows in the lane are no boundary
    assert (
        boundary_end(np.array([3, 3]), np.array([-1.8, -1.8]), way()) is None
    )  # two pixels are none


def bridge_map(folder):
    """The straight road, of which 40 m are a bridge."""
    file = folder / "bridge.xodr"
    file.write_text(STRAIGHT.read_text("utf-8").replace("<objects>", BRIDGE))
    return file


def test_the_next_bridge_is_found_on_the_lane_ahead(tmp_path):
    map = load_map(str(bridge_map(tmp_path)))
    found = BridgesAhead(map)
    road, lane = map.ego_start.road, map.ego_start.lane

    def next_from(s):
        return found.find_next(map.on_lane(road, lane, s).pose)

    along = [next_from(s) for s in (50.0, 200.0, 320.0, 400.0)]
    forward = map.ahead(map.on_lane(road, lane, 200.0), 10.0)
    if map.s_road(forward) < 200.0:  # the lane runs against the road
        along.reverse()
    assert along[0] is None
    assert along[1] == pytest.approx(100.0, abs=10.0)
    assert along[2] == 0.0
    assert along[3] is None
    assert BridgesAhead(load_map("straight")).find_next(map.on_lane(road, lane, 320.0).pose) is None


def test_a_bridge_is_expected_to_freeze_before_the_road():
    near, warm = COLD_C + 0.5 * BRIDGE_K, COLD_C + BRIDGE_K
    assert prior_grip(0, near - BRIDGE_K) < 0.5 * prior_grip(0, near)
    assert prior_grip(1, warm - BRIDGE_K) == prior_grip(1, warm)


def bindings(file, air_c, govern):
    """What bound the speed of a car on the way to the bridge."""
    weather = replace(Weather(name="cool"), air_temperature_c=air_c, road_temperature_c=6.0)
    spec = RunSpec(
        driver=StackDriver("tests.none:Forward"), course=Roads(map=str(file), vehicles=0),
        weather=weather, duration=22.0, sensors=SensorLevel.OBJECTS, govern=govern, seed=900_002,
    )  # fmt: skip
    run = drive_run(spec, Forward)
    return run.readings.table["envelope.binding"].to_list()


def test_a_bridge_limits_in_cold_air_alone_and_only_where_it_is_asked_for(tmp_path):
    file = bridge_map(tmp_path)
    # the thermometer says 0.5 to 4.5 deg C
    assert float(Binding.BRIDGE) in bindings(file, 2.5, Govern.FULL)
    for air_c, govern in ((12.0, Govern.FULL), (2.5, Govern.ENVELOPE)):
        assert float(Binding.BRIDGE) not in bindings(file, air_c, govern)


def test_walkers_are_seen_first_and_last_and_nothing_of_them_is_there_unless_asked_for():
    spec = RunSpec(
        driver=numbered_driver(2), course=Scenario(file=str(EXAMPLE)), duration=10.0,
        sensors=SensorLevel.OBJECTS, govern=Govern.FULL, seed=900_003,
    )  # fmt: skip
    table = drive_run(spec).readings.table
    assert table["envelope.walker_first_ahead_m"].drop_nulls()[-1] > 15.0
    plain = drive_run(structs.replace(spec, govern=Govern.ENVELOPE)).readings.table
    assert not [c for c in plain.columns if "walker" in c or "lane" in c or "bridge" in c]


def test_the_registered_envelope_has_none_of_it():
    setup = Setup(
        map="straight", weather=Weather(), specs=(),
        ego=ActorSetup(name="ego", type="mini_cooper_s", place=Pose(0.0, 0.0)),
    )  # fmt: skip
    plain = choose_envelope(RunSpec(govern=Govern.ENVELOPE), setup)
    full = choose_envelope(RunSpec(govern=Govern.FULL), setup)
    assert [getattr(plain, name) for name in ("lanes", "walkers", "bridges")] == [False] * 3
    assert full == replace(plain, lanes=True, walkers=True, bridges=True)
