"""The bundled maps are what the specification asks for (decision M-6, G-9)."""

from __future__ import annotations

from math import hypot, pi

import numpy as np
import pytest

from skidpad.core.geometry import wrap_angle
from skidpad.roads.bundled import FOLDER, bake_file, load_map
from skidpad.roads.generate.__main__ import MAPS
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import LanePoint, RoadMap


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
