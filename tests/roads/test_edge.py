"""Where the road ends, against places measured by hand and against shapely."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from skidpad.roads.edge import AXLE, TRACK
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.queries import RoadMap
from support.examples import examples
from support.stadium import RADIUS, STRAIGHT, WIDTH, stadium

LENGTH, BREADTH = 4.5, 1.8  # m, of a car


def town(beside: str = "none") -> RoadMap:
    return RoadMap(bake(stadium(beside).encode(), "elsewhere"))


TOWN = town()


def beyond(map: RoadMap, x: float, y: float, z: float = 0.0) -> float:
    return float(map.edge.beyond(np.array([x]), np.array([y]), np.array([z]))[0])


@pytest.mark.req("R-6")
@pytest.mark.parametrize(
    ("kind", "is_road"),
    [
        *((k, True) for k in ("driving", "bidirectional", "onRamp", "exit", "connectingRamp")),
        *((k, True) for k in ("shoulder", "stop", "parking", "biking")),
        *((k, False) for k in ("sidewalk", "border", "curb", "median", "none", "restricted")),
    ],
)
def test_lanes_to_drive_or_stand_on_are_road_and_pavements_are_not(
    kind: str, is_road: bool
) -> None:
    map = town(kind)
    middle_of_it = -(WIDTH + 1.0)
    assert (beyond(map, 150.0, middle_of_it) == 0.0) is is_road
    edge = WIDTH + (2.0 if is_road else 0.0)
    assert beyond(map, 150.0, -edge - 1.5) == pytest.approx(1.5, abs=1e-6)


def test_distances_beside_the_bend_are_those_to_its_circle() -> None:
    angle = np.linspace(-1.4, 1.4, 41)
    for radius, expected in ((50.0, 50.0 - RADIUS - WIDTH), (30.0, RADIUS - WIDTH - 30.0)):
        x, y = STRAIGHT + radius * np.cos(angle), RADIUS + radius * np.sin(angle)
        found = TOWN.edge.beyond(x, y, np.zeros_like(x))
        assert found == pytest.approx(np.full(41, expected), abs=0.02)


def test_far_away_above_and_nowhere_there_is_no_road() -> None:
    assert beyond(TOWN, 150.0, -20.0) == np.inf
    assert beyond(TOWN, 150.0, 0.0, 3.9) == 0.0
    assert beyond(TOWN, 150.0, 0.0, 4.1) == np.inf
    assert beyond(TOWN, np.nan, 0.0) == np.inf


@settings(max_examples=examples(60))
@given(
    st.floats(-70.0, STRAIGHT + 70.0), st.floats(-30.0, 2.0 * RADIUS + 30.0), st.floats(-3.2, 3.2)
)
def test_a_car_has_left_when_shapely_finds_no_wheel_on_the_road(
    x: float, y: float, yaw: float
) -> None:
    track = shapely.LineString([(0.0, RADIUS), (STRAIGHT, RADIUS)]).buffer(RADIUS, quad_segs=200)
    road = track.exterior.buffer(WIDTH)
    c, s = np.cos(yaw), np.sin(yaw)
    wheels = [
        shapely.Point(x + a * LENGTH * c - b * BREADTH * s, y + a * LENGTH * s + b * BREADTH * c)
        for a in (AXLE, -AXLE)
        for b in (TRACK, -TRACK)
    ]
    nearest = min(road.distance(w) for w in [*wheels, shapely.Point(x, y)])
    if 0.0 < nearest < 0.05:
        return  # samples are chords of the bend
    one = (np.array([v]) for v in (x, y, 0.0, yaw))
    assert bool(TOWN.edge.off(*one, LENGTH, BREADTH)[0]) is (nearest > 0.0)
