"""The bundled maps are what the specification asks for (decision M-6, G-9)."""

from __future__ import annotations

from math import cos, hypot, pi, sin
from xml.etree import ElementTree

import numpy as np
import pytest

from mapmaker.__main__ import MAPS
from skidpad.core.geometry import footprint, wrap_angle
from skidpad.roads.bundled import FOLDER, bake_file, load_map
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.roads.routing import shortest_route


def start(map: RoadMap) -> LanePoint:
    assert map.ego_start is not None
    return map.place(map.ego_start)


@pytest.mark.parametrize("name", sorted(MAPS))
def test_generator_and_importer_rebuild_what_is_shipped(name: str) -> None:
    path = FOLDER / f"{name}.xodr"
    assert MAPS[name]().text() == path.read_bytes()
    assert bake_file(path).content_hash() == load_map(name).content_hash


@pytest.mark.req("A-003", "A-004")
def test_the_loop_closes_after_about_three_kilometres(figure8: RoadMap) -> None:
    place = start(figure8)
    assert place.lane_id == -2
    travelled = 0.0
    while travelled == 0.0 or place.lane != start(figure8).lane:
        rest = float(figure8.lanes.length[place.lane]) - place.s + 1e-6
        following = figure8.ahead(place, rest)
        assert following is not None
        assert hypot(following.x - place.x, following.y - place.y) < rest + 1e-3
        travelled, place = travelled + rest, following
    assert travelled == pytest.approx(3000.0, abs=150.0)


def test_every_driving_lane_goes_on_and_comes_from_somewhere(figure8: RoadMap) -> None:
    for lane in np.flatnonzero(figure8.arrays.drivable):
        assert figure8.successors(lane)
        assert figure8.predecessors(lane)


@pytest.mark.req("A-202", "A-204")
def test_traffic_of_the_fixed_mode_finds_its_places(figure8: RoadMap) -> None:
    ego = start(figure8)
    for distance in (60.0, 300.0, 460.0, 580.0, 900.0):
        ahead = figure8.ahead(ego, distance)
        assert ahead is not None
        assert figure8.shifted(ahead, 1) is not None
        assert figure8.shifted(ahead, -1) is not None
    behind = figure8.behind(ego, 400.0)
    assert behind is not None
    assert figure8.shifted(behind, 2) is None


def test_lights_stand_where_the_decision_wants_them(figure8: RoadMap) -> None:
    ego = start(figure8)
    first = figure8.signal_ahead(ego, 3000.0)
    assert first is not None
    line = figure8.ahead(ego, first.distance)
    bend = figure8.ahead(ego, first.distance + 150.0)
    assert line is not None
    assert bend is not None
    assert 85.0 <= 1.0 / bend.curvature <= 90.0
    assert figure8.limit(line) == pytest.approx(60.0 / 3.6)
    second = figure8.signal_ahead(line, 3000.0 - 1.0 - first.distance)
    assert second is not None
    assert figure8.signal_ahead(figure8.at(line.lane, line.s + 0.1), 1000.0) is None
    assert set(figure8.signals.id[figure8.signals.kind == SignalKind.LIGHT]) == {1001, 1002}


def test_bends_grades_and_limits_keep_to_the_decision(figure8: RoadMap) -> None:
    driving = figure8.arrays.drivable[figure8.samples.lane] == 1
    main = driving & (figure8.samples.width == 3.5)
    assert main.sum() == driving.sum()
    assert 1.0 / np.abs(figure8.samples.curvature[driving]).max() >= 70.0
    assert np.abs(figure8.samples.grade).max() == pytest.approx(0.06, abs=1e-4)
    tight = driving & (np.abs(figure8.samples.curvature) > 1.0 / 100.0)
    assert np.unique(np.round(figure8.samples.limit[tight] * 3.6)) == [60.0]


@pytest.mark.req("A-142")
def test_heading_and_curvature_have_no_jumps_on_the_main_lanes(figure8: RoadMap) -> None:
    for lane_id in (-1, -4):
        place: LanePoint | None = figure8.on_lane(1, lane_id, 1.0)
        for _ in range(3050):
            assert place is not None
            following = figure8.ahead(place, 1.0)
            assert following is not None
            turned = wrap_angle(following.heading - place.heading)
            assert turned == pytest.approx(0.5 * (place.curvature + following.curvature), abs=2e-4)
            assert abs(following.curvature - place.curvature) < 5e-4
            assert abs(following.z - place.z) < 0.061
            place = following


def test_straight_has_three_lanes_per_direction() -> None:
    map = load_map("straight")
    driving = np.flatnonzero(map.arrays.drivable)
    assert len(driving) == 6
    assert np.allclose(map.lanes.length, 1500.0)
    east, west = map.project(700.0, -5.0, 0.0), map.project(700.0, 5.0, 0.0)
    assert east is not None
    assert west is not None
    assert east.heading == pytest.approx(0.0)
    assert abs(west.heading) == pytest.approx(pi)
    assert map.ahead(east, 900.0) is None


@pytest.fixture(scope="module", params=sorted(MAPS))
def map(request: pytest.FixtureRequest) -> RoadMap:
    return load_map(request.param)


def test_every_lane_begins_where_its_predecessors_end(map: RoadMap) -> None:
    for lane in range(len(map.lanes.road)):
        end = map.at(lane, float(map.lanes.length[lane]))
        for following in map.successors(lane):
            begin = map.at(following, 0.0)
            assert hypot(begin.x - end.x, begin.y - end.y, begin.z - end.z) < 1e-3
            assert abs(wrap_angle(begin.heading - end.heading)) < 1e-4
            assert begin.width == pytest.approx(end.width)


def test_nothing_solid_stands_on_a_lane(map: RoadMap) -> None:
    points = [tuple(p) for barrier in map.roadside.barriers for p in barrier.points.tolist()]
    for box in map.roadside.boxes:
        if box.z < 5.0 or abs(box.z - 9.6) < 1.0:  # not the beams above the road
            corners = footprint(box.x, box.y, box.yaw, box.length, box.width)
            points += [(x, y, box.z) for x, y in corners.tolist()]
    assert points
    for x, y, z in points:
        place = map.project(x, y, z)
        if place is not None and abs(place.z - z) < 4.0:
            along = (x - place.x) * cos(place.heading) + (y - place.y) * sin(place.heading)
            beyond_the_end = abs(along) > 0.5
            assert beyond_the_end or abs(place.offset) > 0.5 * place.width + 0.1


def test_samples_are_at_most_a_metre_apart_and_end_exactly(map: RoadMap) -> None:
    same = np.diff(map.samples.lane) == 0
    steps = np.diff(map.samples.s)[same]
    assert steps.max() <= 1.0
    assert steps.min() > 0.0
    last = map.lanes.first + map.lanes.size - 1
    assert np.array_equal(map.samples.s[last], map.lanes.length)
    assert not map.samples.s[map.lanes.first].any()


def test_town_has_what_the_decision_lists() -> None:
    map = load_map("town")
    kinds = {k: len(set(map.signals.id[map.signals.kind == k].tolist())) for k in SignalKind}
    assert kinds[SignalKind.LIGHT] == 4
    assert kinds[SignalKind.STOP] == 4
    assert kinds[SignalKind.YIELD] == 3
    groups = map.signals.group[map.signals.kind == SignalKind.LIGHT]
    assert sorted(groups.tolist()) == [5001, 5001, 5002, 5002]
    assert len(map.roadside.crosswalks) == 4
    assert len(map.roadside.parking) == 20
    assert len(np.unique(map.lanes.junction[map.lanes.junction >= 0])) == 5 + 4 + 2
    ring = [i for i in range(len(map.lanes.road)) if map.lanes.road[i] in (20, 201, 22, 203, 24)]
    lengths = [map.lanes.length[i] for i in ring if map.lanes.lane_id[i] == -1]
    assert sum(lengths) == pytest.approx(2000.0, abs=60.0)
    assert {round(3.6 * float(map.limit(map.at(i, 1.0)) or 0.0)) for i in ring[:2]} == {80}


def test_in_town_every_street_can_be_reached_from_every_other() -> None:
    map = load_map("town")
    driving = np.flatnonzero(map.arrays.drivable).tolist()
    streets = [i for i in driving if map.lanes.junction[i] < 0]
    hub = map.at(streets[0], 5.0)
    for lane in streets[::3]:
        there = map.at(lane, 1.0)
        out, back = shortest_route(map, hub, there), shortest_route(map, there, hub)
        assert out is not None
        assert back is not None
        assert out.lanes[-1] == lane
        assert back.lanes[-1] == hub.lane


def test_at_the_signalled_crossing_the_line_comes_before_zebra_and_light() -> None:
    map = load_map("town")
    for row in np.flatnonzero(map.signals.kind == SignalKind.LIGHT).tolist():
        lane, s = int(map.signals.lane[row]), float(map.signals.s[row])
        line = map.at(lane, s)
        zebra = min(
            np.hypot(*(walk[:, :2].mean(axis=0) - (line.x, line.y)))
            for walk in map.roadside.crosswalks
        )
        to_head = (map.signals.x[row] - line.x) * cos(line.heading) + (
            map.signals.y[row] - line.y
        ) * sin(line.heading)
        assert 2.0 < zebra < to_head < float(map.lanes.length[lane]) - s
        assert abs(wrap_angle(map.signals.heading[row] - line.heading)) < 1e-6


def test_in_the_roundabout_traffic_turns_left() -> None:
    map = load_map("town")
    for lane in np.flatnonzero(map.arrays.drivable).tolist():
        if map.lanes.junction[lane] < 0 and map.lanes.length[lane] < 20.0:
            place = map.at(lane, 1.0)
            assert place.curvature == pytest.approx(1.0 / 18.0, rel=1e-3)


@pytest.mark.parametrize("name", MAPS)
def test_records_of_every_road_begin_where_it_begins(name: str) -> None:
    """A first record at 0.3 um ended CARLA's client."""
    for road in ElementTree.parse(FOLDER / f"{name}.xodr").getroot().iter("road"):
        for path in ("planView/geometry", "lanes/laneSection", "elevationProfile/elevation",
                     "lateralProfile/superelevation"):  # fmt: skip
            first = road.find(path)
            assert first is None or float(first.attrib["s"]) == 0.0, (road.attrib["id"], path)
