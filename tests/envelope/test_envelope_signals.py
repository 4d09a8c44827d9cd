"""The bus of a car: noise, offsets, resolution and delay, equal for equal seeds."""

from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.states import EgoEstimate, VehicleCommand
from skidpad.envelope.signals import BRAKE_BAR, EXACT, BusModel, CarBus

EGO = EgoEstimate(Pose(0.0, 0.0), 20.0, 0.1, 1.0, 2.0, (20.0, 20.1, 20.2, 20.3), 3)


def read_many(seed, ticks=2000, ego=EGO, command=None, model=None):
    bus = CarBus(seed, model)
    return [bus.read(ego, command or VehicleCommand(), 1.0, 0.0) for _ in range(ticks)]


def test_an_exact_bus_says_what_is():
    bus = CarBus(1, EXACT)
    signals = bus.read(EGO, VehicleCommand(brake=0.5, steer=0.1), 2.0, 0.05)
    assert signals.wheels == EGO.wheel_speeds
    assert signals.ax == pytest.approx(1.0 + 9.80665 * 0.05, rel=1e-4)  # uphill presses backwards
    assert (signals.ay, signals.yaw_rate, signals.brake, signals.drive) == (2.0, 0.1, 75.0, 2.0)
    assert signals.steer == pytest.approx(0.122)


def test_equal_seeds_give_equal_errors_and_others_do_not():
    assert read_many(5, 50) == read_many(5, 50)
    assert read_many(5, 50) != read_many(6, 50)


def test_noise_and_offsets_are_those_of_the_model():
    m = BusModel()
    rows = read_many(3)
    ax = np.array([row.ax for row in rows])
    yaw = np.array([row.yaw_rate for row in rows])
    assert ax.std() == pytest.approx(m.a_noise, rel=0.1)
    assert yaw.std() == pytest.approx(m.yaw_noise, rel=0.1)
    assert 0.0 < abs(ax.mean() - EGO.ax) <= m.a_offset
    offsets = [CarBus(seed).rules.ax for seed in range(200)]
    assert -m.a_offset <= min(offsets) < -0.9 * m.a_offset < 0.9 * m.a_offset < max(offsets)


def test_signals_have_the_steps_of_the_bus():
    m = BusModel()
    for row in read_many(3, 20):
        steps = np.array(
            [row.wheels[0] / m.wheel_step, row.ax / m.a_step, row.steer / m.steer_step]
        )
        assert steps == pytest.approx(np.round(steps), abs=1e-6)


def test_a_message_is_late_by_a_tick():
    bus = CarBus(1, EXACT._replace(delay=1))
    bus.read(EGO, VehicleCommand(), 0.0, 0.0)
    late = bus.read(replace(EGO, ax=-5.0), VehicleCommand(brake=1.0), 0.0, 0.0)
    assert (late.ax, late.brake) == (1.0, 0.0)
    assert bus.read(EGO, VehicleCommand(), 0.0, 0.0)[1:7:4] == (-5.0, BRAKE_BAR)


def test_a_pedal_that_is_not_pressed_has_no_pressure():
    assert {row.brake for row in read_many(3, 50)} == {0.0}
