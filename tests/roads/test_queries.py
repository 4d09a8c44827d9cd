"""Questions about lanes: inverses, heights, straightest paths."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cos, hypot, sin

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from skidpad.core.errors import ConfigError
from skidpad.roads import kernels
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import LanePoint, RoadMap
from support.examples import examples

MAP = load_map("figure8")
DRIVING = np.flatnonzero(MAP.arrays.drivable)
MAIN = [i for i in DRIVING if MAP.lanes.road[i] not in (50, 102, 104)]
CROSSING = (324.0, -7.0)  # where the loop crosses itself


@st.composite
def places(draw: st.DrawFn, lanes: tuple[int, ...] = tuple(MAIN)) -> LanePoint:
    lane = draw(st.sampled_from(lanes))
    return MAP.at(lane, draw(st.floats(0.0, 1.0)) * float(MAP.lanes.length[lane]))


def beside(point: LanePoint, left: float, up: float = 0.0) -> tuple[float, float, float]:
    return (
        point.x - left * sin(point.heading),
        point.y + left * cos(point.heading),
        point.z + up,
    )


@given(places(), st.floats(0.0, 4000.0))
@settings(max_examples=examples(200))
@pytest.mark.req("A-078")
def test_behind_undoes_ahead(point: LanePoint, distance: float) -> None:
    there = MAP.ahead(point, distance)
    assert there is not None
    back = MAP.behind(there, distance)
    assert back is not None
    assert hypot(back.x - point.x, back.y - point.y) < 1e-6
    assert abs(back.lane_id) == abs(point.lane_id)


@given(places())
@settings(max_examples=examples(200))
@pytest.mark.req("A-077", "A-204")
def test_left_and_right_are_inverse_and_one_lane_away(point: LanePoint) -> None:
    left = MAP.left(point)
    assume(left is not None)
    assert left is not None
    back = MAP.right(left)
    assert back is not None
    assert back.lane == point.lane
    assert back.s == pytest.approx(point.s, abs=1e-4)
    assert hypot(left.x - point.x, left.y - point.y) == pytest.approx(3.5, abs=2e-3)


@given(places(), st.floats(-1.7, 1.7), st.floats(-0.5, 0.5))
@settings(max_examples=examples(400))
def test_projection_finds_the_place_again(point: LanePoint, left: float, up: float) -> None:
    assume(MAP.lanes.junction[point.lane] < 0)
    found = MAP.project(*beside(point, left, up))
    assert found is not None
    assert hypot(found.x - point.x, found.y - point.y) < 2e-3
    assert found.offset == pytest.approx(left, abs=1e-3)
    assert found.lane_id == point.lane_id


@given(places(tuple(DRIVING)), st.floats(-25.0, 25.0), st.floats(-3.0, 3.0))
@settings(max_examples=examples(300))
def test_projection_is_the_nearest_of_all_samples(point: LanePoint, left: float, up: float) -> None:
    x, y, z = beside(point, left, up)
    driving = MAP.arrays.drivable[MAP.samples.lane] == 1
    d = np.sqrt(
        (MAP.samples.x[driving] - x) ** 2
        + (MAP.samples.y[driving] - y) ** 2
        + (kernels.Z_WEIGHT * (MAP.samples.z[driving] - z)) ** 2
    )
    found = MAP.project(x, y, z)
    if found is None:
        assert d.min() > kernels.REACH - 1e-6
    else:
        own = hypot(found.x - x, found.y - y, kernels.Z_WEIGHT * (found.z - z))
        # The foot is that of the plane; on a grade a point up or down the lane may be 0.7 % nearer.
        assert own <= 1.008 * d.min() + 1e-6
        assert own >= d.min() - 0.6


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.0), (2.0, -3.0), (-5.0, 4.0), (8.0, 8.0)])
def test_roads_above_each_other_are_told_apart(figure8: RoadMap, dx: float, dy: float) -> None:
    x, y = CROSSING[0] + dx, CROSSING[1] + dy
    below, above = figure8.project(x, y, 0.3), figure8.project(x, y, 9.9)
    assert below is not None
    assert above is not None
    assert below.road == 3
    assert above.road not in (3, 50)
    assert above.z - below.z >= 8.0 + 1.0  # clearance and the bridge's own thickness
    height_sweep = [figure8.project(x, y, float(z)) for z in np.linspace(-3.0, 3.0, 13)]
    assert {p.road for p in height_sweep if p is not None} == {3}


def test_beside_the_road_below_the_bridge_is_still_below(figure8: RoadMap) -> None:
    found = figure8.project(CROSSING[0], 8.0, 0.0)
    assert found is not None
    assert found.road == 3


@pytest.mark.req("A-148")
def test_at_the_exit_the_straightest_path_stays_on_the_main_road(figure8: RoadMap) -> None:
    before = figure8.on_lane(1, -4, 50.0)
    straight = figure8.ahead(before, 150.0)
    assert straight is not None
    assert straight.road == 3
    branches = {p.road for p in figure8.all_ahead(before, 150.0)}
    assert branches == {3, 50}
    turned = figure8.ahead(before, 150.0, heading=before.heading - 0.3)
    assert turned is not None
    assert turned.road == 50


@pytest.mark.req("A-147", "A-212")
def test_tracing_the_highway_leaves_the_ramp_out(figure8: RoadMap) -> None:
    assert figure8.ego_start is not None
    traced = figure8.traced_roads(figure8.place(figure8.ego_start))
    assert traced.isdisjoint({50, 102, 104})
    assert len(traced) == 13


@pytest.mark.req("A-158", "A-163")
def test_distance_to_a_light_shrinks_by_what_is_driven(figure8: RoadMap) -> None:
    start = figure8.on_lane(1, -3, 10.0)
    seen = figure8.signal_ahead(start, 800.0)
    assert seen is not None
    nearer = figure8.ahead(start, 500.0)
    assert nearer is not None
    again = figure8.signal_ahead(nearer, 800.0)
    assert again is not None
    assert again.signal == seen.signal
    assert again.distance == pytest.approx(seen.distance - 500.0, abs=1e-9)
    assert figure8.signal_ahead(start, seen.distance - 0.01) is None


def test_far_away_and_not_a_number_are_nowhere(figure8: RoadMap) -> None:
    assert figure8.project(1e9, 0.0, 0.0) is None
    assert figure8.project(float("nan"), 0.0, 0.0) is None
    assert figure8.project(0.0, 0.0, float("inf")) is None


def test_opendrive_coordinates_go_both_ways(figure8: RoadMap) -> None:
    place = figure8.on_lane(5, -3, 123.4)
    assert figure8.s_road(place) == pytest.approx(123.4, abs=1e-5)
    with pytest.raises(ConfigError, match="road 5 lane -9"):
        figure8.on_lane(5, -9, 1.0)
    with pytest.raises(ConfigError, match="s from 0"):
        figure8.on_lane(5, -3, 1e5)


def test_kernels_continue_lanes_smoothly_across_samples(figure8: RoadMap) -> None:
    place = figure8.on_lane(5, -2, 40.0)
    fine = [figure8.at(place.lane, place.s + 0.01 * k) for k in range(300)]
    for a, b in pairwise(fine):
        assert hypot(b.x - a.x, b.y - a.y) == pytest.approx(0.01, abs=1e-6)
    assert replace(fine[0], s=0.0) != fine[0]
