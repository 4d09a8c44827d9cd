"""Background traffic looked at from outside: overlaps, headways, standing, moves."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.campaign.bench.headways import headways_of
from skidpad.campaign.bench.traffic import background_world
from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.campaign.bench.traffic_watch import (
    CIRCLE,
    LONG,
    TrafficCounts,
    Watch,
    leaders,
    overlaps,
    root_of,
    times_to_neighbours,
    wait_circles,
)
from skidpad.simulation.world.traffic.state import Held
from skidpad.simulation.world.world import World


def world_of(map: str = "motorway", vehicles: int = 20, weather: str = "clear-noon") -> World:
    return background_world(TrafficBench(map=map, vehicles=vehicles), weather, 900_000)


def at(world: World, i: int, forward: float, left: float, turned: float = 0.0) -> None:
    """Vehicle i stands beside the ego's place."""
    pose = world.states.pose(0).moved(forward=forward, left=left)
    world.put(i, pose, 0.0)
    world.states.yaw[i] += turned


def test_rectangles_overlap_where_they_do() -> None:
    world = world_of()
    length = float(world.table.length[0] + world.table.length[1]) / 2.0
    width = float(world.table.width[0] + world.table.width[1]) / 2.0
    for forward, left, found in (
        (length - 0.05, 0.0, True),
        (length + 0.05, 0.0, False),
        (0.0, width - 0.05, True),
        (0.0, width + 0.05, False),
    ):
        at(world, 1, forward, left)
        assert ((0, 1) in overlaps(world)) == found
    across = float(world.table.width[0] + world.table.length[1]) / 2.0
    for left, found in ((across - 0.05, True), (across + 0.05, False)):
        at(world, 1, 0.0, left, np.pi / 2.0)
        assert ((0, 1) in overlaps(world)) == found
    at(world, 1, 0.0, 0.0)
    world.states.z[1] += 8.0  # on a bridge
    assert not overlaps(world)


@pytest.mark.req("A-209")
def test_every_move_of_random_traffic_is_counted_and_nobody_is_near() -> None:
    """In rain on figure8, where half of all moves came out of a queue."""
    world, seen, jumps = world_of("figure8", 60, "rain-noon"), TrafficCounts(), 0
    watch = Watch(world, seen, "rain-noon", 900_000)
    for _ in range(2400):
        there, x, y = world.states.present.copy(), world.states.x.copy(), world.states.y.copy()
        world.step()
        far = np.hypot(world.states.x - x, world.states.y - y) > 10.0
        jumps += int((far & there).sum())
        watch.look()
    assert seen.moved == jumps >= 15
    assert seen.moved_close == 0
    assert seen.overlaps == 0


def test_leaders_and_times_are_those_of_the_lane() -> None:
    world = world_of()
    for _ in range(200):
        world.step()
    leader, gap = leaders(world)
    i = int(np.argmin(gap))
    j = int(leader[i])
    apart = np.hypot(world.states.x[i] - world.states.x[j], world.states.y[i] - world.states.y[j])
    bumpers = float(world.placed["half_length"][i] + world.placed["half_length"][j])
    assert gap[i] == pytest.approx(apart - bumpers, abs=0.5)
    time = gap[i] / world.placed["speed"][i]
    assert times_to_neighbours(world)[j] <= time
    assert headways_of([0.5, 1.5, 2.5, 1.5])["share_below_2_s"] == 0.75


@pytest.mark.parametrize(
    ("wanted", "own", "lead", "counted"),
    [
        (30.0, 25.0, 25.0, True),
        (26.0, 25.0, 25.0, False),  # no leader holds it up
        (30.0, 25.4, 25.0, True),
        (30.0, 25.6, 25.0, False),  # still closing in
    ],
)
def test_followers_are_held_up_and_no_longer_close_in(
    wanted: float, own: float, lead: float, counted: bool
) -> None:
    """A vehicle 30 m behind a leader, both 4 m long or more, on a motorway."""
    world, seen = world_of(vehicles=2), TrafficCounts()
    watch = Watch(world, seen, "clear-noon", 900_000)
    assert world.traffic is not None
    halves = world.placed["half_length"][:2].copy()
    for tick in range(10, 220, 10):
        world.tick = tick
        world.placed["present"][:2] = world.states.present[:2] = True
        world.placed["lane"][1] = world.placed["lane"][0]
        world.placed["sample"][1] = world.placed["sample"][0]
        world.placed["s"][1] = world.placed["s"][0] + 30.0 + halves.sum()
        world.placed["speed"][:2] = own, lead
        world.placed["ax"][:2] = 0.0
        world.traffic.drivers.state["v_desired"][0] = wanted
        watch.look()
    assert len(seen.fast) == 14  # of 21 looks: the first finds the leader, and 3.5 s are 7 of 0.5 s
    assert seen.fast[0] == pytest.approx(30.0 / own)
    assert len(seen.followers_fast) == (1 if counted else 0)  # after 10 s
    if counted:
        fronts = 30.0 / own + 2.0 * halves[1] / own
        assert seen.followers_fast_fronts[0] == pytest.approx(fronts)


def test_who_stands_long_is_listed_with_the_cause() -> None:
    world, seen = world_of(vehicles=3), TrafficCounts()
    watch = Watch(world, seen, "clear-noon", 1)
    assert world.traffic is not None
    for tick in range(round(LONG / world.dt) + 20):
        world.tick = tick
        world.traffic.drivers.state["held"][0] = Held.LIGHT
        world.placed["speed"][0] = 0.0
        watch.look()
    assert not seen.stands
    watch.end()
    (stand,) = seen.stands
    assert (stand.actor, stand.cause, stand.seconds) == (0, "light", pytest.approx(121.0))


def test_a_circle_of_those_who_wait_is_found_and_a_queue_ends_at_its_first() -> None:
    blocker = np.array([1, 2, 0, 2, 5, -1, 4, 9, -1, 7], dtype=np.int32)
    stands = np.array([True] * 7 + [False, True, True])
    assert wait_circles(blocker, stands) == [(0, 1, 2)]
    assert root_of(blocker, stands, 6) == 5
    assert root_of(blocker, stands, 9) == 9, "the one that it waits for drives"
    assert root_of(blocker, stands, 3) in (0, 1, 2)


@pytest.mark.req("C-210")
def test_a_circle_that_stood_for_a_minute_is_listed_once() -> None:
    world, seen = world_of(vehicles=3), TrafficCounts()
    watch = Watch(world, seen, "clear-noon", 1)
    assert world.traffic is not None
    driver = world.traffic.drivers.state
    for tick in range(round(CIRCLE / world.dt) + 60):
        world.tick = tick
        driver["held"][:2], driver["blocker"][:2] = Held.MERGING, (1, 0)
        world.states.present[:2], driver["active"][:2] = True, True
        world.placed["speed"][:2] = 0.0
        watch.look()
    (circle,) = seen.circles
    assert [line.split(": ")[1] for line in circle] == ["merging of 1", "merging of 0"]


def test_a_driver_notes_whom_it_follows() -> None:
    world = world_of("figure8", 60)
    assert world.traffic is not None
    driver, lane, found = world.traffic.drivers.state, world.placed["lane"], 0
    for _ in range(600):
        world.step()
        follows = np.flatnonzero(world.states.present & (driver["held"] == Held.LEADER))
        other = driver["blocker"][follows]
        assert (other >= 0).all()
        same = (lane[follows] == lane[other]) & (driver["change"][follows] > 20.0)
        assert (other == leaders(world)[0][follows])[same].all()
        found += int(same.sum())
    assert found > 100
