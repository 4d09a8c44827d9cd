"""Cameras, lidars and radars read beside each other, in threads: the same bytes in the same order."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest

from skidpad.core.geometry import Pose
from skidpad.core.kernels import threads
from skidpad.core.vocabulary import Quality
from skidpad.sensors.raster.live_scene import LiveScene
from skidpad.simulation.carla_server.actors.registry import Attachment
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.sensing.producers import PRODUCERS
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.warming import ProducingHub

SMALL = {"image_size_x": "160", "image_size_y": "120", "points_per_second": "20000"}
TICKS = 3


class Kept(ProducingHub):
    """Keeps what is published, in its order."""

    def __init__(self):
        super().__init__()
        self.told = []

    def publish(self, stream, *parts):
        self.told.append((stream, b"".join(parts)))


def served_on(map: str, quality: Quality = Quality.FULL) -> tuple[Served, int]:
    """A server without a network, and a car on it."""
    served = Served(ServerOptions(map=map, quality=quality), Kept())
    points = served.episode.map.spawn_points
    car, *_ = (
        served.episode.spawn(Wanted("vehicle.tesla.model3", {}), points[k]) for k in (0, 9, 18)
    )
    return served, car.id


def attach(served: Served, car: int, kind: str, yaw: float = 0.0) -> None:
    """Puts a sensor onto the car."""
    mount = Pose(0.5, 0.0, 2.0, yaw=yaw)
    served.episode.attach(Wanted(kind, SMALL), mount, car, Attachment.RIGID)


def published(monkeypatch, processors: int) -> list[tuple[int, bytes]]:
    """What is sent in a few ticks by two sensors of each kind, in different directions."""
    monkeypatch.setattr(threads, "count_processors", lambda: processors)
    pool = ThreadPoolExecutor(processors)
    monkeypatch.setattr(threads, "_pool", lambda: pool)
    served, car = served_on("town")
    for yaw in (0.0, 2.0):
        for kind in PRODUCERS:
            attach(served, car, kind, yaw)
    served.hub.told.clear()
    for _ in range(TICKS):
        served.tick()
    pool.shutdown()
    return served.hub.told


def test_threads_change_no_byte(monkeypatch):
    alone = published(monkeypatch, 1)
    assert len(alone) > TICKS * len(PRODUCERS)
    assert published(monkeypatch, 4) == alone


@pytest.mark.parametrize(("yaw", "passes"), [(0.0, 1), (0.5, 2)])
def test_cameras_of_one_view_draw_it_once(monkeypatch, yaw, passes):
    drawn, draw = [], LiveScene.draw

    def count(self, view, *rest):
        drawn.append(view)
        draw(self, view, *rest)

    monkeypatch.setattr(LiveScene, "draw", count)
    served, car = served_on("straight")
    attach(served, car, "sensor.camera.rgb")
    attach(served, car, "sensor.camera.semantic_segmentation", yaw)
    for _ in range(TICKS):
        served.tick()
    assert len(drawn) == TICKS * passes


def test_a_draft_has_other_colours_and_the_same_depth_and_classes():
    told = {}
    for quality in Quality:
        served, car = served_on("town", quality)
        for kind in ("rgb", "depth", "semantic_segmentation", "instance_segmentation", "normals"):
            attach(served, car, f"sensor.camera.{kind}")
        attach(served, car, "sensor.lidar.ray_cast")
        colours = next(
            a.stream for a in served.episode.actors if a.blueprint.id == "sensor.camera.rgb"
        )
        served.hub.told.clear()
        served.tick()
        told[quality] = dict(served.hub.told)
    full, draft = told[Quality.FULL], told[Quality.DRAFT]
    assert [len(m) for m in full.values()] == [len(m) for m in draft.values()]
    assert {s for s in full if full[s] != draft[s]} == {colours}
