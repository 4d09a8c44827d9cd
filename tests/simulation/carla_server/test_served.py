"""What clients read back of a served simulation, without a client."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest
from shapely.errors import GEOSException

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.actors.registry import Actor, Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.maps import maps
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.snapshot import HEADER
from skidpad.simulation.carla_server.vehicles.control import Control
from support.carla_streams import Kept

CAR = "vehicle.tesla.model3"


def sensor_on_car(served: Served, kind: str, **attributes: str) -> Actor:
    episode = served.episode
    car = episode.spawn(Wanted(CAR, {}), episode.map.spawn_points[0])
    wanted = Wanted(kind, attributes)
    return episode.attach(wanted, Pose(0.5, 0.0, 1.5), car.id, Attachment.RIGID)


def test_a_period_begins_with_the_sensors_first_reading() -> None:
    hub = Kept()
    served = Served(ServerOptions(), hub)
    for _ in range(3):
        served.tick()
    sensor = sensor_on_car(served, "sensor.other.gnss", sensor_tick="0.2")
    for _ in range(9):
        served.tick()
    assert sensor.stream is not None
    frames = [struct.unpack_from("<QQ", m)[1] for m in hub.told[sensor.stream]]
    assert frames == [4, 8, 12]


@pytest.mark.parametrize("yaw", [180.0, -90.0, 0.0, 90.0])
def test_a_yaw_comes_back_as_it_was_asked_for(served: Served, yaw: float) -> None:
    episode = served.episode
    at = wire.transform(episode.map.spawn_points[0])
    at[1][1] = yaw
    asked = wire.pose(at, "transform")
    car = episode.spawn(Wanted(CAR, {}), asked)
    prop = episode.spawn(Wanted("static.prop.streetbarrier", {}), asked.moved(left=30.0))
    episode.fill_rows(0.05)
    for actor in (car, prop):
        assert episode.rows.vehicles["pose"][actor.row][4] == pytest.approx(yaw, abs=1e-4)


def test_a_control_that_is_not_sticky_acts_for_one_tick(served: Served) -> None:
    episode = served.episode
    speeds = []
    for sticky, place in zip(("true", "false"), episode.map.spawn_points[::8], strict=False):
        car = episode.spawn(Wanted(CAR, {"sticky_control": sticky}), place)
        episode.vehicles.of(car.id).control = Control(throttle=1.0)
    for _ in range(20):
        served.tick()
    speeds = [episode.moving.fleet.speed(i) for i in range(2)]
    assert speeds[0] > 1.0
    assert speeds[1] < 0.2


def test_a_recording_lasts_from_its_first_frame_to_its_last(served: Served) -> None:
    served.episode.spawn(Wanted(CAR, {}), served.episode.map.spawn_points[0])
    for _ in range(200):
        served.tick()
    served.recorder.start("part.log", served.episode.map.name)
    for _ in range(100):
        served.tick()
    served.recorder.stop()
    assert "Frames: 100\nDuration: 4.95 seconds" in served.recorder.summary("part.log")


def test_a_map_on_which_nobody_can_walk_is_served(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Trouble with the walkers' mesh costs walkers, not the server."""

    def trouble(_: object) -> None:
        raise GEOSException("Overlay input is mixed-dimension")

    monkeypatch.setattr(maps, "walk_mesh", trouble)
    monkeypatch.setattr(maps, "_NAVIGATION", {})
    served = Served(ServerOptions(), StreamHub())
    served.tick()
    assert served.episode.map.navigation is None


@pytest.mark.parametrize("text", ["", "<OpenDRIVE/>", "<OpenDRIVE><road/></OpenDRIVE>", "\x00"])
def test_a_map_that_cannot_be_served_changes_nothing(served: Served, text: str) -> None:
    car = served.episode.spawn(Wanted(CAR, {}), served.episode.map.spawn_points[0])
    before, frame = served.episode, served.tick()
    served.maps.keep_text(text)
    with pytest.raises((CallError, ValueError)):
        served.load("OpenDriveMap", reset_settings=True)
    assert served.episode is before
    assert served.tick() == frame + 1
    assert car.id in served.episode.actors.alive
    assert np.isfinite(served.episode.moving.states.x).all()


@pytest.mark.parametrize(
    ("kind", "noise"),
    [
        ("sensor.other.gnss", {"noise_lat_stddev": "1e-4"}),
        ("sensor.other.radar", {}),
        ("sensor.lidar.ray_cast", {"noise_stddev": "0.1"}),
    ],
)
def test_noise_follows_from_its_seed_alone(tmp_path, kind, noise):
    """The same after a reload, when actors have other ids; another seed gives other noise."""
    hub = Kept()
    served = Served(ServerOptions(data_dir=tmp_path), hub)
    said = []
    for seed in ("5", "5", "6"):
        served.load("", reset_settings=False)
        sensor = sensor_on_car(served, kind, noise_seed=seed, **noise)
        served.tick()
        said.append(hub.told[sensor.stream][0][HEADER.size :])
    assert said[0] == said[1] != said[2]
