from math import cos, inf, radians, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis.strategies import floats

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.optics import label_range, radar_range
from skidpad.physics.presets import find_weather
from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside
from skidpad.sensors.object_level.objects import ObjectSuite
from skidpad.sensors.ranging.beam import beam_of
from skidpad.sensors.ranging.radar import Radar, aim
from support.examples import examples
from support.sensors.cars import BUMPER, RADAR, ROOF, world


def suite(table, roadside=None, **options):
    return ObjectSuite(
        roadside or Roadside(), table, [ROOF, BUMPER, RADAR], seed=1, dt=0.05, **options
    )


def test_a_car_ahead_is_seen_at_the_distance_of_its_rear():
    table, states = world((30.0, 0.0, 0.0, 0.0))
    seen = suite(table).segments(states)["roof"]
    assert np.all(seen.depth == pytest.approx(30.0 - 2.25 - 1.5))
    assert np.all(seen.label == SemanticClass.CAR)
    pixels = float(np.sum(seen.width * (seen.bottom - seen.top)))
    scale = ROOF.focal / 26.25
    assert pixels == pytest.approx(1.8 * 1.5 * scale * scale, rel=1e-3)
    assert np.average(seen.u, weights=seen.width) == pytest.approx(400.0)


def test_a_pitched_camera_sees_the_top_of_a_face_nearer_than_its_foot():
    table, states = world((12.0, 0.0, 0.0, 0.0))
    seen = suite(table).segments(states)["bumper"]
    x = 12.0 - 2.25 - 2.3
    middle_of_lowest_run = x * cos(radians(20)) - (1.5 / 8 - 0.4) * sin(radians(20))
    assert seen.depth.max() == pytest.approx(middle_of_lowest_run, abs=1e-4)
    assert seen.depth[np.argmin(seen.top)] < seen.depth.max()


def test_a_nearer_car_hides_the_one_behind_it_and_not_the_one_beside():
    table, states = world((20.0, 0, 0, 0), (40.0, 0, 0, 0), (40.0, 8.0, 0, 0))
    seen = suite(table).segments(states)["roof"]
    hidden = (np.abs(seen.u - 400.0) < 15) & (seen.depth > 30.0)
    visible_rows = np.sum((seen.bottom - seen.top)[hidden])
    # The camera is at 2.4 m: over the nearer roof a slice of the farther car stays in sight.
    assert visible_rows < 0.5 * 1.5 * ROOF.focal / 36.25 * np.sum(hidden)
    assert np.any((seen.u < 400 - 50) & (seen.depth > 30.0))


@given(floats(5.0, 70.0), floats(-6.0, 6.0), floats(-3.0, 3.0))
@settings(max_examples=examples(50))
def test_a_mirrored_scene_gives_mirrored_columns(x, y, yaw):
    table, states = world((x, y, 0.0, yaw))
    _, mirrored = world((x, -y, 0.0, -yaw))
    s = suite(table)
    for camera in (ROOF, BUMPER):
        a, b = s.segments(states)[camera.id], s.segments(mirrored)[camera.id]
        area = [np.sum(v.width * (v.bottom - v.top)) for v in (a, b)]
        assert area[0] == pytest.approx(area[1], rel=1e-4, abs=1e-3)
        if len(a.u):
            mean = [np.average(v.u, weights=v.width) - camera.cx for v in (a, b)]
            assert mean[0] == pytest.approx(-mean[1], abs=0.05)


def test_a_car_on_the_overpass_is_hidden_from_below():
    table, states = world((40.0, 0.0, 8.0, 1.57))
    assert suite(table).segments(states)["roof"].u.size == 0


def test_weather_limits_how_far_objects_are_seen():
    night = find_weather("rain-night")
    for beyond, seen in ((5.0, False), (-5.0, True)):
        rear = label_range(night) + beyond
        table, states = world((rear + 2.25, 0.0, 0.0, 0.0))
        assert bool(suite(table, weather=night).segments(states)["roof"].u.size) is seen
        assert suite(table).segments(states)["roof"].u.size > 0


def test_rain_shortens_the_reach_of_the_radar():
    rain = find_weather("rain-noon")
    dry, wet = suite(world()[0]).antennas[0], suite(world()[0], weather=rain).antennas[0]
    assert dry.reach == RADAR.range
    assert wet.reach == radar_range(rain, RADAR.range) < dry.reach


@pytest.mark.req("M-3")
def test_both_levels_send_the_same_rays():
    """A wall of a vehicle across the whole field returns every ray."""
    pixel = Radar(RADAR, beam_of(RADAR, 1, 0.05), inf)
    view = pixel.view(Pose(0.0, 0.0))
    aim(pixel.beam, 7, view, pixel._rays)
    right = (pixel._rays.column - view.cx) / view.focal
    down = (pixel._rays.row - view.cy) / view.focal
    table, states = world((30.0, 0.0, 0.0, 0.0))
    table.length[1], table.width[1], table.height[1] = 1.0, 100.0, 60.0
    states.z[1] = -30.0
    points = suite(table).radar(7, states)
    assert points.azimuth == pytest.approx(np.arctan2(-right, 1.0), abs=1e-6)
    assert points.altitude == pytest.approx(np.arctan2(-down, np.hypot(1.0, right)), abs=1e-6)


def test_a_camera_inside_another_car_sees_its_walls():
    table, states = world((2.0, 0.0, 0.0, 0.0))
    assert suite(table).segments(states)["bumper"].depth.min() < 2.5


@pytest.mark.req("A-028")
def test_radar_range_rate_is_the_true_closing_speed():
    table, states = world((12.0, 0.0, 0.0, 0.0))
    states.vx[:] = 20.0, 8.0
    points = suite(table).radar(3, states)
    on_car = np.abs(points.range * np.cos(points.altitude) * np.cos(points.azimuth) - 7.75) < 0.01
    assert on_car.any()
    expected = -12.0 * np.cos(points.altitude[on_car]) * np.cos(points.azimuth[on_car])
    assert points.velocity[on_car] == pytest.approx(expected, rel=1e-5)


def test_radar_sees_road_guardrail_and_post_as_standing():
    rail = Barrier(BarrierKind.GUARDRAIL, np.array([[0.0, 3, 0], [100, 3, 0]]), 3.0)
    post = Box(SemanticClass.POLE, 40.0, -2.0, 0.0, 0.0, 0.5, 4.0, 6.0)
    table, states = world((300.0, 0.0, 0.0, 0.0))
    states.vx[0] = 10.0
    points = suite(table, Roadside(barriers=(rail,), boxes=(post,))).radar(0, states)
    doppler = -10.0 * np.cos(points.altitude) * np.cos(points.azimuth)
    assert points.velocity == pytest.approx(doppler, rel=1e-5)
    left = points.range * np.sin(points.azimuth) * np.cos(points.altitude)
    assert np.any(np.isclose(left, 3.0, atol=1e-3))
    road = points.range * np.sin(points.altitude)
    assert road.min() == pytest.approx(-1.0, abs=1e-4)


def test_radar_rays_change_every_tick_and_repeat_with_the_seed():
    table, states = world((30.0, 0.0, 0.0, 0.0))
    first, again, later = (suite(table).radar(k, states) for k in (5, 5, 6))
    assert np.array_equal(first.azimuth, again.azimuth)
    assert not np.array_equal(first.azimuth[:5], later.azimuth[:5])


def test_a_nose_that_dives_brings_the_road_nearer():
    table, states = world((300.0, 0.0, 0.0, 0.0))
    level = suite(table).radar(2, states)
    states.pitch[0] = 0.05
    dived = suite(table).radar(2, states)
    for points, pitch in ((level, 0.0), (dived, 0.05)):
        antenna = 1.0 - 2.0 * np.sin(pitch)
        down = np.sin(pitch - points.altitude) * 1.0
        near = np.abs(points.azimuth) < 0.02
        assert points.range[near] * down[near] == pytest.approx(antenna, rel=0.02)
    beyond = -0.05
    assert not np.any(level.range[level.altitude > beyond] < 20.0)
    assert np.any(dived.range[dived.altitude > beyond] < 20.0)
