"""Anti-lock brakes from wheel speeds: they cycle, never know the grip, select low and limit the lead."""

import inspect

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.physics import antilock
from skidpad.physics.antilock import CYCLES, GAP, PRESSURE
from skidpad.physics.fleet import Fleet
from skidpad.physics.types import vehicle_type
from split_friction import split_stop

CAR = vehicle_type("mini_cooper_s")


class Stop:
    """A full stop from v m/s, wheel held straight."""

    def __init__(self, mu, v=27.8, cycling=True, anti_lock=True):
        fleet = Fleet([CAR], 0.01, cycling=cycling, anti_lock=anti_lock)
        fleet.place(0, Pose(0.0, 0.0), v)
        commands, grip = np.zeros((1, 5)), np.broadcast_to(mu, (1, 4)).astype(float)
        commands[0, 1] = 1.0
        slips, pressures = [], []
        while fleet.speed(0) > 0.5:
            fleet.step(commands, grip)
            if fleet.speed(0) > 3.0:
                slips.append(1.0 - np.array(fleet.wheel_speeds(0)) / fleet.speed(0))
                pressures.append(fleet.wheels.memory[0].copy())
        self.slips, self.memory = np.array(slips), np.array(pressures)
        self.seconds, self.way = 0.01 * len(slips), float(fleet.states.x[0])
        self.share = v * v / (2.0 * self.way * np.mean(grip) * G)


@pytest.mark.parametrize("mu", [0.9, 0.8, 0.4, 0.2])
def test_a_stop_cycles_and_wastes_little(mu):
    stop, ideal = Stop(mu), Stop(mu, cycling=False)
    assert 0.88 < stop.share / ideal.share < 1.0
    wheels = stop.memory[-1, CYCLES] / stop.seconds / 3.0  # front ones, and the rear axle as one
    assert 1.0 < wheels < 10.0  # "around 10 adjustments per second" (kfz-tech.de): relief and rise
    assert np.median(stop.slips) < antilock.SLIP_HIGH


def test_locked_wheels_stop_later_and_slide():
    locked = Stop(0.8, cycling=False, anti_lock=False)
    assert locked.way > Stop(0.8).way
    assert np.median(locked.slips) == pytest.approx(1.0)


def test_the_control_is_given_no_friction():
    parameters = inspect.signature(antilock.regulate.py_func).parameters
    assert list(parameters) == [
        "m",
        "omega",
        "radius",
        "half_track",
        "yaw_rate",
        "slows",
        "pedal",
        "h",
    ]


def test_rear_wheels_select_low_and_the_lead_of_a_front_wheel_is_limited():
    stop = Stop((0.8, 0.2, 0.8, 0.2), v=20.0)
    left, right = stop.memory[:, PRESSURE], stop.memory[:, PRESSURE + 1]
    assert np.array_equal(stop.memory[:, PRESSURE + 2], stop.memory[:, PRESSURE + 3])
    cycled = stop.memory[:, CYCLES] > 0.0
    assert np.all(abs(left - right)[cycled] <= stop.memory[cycled, GAP] + 1e-9)
    assert np.mean(left[:100]) > np.mean(right[:100]) + 0.1


def test_split_friction_is_held_by_the_driver_without_stability_control():
    # the ideal control brakes the gripping side at once: this car spins with it (docs/physics.md)
    kept = split_stop(CAR, 100 / 3.6, steers=True, stability=False, cycling=True)
    lost = split_stop(CAR, 100 / 3.6, steers=True, stability=False)
    assert kept.heading < 0.2 < lost.heading
    assert kept.utilisation < 0.8
    both = split_stop(CAR, 100 / 3.6, steers=True, cycling=True)
    assert both.aside < 0.6
    assert both.distance == pytest.approx(118.0, abs=3.0)


def test_gentle_braking_is_left_alone():
    way = []
    for cycling in (False, True):
        fleet = Fleet([CAR], 0.01, cycling=cycling)
        fleet.place(0, Pose(0.0, 0.0), 20.0)
        commands = np.zeros((1, 5))
        commands[0, 1] = 0.2
        for _ in range(200):
            fleet.step(commands, np.full((1, 4), 0.9))
        way.append(float(fleet.states.x[0]))
        assert fleet.wheels.memory[0, CYCLES] == 0.0
    assert way[1] == pytest.approx(way[0], abs=0.4)  # pressure takes 0.15 s to build up
