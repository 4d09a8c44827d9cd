"""Places in words: the road, the lane, the junction and the kind of road of a point."""

import numpy as np
import pytest

from skidpad.core.environment.localities import Locality, RoadKind, kind_of_limit
from skidpad.core.geometry import mps_from_kmh
from skidpad.roads.bundled import load_map
from skidpad.roads.localities import Localities


@pytest.mark.parametrize(
    ("map", "point", "words", "kind"),
    [
        ("town", (121.0, 4.0), "road 2, 61 m from junction 9003", RoadKind.STREET),
        ("town", (0.0, 0.0), "in junction 9000", RoadKind.JUNCTION),
        (
            "figure8",
            (320.0, -220.0),
            "road 10, lane 2 of 4 from the right, 261 m from junction 9000",
            RoadKind.ROAD,
        ),
        ("motorway", (200.0, 0.0), "road 3, left lane of 2, 30 m from junction 9000", RoadKind.MOTORWAY),
    ],
)  # fmt: skip
def test_a_point_is_described_by_road_lane_and_junction(map, point, words, kind):
    found = Localities(load_map(map)).find(*point)
    assert (found.describe(), found.kind) == (words, kind)


def is_crossed(road_map, point):
    """Whether a road of another height lies above or below."""
    s = road_map.samples
    near = np.hypot(s.x - point.x, s.y - point.y) < 5.0
    return bool(np.any(np.abs(s.z[near] - point.z) > 2.0))


@pytest.mark.parametrize("map", ["town", "figure8", "motorway"])
def test_every_place_is_that_of_the_nearest_lane_by_the_map_itself(map):
    """Road, lane number and limit agree with the map's own projection of lane middles."""
    road_map = load_map(map)
    places = Localities(road_map)
    for lane in range(0, len(road_map.lanes.road), 7):
        if not road_map.arrays.drivable[lane]:
            continue
        point = road_map.at(lane, float(road_map.lanes.length[lane]) / 2.0)
        near = road_map.project(point.x, point.y, point.z)
        found = places.find(near.x, near.y)
        if is_crossed(road_map, near):
            continue  # seen from above, a bridge and what lies below it are one
        if road_map.lanes.junction[near.lane] >= 0:
            assert found.kind is RoadKind.JUNCTION
            continue
        assert found.road == near.road
        if found.kind is not RoadKind.JUNCTION:
            assert found.kind is kind_of_limit(road_map.limit(near))
        rightmost, steps = near, 0
        while (beside := road_map.right(rightmost)) is not None:
            rightmost, steps = beside, steps + 1
        assert found.lane == steps + 1


def test_a_point_away_from_every_road_has_no_place():
    assert Localities(load_map("town")).find(400.0, 400.0) is None


@pytest.mark.parametrize(
    ("limit", "kind"),
    [(50.0, RoadKind.STREET), (60.0, RoadKind.STREET), (61.0, RoadKind.ROAD),
     (100.0, RoadKind.ROAD), (101.0, RoadKind.MOTORWAY), (None, RoadKind.UNLIMITED)],
)  # fmt: skip
def test_the_limit_says_what_kind_of_road_it_is(limit, kind):
    assert kind_of_limit(None if limit is None else mps_from_kmh(limit)) is kind


def test_a_map_without_junctions_names_none():
    place = Locality(road=1, lane=1, lanes=2, kind=RoadKind.ROAD, junction=None, distance=None)
    assert place.describe() == "road 1, right lane of 2"
