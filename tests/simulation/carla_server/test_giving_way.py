"""What stop and yield signs show to who waits at them, beside what the rules of the road say."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import LightState
from skidpad.roads.lanes import SignalKind
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served

CAR = "vehicle.tesla.model3"
STOP_ROAD, STOP_JUNCTION = 1, 9001  # a road that ends with a stop sign at a road that goes on
YIELD_ROAD, YIELD_JUNCTION = 8, 9012
STANDS = 3.5  # m from a car's middle to the line before which it stands


@pytest.fixture
def town() -> Served:
    return Served(ServerOptions(map="town"), StreamHub())


def line_of(served: Served, road: int, kind: SignalKind) -> tuple[int, float]:
    """Lane and place of a road's sign."""
    roads = served.episode.map.roads
    for row in np.flatnonzero(roads.signals.kind == kind).tolist():
        lane = int(roads.signals.lane[row])
        if roads.lanes.road[lane] == road:
            return lane, float(roads.signals.s[row])
    raise AssertionError(f"road {road} has no such sign")


def put(served: Served, lane: int, s: float) -> Actor:
    """A car that stands there."""
    place: Pose = served.episode.map.roads.at(lane, s).pose
    return served.episode.spawn(Wanted(CAR, {}), place)


def across(served: Served, junction: int, road: int) -> int:
    """A lane of the junction that leads from another road to another: who comes over it passes."""
    roads = served.episode.map.roads
    lanes = roads.lanes
    for lane in np.flatnonzero(lanes.junction == junction).tolist():
        first, after = lanes.prev_start[lane], lanes.prev_start[lane + 1]
        ends = {int(p) for p in lanes.prev_lane[first:after]} | set(roads.successors(lane))
        if road not in lanes.road[sorted(ends)]:
            return int(lane)
    raise AssertionError(f"nobody passes by in junction {junction}")


def shown(served: Served, car: Actor) -> tuple[LightState, bool]:
    """State that a car is shown, and whether it is a traffic light's."""
    row = served.episode.rows.vehicles[car.row]
    return LightState(int(row["light_state"])), bool(row["has_light"])


def watch(served: Served, car: Actor, seconds: float) -> list[LightState]:
    """What a car is shown, tick by tick; never by a traffic light."""
    seen = []
    for _ in range(round(seconds / served.clock.step)):
        served.tick()
        state, light = shown(served, car)
        assert not light
        seen.append(state)
    return seen


def test_one_stops_for_two_seconds_at_a_stop_sign_on_an_empty_road(town: Served) -> None:
    lane, line = line_of(town, STOP_ROAD, SignalKind.STOP)
    seen = watch(town, put(town, lane, line - STANDS), 4.0)
    red = seen.count(LightState.RED) * town.clock.step
    assert red == pytest.approx(2.0, abs=2.5 * town.clock.step)
    assert seen[-1] is LightState.GREEN
    assert seen == sorted(seen, key=lambda state: state is LightState.GREEN)


def test_one_goes_at_once_at_a_yield_sign_on_an_empty_road(town: Served) -> None:
    lane, line = line_of(town, YIELD_ROAD, SignalKind.YIELD)
    seen = watch(town, put(town, lane, line - STANDS), 1.0)
    assert set(seen) == {LightState.GREEN}


@pytest.mark.parametrize(
    ("road", "junction", "kind"),
    [
        (STOP_ROAD, STOP_JUNCTION, SignalKind.STOP),
        (YIELD_ROAD, YIELD_JUNCTION, SignalKind.YIELD),
    ],
)
def test_one_waits_while_somebody_is_in_the_way(
    town: Served, road: int, junction: int, kind: SignalKind
) -> None:
    lane, line = line_of(town, road, kind)
    car = put(town, lane, line - STANDS)
    other = put(town, across(town, junction, road), 8.0)
    assert set(watch(town, car, 5.0)) == {LightState.RED}
    town.episode.destroy(other.id)
    assert watch(town, car, 1.0)[-1] is LightState.GREEN


def test_who_follows_on_ones_own_road_is_not_waited_for(town: Served) -> None:
    lane, line = line_of(town, STOP_ROAD, SignalKind.STOP)
    car = put(town, lane, line - STANDS)
    put(town, lane, line - STANDS - 7.0)
    assert watch(town, car, 3.0)[-1] is LightState.GREEN


def test_who_is_not_at_the_line_yet_is_shown_nothing(town: Served) -> None:
    lane, line = line_of(town, STOP_ROAD, SignalKind.STOP)
    put(town, across(town, STOP_JUNCTION, STOP_ROAD), 8.0)
    assert set(watch(town, put(town, lane, line - 12.0), 1.0)) == {LightState.GREEN}


def test_who_drives_away_from_the_sign_is_shown_nothing(town: Served) -> None:
    lane, line = line_of(town, STOP_ROAD, SignalKind.STOP)
    put(town, across(town, STOP_JUNCTION, STOP_ROAD), 8.0)
    roads = town.episode.map.roads
    back = roads.at(lane, line - STANDS).pose
    turned = Pose(back.x, back.y, back.z, yaw=back.yaw + np.pi)
    car = town.episode.spawn(Wanted(CAR, {}), turned)
    assert set(watch(town, car, 1.0)) == {LightState.GREEN}
