"""Decoding, pacing and keeping a server: what needs no client."""

from __future__ import annotations

import socket
import sys
from pathlib import Path

import numpy as np
import pytest

from skidpad.campaign.driving.backends import carla_options
from skidpad.campaign.driving.starts import start_of
from skidpad.core.errors import BackendError, ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.specs import CameraSpec, Modality
from skidpad.core.weather import Weather
from skidpad.roads.bundled import load_map
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.simulation.carla import decode
from skidpad.simulation.carla.connection import connect, release
from skidpad.simulation.carla.events import closing, marking_name
from skidpad.simulation.carla.keeper import ServerKeeper
from skidpad.simulation.carla.options import CarlaOptions, Optimisation
from skidpad.simulation.carla.scene import same_roads
from skidpad.simulation.carla.sensors import describe_sensor, display_cameras
from skidpad.simulation.carla.weather import weather_parameters


@pytest.mark.req("X-4", "A-028")
def test_radar_points_change_hands_but_not_their_velocity() -> None:
    raw = np.array([[-5.0, 0.2, 0.1, 40.0], [3.0, -0.1, 0.0, 120.0]], dtype="<f4")
    points = decode.radar_points(raw.tobytes())
    assert points.azimuth == pytest.approx([-0.2, 0.1])  # CARLA's right is our negative
    assert points.altitude == pytest.approx([0.1, 0.0])
    assert points.velocity == pytest.approx([-5.0, 3.0])
    assert decode.radar_points(raw.tobytes(), 100.0).range == pytest.approx([40.0])
    assert len(decode.radar_points(b"").range) == 0


def test_colours_and_instances_keep_their_order() -> None:
    bgra = np.array([[[30, 20, 10, 255], [1, 2, 7, 255]]], dtype=np.uint8)
    packed = np.zeros((1, 2), dtype=np.uint32)
    decode.packed_rgb(bgra, packed)
    assert packed.view(np.uint8).reshape(1, 2, 4)[0, 0, :3].tolist() == [10, 20, 30]
    rows = np.zeros(65536, dtype=np.uint16)
    rows[258] = 4
    out = np.zeros((1, 2), dtype=np.uint16)
    decode.instance_rows(bgra, rows, out)
    assert out.tolist() == [[0, 4]]


@pytest.mark.req("M-1")
def test_weather_hides_what_lies_beyond_its_sight_along_the_ray() -> None:
    camera = CameraSpec("c", Modality.DEPTH, 4, 2, 90.0, Pose(0.0, 0.0))
    inverse = np.full((2, 4), 1.0 / 50.0, dtype=np.float32)
    labels = np.full((2, 4), 14, dtype=np.uint8)
    stretch = np.hypot(np.hypot(1.5 / 2.0, 0.5 / 2.0), 1.0)  # of the corner pixel's ray
    decode.limit_sight(camera, 50.0 * stretch - 0.01, inverse, labels)
    assert labels[0].tolist() == [decode.SKY, 14, 14, decode.SKY]
    decode.limit_sight(camera, 50.0, inverse)
    assert (inverse == 0.0).all()


@pytest.mark.req("A-018", "A-019", "A-024", "A-028")
def test_twelve_sensors_are_described_with_carlas_attributes() -> None:
    specs = twelve_sensors()
    told = [describe_sensor(s)[::2] for s in specs if not hasattr(s, "kind")]
    assert told[0] == (
        "sensor.camera.rgb",
        {"image_size_x": "800", "image_size_y": "600", "fov": "90", "sensor_tick": "0.0",
         "iso": "1200", "gamma": "2.2", "exposure_mode": "histogram"},
    )  # fmt: skip
    assert [t[0] for t in told].count("sensor.camera.depth") == 2
    assert told[-1][1]["points_per_second"] == "1500"
    assert display_cameras(specs) == {"rgb_rear", "rgb_mirror_left", "rgb_mirror_right", "rgb_top"}


def test_weather_goes_over_field_by_field() -> None:
    told = weather_parameters(Weather(precipitation=60.0, sun_altitude_deg=-20.0, wetness=80.0))
    assert told["precipitation"] == 60.0
    assert told["sun_altitude_angle"] == -20.0
    assert told["wetness"] == 80.0
    assert len(told) == 13


@pytest.mark.req("A-268")
def test_each_optimisation_has_its_switch() -> None:
    for one in Optimisation:
        options = carla_options(BackendChoice(backend=BackendKind.CARLA, without=(one.value,)))
        assert not options.uses(one)
        assert len(options.optimisations) == len(Optimisation) - 1
    with pytest.raises(ConfigError, match="choose one of: feed-pool"):
        carla_options(BackendChoice(backend=BackendKind.CARLA, without=("magic",)))


def test_versions_and_maps_are_compared_by_what_matters() -> None:
    assert release("0.9.16-14-gab12") == "0.9.16" == release("0.9.16")
    assert same_roads("<a>\r\n  <b/></a>\n", "<a>\n<b/></a>")
    assert not same_roads("<a/>", "<b/>")


def test_nobody_there_is_one_sentence() -> None:
    pytest.importorskip("carla")
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with pytest.raises(BackendError, match=f"no CARLA server answers at 127.0.0.1:{port}"):
        connect(CarlaOptions(port=port))


@pytest.mark.parametrize(
    ("said", "name"),
    [("Broken", "broken"), ("SolidSolid", "solid_solid"), ("Curb", "curb"), ("Other", "other")],
)
def test_markings_are_named_as_in_our_maps(said: str, name: str) -> None:
    assert marking_name(f"LaneMarkingType.{said}") == name


def test_closing_speed_is_taken_along_the_impulse() -> None:
    vx, vy = np.array([20.0, 5.0]), np.array([0.0, 3.0])
    assert closing(vx, vy, 1, (-100.0, 0.0, 0.0)) == pytest.approx(15.0)
    assert closing(vx, vy, -1, (0.0, 7.0, 0.0)) == 0.0
    assert closing(vx, vy, 1, (0.0, 0.0, 0.0)) == pytest.approx(np.hypot(15.0, 3.0))


SERVER = """
import socket, sys, time
s = socket.socket(); s.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
s.bind(("127.0.0.1", int(sys.argv[1]))); s.listen()
while True: s.accept()
"""


def test_a_kept_server_is_started_again_when_old_or_dead() -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    keeper = ServerKeeper((sys.executable, "-c", SERVER, str(port)), "127.0.0.1", port, every=2)
    try:
        for _ in range(5):
            keeper.before_run()
        assert keeper.starts == 3
        assert keeper._process is not None
        keeper._process.kill()
        keeper._process.wait()
        keeper.before_run()
        assert keeper.starts == 4
    finally:
        keeper.stop()
    with pytest.raises(BackendError, match="never answered"):
        ServerKeeper((sys.executable, "-c", ""), "127.0.0.1", port, every=0).before_run()
    with pytest.raises(BackendError, match="cannot be started"):
        ServerKeeper(("/no/such/server",), "127.0.0.1", port, every=0).before_run()


@pytest.mark.req("A-004")
def test_the_ego_starts_where_it_was_published(towns: Path) -> None:
    map = load_map(towns / "Town04.xodr")
    place = map.place(start_of(map))
    nearest = map.project(310.0, -5.0, 0.0)
    assert nearest is not None
    moved = map.shifted(nearest, 2)
    assert moved is not None
    assert (place.road, place.lane_id) == (moved.road, moved.lane_id)
    assert (place.x, place.y) == pytest.approx((moved.x, moved.y), abs=0.05)
