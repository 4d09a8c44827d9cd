"""Effects of weather on radar and lidar stay in kernels: the Python of a tick with its sensors is counted."""

import sys
from collections import Counter
from dataclasses import replace

import pytest

from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.geometry import Pose
from skidpad.core.settings.parts import load_profile
from skidpad.core.specs import LidarSpec
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.runs import adas_run

RAIN = Weather(name="rain", precipitation=80.0, wetness=100.0, precipitation_deposits=80.0)
LIDAR = LidarSpec("lidar", Pose(0.0, 0.0, 2.0), range=80.0)
PHYSICAL = {"lidar": "physical"}
ALL = PHYSICAL | {
    "spray": True,
    "lidar_fog": "advection",
    "lidar_wet_ground": True,
    "lidar_dirt": 0.1,
    "lidar_drops_s": 5.0,
}
RADAR = {"radar_model": "physical"}
TICKS = 20


def calls(settings, *, lidar=False, vehicles=20, blind=False):
    """How often each Python function of the package is entered in TICKS ticks and reads of sensors."""
    values = load_profile("recommended", settings)
    spec = adas_run(2, settings=values, sensors=SensorLevel.OBJECTS, weather=RAIN, duration=10.0)
    setup = stage_of(spec).setup
    setup = replace(setup, traffic=replace(setup.traffic, vehicles=vehicles))
    if blind:
        setup = replace(setup, specs=())
    if lidar:
        setup = replace(setup, specs=(*setup.specs, LIDAR), asked=frozenset({"lidar"}))
    setup = replace(setup, ego=replace(setup.ego, speed=30.0))
    backend, found = EmbeddedBackend(), Counter()
    frame = backend.reset(setup, 3)

    def note(frame, event, _):
        if event == "call" and frame.f_globals.get("__name__", "").startswith("skidpad.sensors."):
            found[frame.f_globals["__name__"], frame.f_code.co_qualname] += 1

    def read(frame):
        return frame.radar if not lidar else frame.extra["lidar"]

    read(frame)
    sys.setprofile(note)
    try:
        for _ in range(TICKS):
            read(backend.step(VehicleCommand(throttle=0.3)))
    finally:
        sys.setprofile(None)
    backend.close()
    return found


@pytest.mark.parametrize(
    "more",
    [{}, {"radar_multipath": True}, {"radar_multipath": True, "radar_output": "tracks"},
     {"radar_interference": 0.5}],
)  # fmt: skip
def test_a_physical_radar_is_read_by_a_few_calls_however_many_vehicles(more):
    few, many = (calls(RADAR | more, vehicles=n) for n in (2, 20))
    assert few == many
    own = {k: n for k, n in many.items() if k[0].startswith("skidpad.sensors.physical_radar")}
    assert 0 < sum(own.values()) <= 3 * TICKS  # read, and what packs the tracks
    # without it one call reads cameras and radar; with it each camera is read by its own
    assert sum(many.values()) <= sum(calls({}).values()) + 6 * TICKS + sum(own.values())


def test_a_lidar_with_every_effect_adds_a_few_calls_a_tick_however_many_vehicles():
    few, many = (calls(ALL, lidar=True, vehicles=n) for n in (2, 20))
    assert few == many
    added = sum(many.values()) - sum(calls(PHYSICAL, lidar=True).values())
    assert 0 < added <= 9 * TICKS  # the window's share, the clouds' places, one compiled call


def test_a_run_without_sensors_enters_none():
    assert calls({})
    assert not calls({}, blind=True)
