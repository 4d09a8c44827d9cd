"""Gates of decision M-13 on figure8: our images and radar against an independent ray tracer."""

import numpy as np
import pytest

from skidpad.core.vocabulary import Bodywork, Scenery
from skidpad.core.weather import Weather
from skidpad.roads.bundled import load_map
from skidpad.scenery.dressing import dress_map
from skidpad.sensors.bench import convoy
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.raster.rasteriser import AUTO_LEVEL
from skidpad.sensors.raster.view import camera_view
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.raytracer import pixel_directions, trace

PLACES = (0.0, 700.0, 1500.0, 2400.0)  # m after the start
CAMERAS = ("depth_roof", "depth_bumper")
FULL = 0


def compare(suite, id):
    """Share of pixels of equal class and instance, and the p99.9 of relative depth error."""
    view = camera_view(suite.cameras[id], suite._ego)
    suite.render(id)
    one = suite._pass_of[id]
    depth, key = trace(suite, view, pixel_directions(view))
    same = (one.key.ravel() >> 8) == (key >> 8)
    inverse = 1.0 / depth
    both = same & (inverse > 0)
    error = np.abs(one.inverse.ravel()[both] / inverse[both] - 1.0)
    return same.mean(), np.quantile(error, 0.999)


@pytest.fixture(scope="module")
def figure8():
    return load_map("figure8")


def eyes(map, place, level, move=None, bodywork=Bodywork.PLAIN):
    table, states = convoy(map, place)
    if move:
        move(states)
    settings = PixelSettings(seed=7, level=level, bodywork=bodywork)
    suite = PixelSuite(map, table, twelve_sensors(), Weather(), settings)
    return suite, suite.observe(0, states, {}), states


@pytest.mark.req("A-020", "A-021", "A-022", "A-023")
@pytest.mark.parametrize("place", PLACES)
def test_full_detail_equals_the_ray_tracer(figure8, place):
    suite, _, _ = eyes(figure8, place, FULL)
    for id in CAMERAS:
        same, error = compare(suite, id)
        assert same >= 0.9999, id
        assert error <= 1e-5, id


@pytest.mark.parametrize("place", PLACES)
def test_levels_of_detail_stay_within_the_gate(figure8, place):
    suite, _, _ = eyes(figure8, place, AUTO_LEVEL)
    for id in CAMERAS:
        same, error = compare(suite, id)
        assert same >= 0.9998, id
        assert error <= 1e-3, id


@pytest.mark.parametrize("name", ["town", "figure8"])
def test_scenery_and_shaped_bodies_equal_the_ray_tracer(name):
    dressed = dress_map(load_map(name), Scenery.FULL)
    suite, _, _ = eyes(dressed, 100.0, FULL, bodywork=Bodywork.SHAPED)
    for id in CAMERAS:
        same, error = compare(suite, id)
        assert same >= 0.9999, id
        assert error <= 1e-5, id


def test_a_camera_inside_another_vehicle_sees_its_inside(figure8):
    def overlap(states):
        for name in ("x", "y", "z", "yaw"):
            getattr(states, name)[3] = getattr(states, name)[0]
        states.x[3] += 2.0 * np.cos(states.yaw[0])
        states.y[3] += 2.0 * np.sin(states.yaw[0])

    suite, seen, _ = eyes(figure8, 100.0, FULL, overlap)
    assert (seen.images["semantic_bumper"].labels == 14).mean() > 0.5
    for id in CAMERAS:
        same, error = compare(suite, id)
        assert same >= 0.9999, id
        assert error <= 1e-5, id


@pytest.mark.req("A-028")
@pytest.mark.parametrize("inside", [False, True])
def test_the_radar_hits_what_the_ray_tracer_hits(figure8, inside):
    def overlap(states):
        if inside:
            for name in ("x", "y", "z", "yaw"):
                getattr(states, name)[3] = getattr(states, name)[0]

    excluded = total = 0
    for place in PLACES:
        suite, _, states = eyes(figure8, place, AUTO_LEVEL, overlap)
        radar = suite.radars[0]
        for tick in range(5):
            suite.observe(tick, states, {})
            view, rays, hits = radar.view(suite._ego), radar._rays, radar._hits
            u = (rays.column - view.cx) / view.focal
            v = (rays.row - view.cy) / view.focal
            directions = np.stack([u, v, np.ones_like(u)], axis=1)
            around = np.concatenate([directions, *(directions + d for d in silhouette_offsets())])
            depth, keys = (a.reshape(5, -1) for a in trace(suite, view, around))
            depth, key = depth[0], keys[0]
            ours = hits.inverse > 0
            reach = radar.range / np.sqrt(u * u + v * v + 1.0)
            near = np.minimum(depth, np.where(ours, 1.0 / np.maximum(hits.inverse, 1e-9), np.inf))
            counted = near < reach
            edge = (keys >> 8 != key >> 8).any(axis=0)
            excluded += int((edge & counted).sum())
            check = counted & ~edge
            total += int(check.sum())
            assert np.array_equal(ours[check], np.isfinite(depth[check]))
            assert np.array_equal(hits.key[check] >> 8, key[check] >> 8)
            assert np.allclose(1.0 / hits.inverse[check], depth[check], rtol=1e-4)
    assert total > 500
    assert excluded < 0.01 * total


def silhouette_offsets():
    e = 1e-5
    return np.array([(e, 0, 0), (-e, 0, 0), (0, e, 0), (0, -e, 0)])
