"""The driver that sees: what it is shown decides, and without sight it fails."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from msgspec import structs

from skidpad.campaign.cells.grip import Cross, cross, seeds, template
from skidpad.campaign.runs.run import run
from skidpad.core.errors import ConfigError, StackError
from skidpad.core.frames import CameraImage, RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.run import CameraDriver as Spec
from skidpad.core.run import Friction, RunSpec
from skidpad.core.specs import Modality
from skidpad.core.states import EgoEstimate
from skidpad.core.vocabulary import Outcome, SensorLevel
from skidpad.physics.presets import preset
from skidpad.roads.bundled import load_map
from skidpad.sensors.bench import convoy
from skidpad.sensors.suite import PixelSettings, PixelSuite
from skidpad.stack.camera import network
from skidpad.stack.camera.codes import mosaic
from skidpad.stack.camera.driver import CameraDriver, curvature, steer_of
from skidpad.stack.camera.eyes import CAMERAS, images_of

FIVE_MB = 5_000_000


def drives(scenario="lead_slowdown", n=1, **changes):
    base = structs.replace(template(driver=Spec(), sensors=SensorLevel.PIXELS), **changes)
    varied = Cross(scenarios=(scenario,), weather=[preset("rain_0")], frictions=[Friction.ORIGINAL])
    return cross(base, varied, seeds(0, n))


@pytest.fixture(scope="module")
def images():
    map = load_map("motorway")
    table, states = convoy(map)
    suite = PixelSuite(map, table, CAMERAS, preset("clear-noon"), PixelSettings())
    seen = suite.observe(0, states, {})
    return {camera.id: CameraImage(rgb=seen.images[camera.id].rgb.copy()) for camera in CAMERAS}


def a_frame(extra, v=20.0) -> SensorFrame:
    ego = EgoEstimate(Pose(0.0, 0.0), v, 0.0, 0.0, 0.0, (v,) * 4, 4)
    return SensorFrame(1, ego, {}, {}, RadarPoints.none(), {}, extra=extra)


def driver(**settings) -> CameraDriver:
    return CameraDriver((), load_map("motorway"), settings)


@pytest.mark.req("B-121")
def test_three_forward_cameras_and_a_small_frozen_network():
    assert [c.id for c in driver().sensors()] == ["camera/centre", "camera/left", "camera/right"]
    assert {c.modality for c in CAMERAS} == {Modality.RGB}
    assert sorted(round(np.degrees(c.mount.yaw)) for c in CAMERAS) == [-50, 0, 50]
    assert 1000 < len((files("skidpad.stack.camera") / network.WEIGHTS).read_bytes()) < FIVE_MB


def test_the_same_images_give_the_same_commands(images):
    first, second = (driver().tick(a_frame(images)) for _ in range(2))
    assert first == second


@pytest.mark.req("X-4")
def test_a_mirrored_road_is_steered_the_other_way(images):
    picture = mosaic(images_of(images))
    there = network.read_mosaic(picture)
    back = network.read_mosaic(np.ascontiguousarray(picture[:, ::-1]))
    assert back.offsets[:3] == pytest.approx([-y for y in there.offsets[:3]], abs=0.5)


def test_a_frame_without_images_is_the_drivers_failure():
    with pytest.raises(StackError, match="--sensors pixels"):
        driver().tick(a_frame({}))
    with pytest.raises(ConfigError, match="--sensors pixels"):
        RunSpec(driver=Spec(), sensors=SensorLevel.OBJECTS)


def test_wrong_options_are_one_sentence():
    with pytest.raises(ConfigError, match="camera driver option"):
        driver(profile="recommended")
    with pytest.raises(ConfigError, match="cruise_kmh must be between 1 and 400"):
        driver(cruise_kmh=0.0)


def test_a_bend_is_steered_into():
    ahead = np.array((6.0, 12.0, 20.0, 30.0, 45.0))
    left = 0.5 * ahead**2 / 80.0  # R 80 m
    assert curvature(left) == pytest.approx(1.0 / 80.0)
    assert steer_of(left, 15.0) > 0.0 > steer_of(-left, 15.0)


class Watched(CameraDriver):
    """The driver under test, shown nothing."""

    def picture(self, frame):
        return np.zeros_like(super().picture(frame))


@pytest.mark.slow
@pytest.mark.req("B-121")
def test_it_completes_the_cut_in_and_cannot_without_sight():
    (cell,) = drives("ghost_cut_in")
    seeing, blind = run(cell), run(cell, Watched)
    assert seeing.outcome is Outcome.COMPLETED
    assert not seeing.off_road.any()
    assert np.ptp(seeing.log.actors.y[:, 0]) < 1.0
    assert blind.outcome is not Outcome.COMPLETED  # black images: it never drives off


@pytest.mark.slow
@pytest.mark.req("B-121")
def test_it_stops_behind_a_lead():
    (cell,) = drives("lead_slowdown")
    seen = run(cell)
    assert seen.outcome is Outcome.COMPLETED
    assert seen.log.v_ego[0] > 20.0
    gap = seen.log.actors.x[-1, 1] - seen.log.actors.x[-1, 0]
    assert 4.0 < gap < 30.0  # behind it, not far away


@pytest.mark.slow
@pytest.mark.req("X-1", "X-12")
def test_a_drive_repeats_to_the_byte():
    from skidpad.recording.run.log_files import log_hash

    (cell,) = drives(duration=3.0)
    assert log_hash(run(cell).log) == log_hash(run(cell).log)


def test_its_sight_is_all_that_it_is_given(images):
    """Truth, radar, pose and map change nothing."""
    plain = a_frame(images)
    other = replace(plain, ego=replace(plain.ego, pose=Pose(500.0, -40.0, 0.0, 0.0, 0.0, 2.0)))
    noisy = replace(other, radar=RadarPoints(*(np.ones(3, dtype=np.float32) for _ in range(4))))
    elsewhere = CameraDriver((), load_map("straight"), {})
    assert driver().tick(plain) == elsewhere.tick(noisy)
