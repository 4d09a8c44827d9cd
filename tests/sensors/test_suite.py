"""The pixel suite on scenes whose images can be worked out by hand."""

import numpy as np
import pytest

from skidpad.core.errors import BackendError
from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality, RadarSpec
from skidpad.core.vocabulary import ActorKind, SemanticClass
from skidpad.core.weather import Weather
from skidpad.roads.roadside import Box
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.sensors.suite import PixelSettings, PixelSuite
from support.sensors.worlds import states_at, straight, table_of, traffic

LEVEL = Pose(0.0, 0.0, 1.5)
DEPTH = CameraSpec("d", Modality.DEPTH, 160, 120, 90.0, LEVEL)
LABELS = CameraSpec("s", Modality.SEMANTIC, 160, 120, 90.0, LEVEL)
INSTANCES = CameraSpec("i", Modality.INSTANCE, 160, 120, 90.0, LEVEL)


def suite(world, table, specs=(DEPTH, LABELS, INSTANCES), **options):
    return PixelSuite(world, table, specs, Weather(), PixelSettings(**options))


@pytest.mark.req("A-020", "A-033")
def test_a_wall_is_as_far_as_it_stands_in_planar_depth():
    wall = Box(int(SemanticClass.BUILDING), 110.5, -7.0, -1.0, 0.0, 1.0, 400.0, 60.0)
    ego = states_at([(100.0, -7.0, 0.0, 0.0)])
    frame = suite(straight(300, [wall]), table_of([])).observe(0, ego, {})
    depth = frame.images["d"].depth()
    assert np.allclose(depth[:60], 10.0, rtol=1e-6)
    assert (frame.images["s"].labels[:60] == SemanticClass.BUILDING).all()


def test_the_ground_meets_the_rows_that_geometry_says():
    ego = states_at([(100.0, -8.75, 0.0, 0.0)])  # in a lane's middle
    frame = suite(straight(300, rails=False), table_of([])).observe(0, ego, {})
    depth = frame.images["d"].depth()
    rows = np.arange(64, 120)
    expected = 1.5 * DEPTH.focal / (rows + 0.5 - DEPTH.cy)
    assert np.allclose(depth[64:, 80], expected, rtol=1e-5)
    labels = frame.images["s"].labels
    assert (labels[:59] == SemanticClass.SKY).all()
    assert set(np.unique(labels[90:, 60:100])) <= {SemanticClass.ROAD, SemanticClass.ROAD_LINE}


@pytest.mark.req("A-034")
def test_a_car_has_its_class_its_instance_and_its_rear_face_depth():
    table = table_of([ActorKind.TRUCK, ActorKind.CAR])
    states = states_at([(100, -7, 0, 0), (130, -7, 0, 0), (115, -3.5, 0, 0)])
    frame = suite(straight(), table).observe(0, states, {})
    labels, instances = frame.images["s"].labels, frame.images["i"].instances
    assert set(np.unique(instances)) == {0, 2, 3}
    assert (labels[instances == 2] == SemanticClass.TRUCK).all()
    assert (labels[instances == 3] == SemanticClass.CAR).all()
    depth = frame.images["d"].depth()
    assert depth[instances == 2].min() == pytest.approx(30.0 - 9.0 / 2, abs=0.02)


@pytest.mark.req("A-018", "A-028")
def test_the_radar_measures_range_and_rate_of_a_wall_and_of_a_car():
    wall = Box(int(SemanticClass.BUILDING), 150.5, -7.0, -1.0, 0.0, 1.0, 400.0, 90.0)
    spec = RadarSpec("r", Pose(2.0, 0.0, 1.0))
    states = states_at([(100, -7, 0, 0), (120, -7, 0, 0)], [20.0, 12.0])
    radar_only = suite(straight(300, [wall], rails=False), table_of([ActorKind.BUS]), [spec])
    seen = {"wall": 0, "bus": 0}
    for tick in range(20):
        points = radar_only.observe(tick, states, {}).radar
        away = np.cos(points.azimuth) * np.cos(points.altitude)
        ahead = points.range * away
        for name, x, v in (("wall", 48.0, -20.0), ("bus", 12.0, -8.0)):
            hit = (np.abs(ahead - x) < 0.05) & (points.altitude > -0.02)
            seen[name] += int(hit.sum())
            assert np.allclose(points.velocity[hit], v * away[hit], atol=2e-3)
    assert min(seen.values()) > 50


def points_of(wall_x, ticks=20):
    """Returns of the published radar of a car at x 100 before a wall, on an empty road."""
    (radar,) = (s for s in twelve_sensors() if isinstance(s, RadarSpec))
    wall = Box(int(SemanticClass.BUILDING), wall_x + 0.5, -7.0, -1.0, 0.0, 1.0, 400.0, 90.0)
    eyes = suite(straight(400, [wall], rails=False), table_of([]), [radar])
    frames = [eyes.observe(k, states_at([(100, -7, 0, 0)]), {}).radar for k in range(ticks)]
    return [np.concatenate(column) for column in zip(*frames, strict=True)]


@pytest.mark.req("A-028")
def test_the_radar_stands_where_it_is_published_and_sees_30_degrees_each_way():
    away, azimuth, altitude, _ = points_of(130.0)
    on_wall = away * np.cos(azimuth) * np.cos(altitude) > 27.9
    assert away[on_wall] * (np.cos(azimuth) * np.cos(altitude))[on_wall] == pytest.approx(
        28.0, abs=0.01
    )  # 2 m ahead of the car's middle
    road = away * np.sin(altitude)
    assert road[~on_wall].min() == pytest.approx(-1.0, abs=0.01)  # 1 m above the road
    for angle in (azimuth, altitude[on_wall]):
        assert 14.5 < np.degrees(np.abs(angle)).max() <= 15.001


@pytest.mark.req("A-028")
@pytest.mark.parametrize(("wall_x", "is_seen"), [(251.0, True), (252.5, False)])
def test_the_radar_reaches_150_m(wall_x, is_seen):
    away, azimuth, altitude, _ = points_of(wall_x, ticks=60)
    far = away * np.cos(azimuth) * np.cos(altitude) > wall_x - 102.5
    assert far.any() == is_seen
    assert away.max() <= 150.0


def test_standing_clutter_closes_at_the_antennas_own_speed_while_turning():
    spec = RadarSpec("r", Pose(2.0, 0.0, 1.0))
    states = states_at([(100, -7, 0, 0)], [10.0])
    states.yaw_rate[0] = 0.5
    points = suite(straight(300), table_of([]), [spec]).observe(0, states, {}).radar
    direction = np.stack(
        [
            np.cos(points.azimuth) * np.cos(points.altitude),
            np.sin(points.azimuth) * np.cos(points.altitude),
        ]
    )
    expected = -(10.0 * direction[0] + 0.5 * 2.0 * direction[1])
    assert len(points.range) > 20
    assert np.allclose(points.velocity, expected, atol=1e-4)


@pytest.mark.req("A-257")
def test_images_read_too_late_are_refused():
    table, states = traffic(straight())
    eyes = suite(straight(), table)
    old = eyes.observe(0, states, {})
    eyes.observe(1, states, {})
    with pytest.raises(BackendError, match="valid until the next step"):
        _ = old.images["d"]


def test_rendering_needed_images_only_changes_no_value_that_is_read():
    table, states = traffic(straight())
    specs = twelve_sensors()
    lazy = PixelSuite(straight(), table, specs, Weather(), PixelSettings(seed=5, poison_old=True))
    eager = PixelSuite(straight(), table, specs, Weather(), PixelSettings(seed=5, render_all=True))
    for tick in range(3):
        states.x[:] += 1.0
        a, b = lazy.observe(tick, states, {}), eager.observe(tick, states, {})
        assert np.array_equal(
            a.images["depth_roof"].inverse_depth, b.images["depth_roof"].inverse_depth
        )
        assert np.array_equal(
            a.images["semantic_bumper"].labels, b.images["semantic_bumper"].labels
        )
        assert np.array_equal(a.images["rgb_top"].rgb, b.images["rgb_top"].rgb)
        assert all(np.array_equal(p, q) for p, q in zip(a.radar, b.radar, strict=True))


@pytest.mark.req("A-257")
def test_a_snapshot_is_a_copy_of_the_moments_pictures():
    world = straight()
    table, states = traffic(world)
    eyes = PixelSuite(world, table, twelve_sensors(), Weather())
    seen = eyes.observe(0, states, {})
    kept = eyes.snapshot("rgb_front", "rgb_top")
    assert {k: v.shape for k, v in kept.items()} == {
        "rgb_front": (600, 800, 3),
        "rgb_top": (160, 160, 3),
    }
    assert np.array_equal(kept["rgb_front"], seen.images["rgb_front"].rgb)
    before = kept["rgb_front"].copy()
    states.x[0] += 20.0
    eyes.observe(1, states, {})
    eyes.render("rgb_front")
    assert np.array_equal(before, kept["rgb_front"])


@pytest.mark.req("A-060")
def test_where_the_roof_pair_begins_to_see_the_ground():
    world = straight(300, rails=False)
    eyes = PixelSuite(world, table_of([]), twelve_sensors(), Weather())
    images = eyes.observe(0, states_at([(100.0, -8.75, 0.0, 0.0)]), {}).images
    nearest = images["depth_roof"].depth()[:, 400]
    assert nearest[449] == pytest.approx(6.4, abs=0.05)  # lowest row of the 25-75 % band
    assert nearest[599] == pytest.approx(3.2, abs=0.05)  # lowest row of all
