"""Routes follow lanes, reach their goal and are the shortest."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.roads.queries import RoadMap
from skidpad.roads.routing import shortest_route


def test_a_route_to_a_place_ahead_is_the_lane_itself(figure8: RoadMap) -> None:
    start = figure8.on_lane(1, -2, 20.0)
    goal = figure8.ahead(start, 900.0)
    assert goal is not None
    route = shortest_route(figure8, start, goal)
    assert route is not None
    assert route.length == pytest.approx(900.0, abs=1e-6)
    assert np.unique(figure8.lanes.lane_id[list(route.lanes)]).tolist() == [-2]


def test_a_route_to_a_place_just_behind_goes_all_around(figure8: RoadMap) -> None:
    start = figure8.on_lane(1, -2, 20.0)
    goal = figure8.on_lane(1, -2, 10.0)
    route = shortest_route(figure8, start, goal)
    assert route is not None
    assert route.length > 2900.0
    assert route.lanes[0] == route.lanes[-1] == start.lane


def test_the_ramp_is_reached_by_lane_changes(figure8: RoadMap) -> None:
    start = figure8.on_lane(1, -2, 20.0)
    goal = figure8.on_lane(50, -1, 100.0)
    route = shortest_route(figure8, start, goal)
    assert route is not None
    assert figure8.lanes.road[list(route.lanes)].tolist() == [1, 1, 1, 102, 50]
    assert figure8.lanes.lane_id[list(route.lanes)].tolist() == [-2, -3, -4, -1, -1]
    assert route.length == pytest.approx(
        40.0 + float(figure8.lanes.length[route.lanes[3]]) + goal.s
    )


def test_against_traffic_there_is_no_route() -> None:
    from skidpad.roads.bundled import load_map

    map = load_map("straight")
    start, behind = map.on_lane(1, -1, 500.0), map.on_lane(1, -1, 400.0)
    assert shortest_route(map, start, behind) is None
    assert shortest_route(map, start, map.on_lane(1, 2, 800.0)) is None
