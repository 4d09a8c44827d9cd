"""Background drivers in town who once touched: at a slip road, in a junction, and on entering."""

import numpy as np
import pytest

from skidpad.campaign.bench.traffic import background_world
from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.core.vocabulary import LightState
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.touch import EGO
from skidpad.simulation.world.traffic.spacing import claims, is_crossing_free

TOWN = load_map("town")


def drivers_at(weather, *places):
    """A town with one driver per (lane, s, v, way) and nobody else, all lights green."""
    world = background_world(TrafficBench(map="town", vehicles=len(places) + 1, km=1.0), weather, 1)
    traffic = world.traffic
    traffic.waiting.clear()
    traffic.release(EGO)
    world.states.present[EGO] = False
    for i, (lane, s, v, way) in enumerate(places, start=1):
        world.put(i, TOWN.at(lane, s).pose, v)
        traffic.engage(i, lane, s)
        traffic.drivers.path[i, : len(way)] = way
    world.lights.hold((k, LightState.GREEN) for k in world.lights.by_id)
    return world


def drive(world, seconds):
    """(ticks, actors) speeds and lanes of the drivers, and the number of contacts."""
    rows, contacts = [], 0
    for _ in range(round(seconds / 0.05)):
        world.step()
        contacts += len(world.events.background)
        rows.append(
            (np.hypot(world.states.vx, world.states.vy), world.traffic.drivers.path[:, 0].copy())
        )
    speed, lane = (np.array(column) for column in zip(*rows, strict=True))
    return speed, lane, contacts


@pytest.mark.parametrize("start", [220.0, 243.5])  # of the main road, as in two contacts seen
def test_the_main_road_makes_room_for_who_joins_from_a_slip_road(start):
    world = drivers_at(
        "clear-noon", (86, start, 20.0, (86, 90, 94)), (100, 106.0, 12.2, (100, 102, 94))
    )
    speed, _, contacts = drive(world, 9.0)
    assert contacts == 0
    assert np.diff(speed[:, 1]).min() / 0.05 > -5.0, "it brakes early instead of hard"


def test_who_stopped_in_a_junction_judges_gaps_anew():
    coming, turning = (20, 272.0, 8.3, (20, 61, 34)), (62, 9.0, 0.0, (62, 12))
    speed, lane, contacts = drive(drivers_at("clear-noon", coming, turning), 12.0)
    assert contacts == 0
    passed = np.flatnonzero(lane[:, 1] == 34)[0]
    assert speed[:passed, 1].min() > 6.0, "who has priority drives on"
    assert speed[: passed - 20, 2].max() < 1.5, "who turns left waits where it stands"
    assert speed[-1, 2] > 2.0, "and then goes"


@pytest.mark.parametrize("weather", ["clear-noon", "icy_30"])
def test_who_is_on_the_roundabout_does_not_follow_one_that_waits_to_enter(weather):
    """The one that waits is nearer to the merge by a car's length."""
    around, waits = (112, 18.0, 2.0, (112, 106, 115, 107, 108)), (36, 95.2, 0.0, (36, 117, 107))
    world = drivers_at(weather, around, waits)
    speed, lane, contacts = drive(world, 25.0)
    assert contacts == 0
    passed = np.flatnonzero(lane[:, 1] == 107)
    assert len(passed), "who has priority passes"
    assert speed[: passed[0], 1].min() > 1.5, "without slowing down"
    assert speed[: passed[0] - 20, 2].max() < 0.5, "and the other one waits"


@pytest.mark.parametrize("weather", ["clear-noon", "snow", "icy_30"])
def test_two_who_turn_left_do_not_wait_for_the_second_in_each_others_queue(weather):
    """Each queue: first one that turns left, then one that turns right into the other's exit."""
    line = 157.0
    places = []
    for lane, left, right in ((0, (41, 14), (42, 18)), (6, (45, 18), (44, 14))):
        places += [(lane, line - 4.0, 0.0, (lane, *left)), (lane, line - 11.0, 0.0, (lane, *right))]
    _, lane, contacts = drive(drivers_at(weather, *places), 60.0)
    assert contacts == 0
    assert all(np.isin(lane[:, i], (14, 18)).any() for i in (1, 2, 3, 4)), "all get through"


@pytest.mark.parametrize("weather", ["clear-noon", "icy_30"])
def test_who_stands_within_a_junction_does_not_yield_for_ever_to_a_queue_that_waits_for_it(weather):
    """The second of the queue is what it yields to, the first waits until the area is free."""
    inside = (72, 18.8, 0.0, (72, 16))
    queue = [(28, s, 0.0, (28, 75, 24)) for s in (296.0, 289.0)]
    _, lane, contacts = drive(drivers_at(weather, inside, *queue), 60.0)
    assert contacts == 0
    assert all((lane[:, i] == way).any() for i, way in ((1, 16), (2, 24), (3, 24)))


@pytest.mark.parametrize("weather", ["clear-noon", "icy_30"])
@pytest.mark.parametrize("waited", [0.0, 10.0])
def test_of_two_who_stood_long_and_start_together_the_one_with_priority_goes(weather, waited):
    """A left turn and one that comes the other way, both impatient; the second stood for longer."""
    turns, comes = (12, 104.7, 0.0, (12, 47, 9)), (16, 102.7, 0.0, (16, 51, 14))
    world = drivers_at(weather, turns, comes)
    world.traffic.drivers.state["stood"][1:3] = 42.0, 86.0
    world.traffic.drivers.state["waited"][1] = waited
    _, lane, contacts = drive(world, 45.0)
    assert contacts == 0
    through = [np.flatnonzero(lane[:, i] == way)[0] for i, way in ((1, 9), (2, 14))]
    assert through[1] < through[0]


@pytest.mark.parametrize("weather", ["clear-noon", "icy_30"])
@pytest.mark.parametrize(("s", "passes"), [(18.8, False), (30.0, True)])
def test_who_waits_within_a_junction_never_creeps_into_one_that_stands_there(weather, s, passes):
    """It stood for 20 s before an area that it shares with the other, which does not move."""
    waits, stands = (71, 8.9, 0.0, (71, 30)), (72, s, 0.0, (72, 16))
    world = drivers_at(weather, waits, stands)
    world.traffic.release(2)
    _, lane, contacts = drive(world, 45.0)
    assert contacts == 0
    assert (lane[:, 1] == 30).any() == passes


@pytest.mark.parametrize("weather", ["clear-noon", "icy_30"])
@pytest.mark.parametrize("stood", [60.0, 0.0])
def test_who_stood_long_at_a_light_is_let_go_first(weather, stood):
    line = 157.0
    turner, coming = (0, line - 4.0, 0.0, (0, 41)), (6, line - 40.0, 5.0, (6, 43))
    world = drivers_at(weather, turner, coming)
    world.traffic.drivers.state["stood"][1] = stood
    _, lane, contacts = drive(world, 60.0)
    assert contacts == 0
    first_in = [np.flatnonzero(lane[:, i] == way)[0] for i, way in ((1, 41), (2, 43))]
    assert (first_in[0] < first_in[1]) == (stood > 0.0)


def test_who_stood_long_before_an_endless_stream_is_let_go_first():
    """A left turn out of the main road, before right turns that come one after another."""
    coming = [(38, 95.0 - 25.0 * k, 8.0, (38, 68, 6)) for k in range(4)]
    world = drivers_at("clear-noon", (30, 301.0, 0.0, (30, 66, 6)), *coming)
    world.traffic.drivers.state["stood"][1] = 60.0
    speed, lane, contacts = drive(world, 30.0)
    assert contacts == 0
    through = [np.flatnonzero(lane[:, i] == 6)[0] for i in (1, 2, 3)]
    assert through[1] < through[0] < through[2], "the second of the stream stops for it"
    assert (speed[10:] - speed[:-10]).min() / 0.5 > -4.0, "and none brakes hard"


@pytest.mark.parametrize(
    ("s", "other", "is_free"),
    [
        (283.8, (26, 299.0, 11.0, (26, 72, 16)), False),  # who turns left cannot yield any more
        (283.8, (26, 220.0, 11.0, (26, 72, 16)), True),  # 85 m before the junction: sees and yields
        (200.0, (26, 299.0, 11.0, (26, 72, 16)), True),  # put 100 m before it
        (283.8, (28, 100.0, 11.0, (28, 75)), True),  # nobody comes across
    ],
)
def test_nobody_is_put_where_others_have_decided_to_cross(s, other, is_free):
    world = drivers_at("clear-noon", other, (0, 10.0, 0.0, (0,)))
    world.step()
    claimed = claims(world.placed, world.traffic.drivers)
    assert is_crossing_free(world.traffic.streets, claimed, 28, s, 2) == is_free
