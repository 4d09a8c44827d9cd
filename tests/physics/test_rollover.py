"""Roll-over: thresholds by hand, the energy of tipping, classes against NHTSA's averages, bends."""

from math import cos, radians, sin

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.constants import G
from skidpad.physics.car import BRAKE, STEER, THROTTLE
from skidpad.physics.fleet import Fleet
from skidpad.physics.rollover import (
    MEMORY,
    ON_SIDE,
    OVER,
    SLIDING,
    TILT,
    TILT_RATE,
    left_arm,
    roll_inertias,
    rollover_threshold,
    static_stability,
    tip,
)
from skidpad.physics.types import vehicle_type
from skidpad.physics.vehicle import steer_share

LORRY = vehicle_type("truck")
CARS = (
    *("mini_cooper_s", "hatchback", "city_car", "saloon", "electric_saloon", "estate"),
    "sports_car",
)
# Sales-weighted means of model year 2003: NHTSA, DOT HS 809 868, abstract (trid.trb.org/view/763766)
NHTSA = {"car": 1.41, "suv": 1.17, "pickup": 1.18, "van": 1.12}


@kernel
def arm_of(half_track, height, gradient, a_y):
    return left_arm(half_track, height, gradient, a_y)


@kernel
def tip_for(m, a_y, arm, height, inertia, h, most):
    """Ticks until it lies on its side, at most `most`."""
    for k in range(most):
        if m[OVER] > 0.0:
            return k
        tip(m, a_y, 9.80665, arm, height, inertia, h)
    return most


def lean_on(a_y, seconds=20.0, tilt=0.0, rate=0.0, h=1e-4):
    """Memory of a lorry after a steady lateral acceleration, and the s to its side."""
    m = np.zeros(MEMORY)
    m[TILT], m[TILT_RATE] = tilt, rate
    arm = arm_of(0.5 * LORRY.track, LORRY.cog_height, LORRY.roll_gradient, a_y)
    inertia = roll_inertias([LORRY])[0]
    ticks = tip_for(m, a_y, arm, LORRY.cog_height, inertia, h, round(seconds / h))
    return m, ticks * h, arm, inertia


def bend(name, mu, *, v=17.0, angle=12.0, on=True, brake=0.0, seconds=6.0):
    """A vehicle whose road wheels turn to 12 degrees within 0.6 s; the fleet when it lies or time is over."""
    kind = vehicle_type(name)
    fleet = Fleet([kind], 0.05, roll_over=on)
    fleet.place(0, Pose(0.0, 0.0), v)
    commands, most = np.zeros((1, 5)), 0.0
    for k in range(round(seconds / 0.05)):
        steer = radians(angle) * min(1.0, k * 0.05 / 0.6)
        commands[0, STEER] = steer / steer_share(fleet.speed(0)) / kind.steer_max
        commands[0, THROTTLE] = np.clip(0.5 * (v - fleet.speed(0)), 0.0, 1.0)
        commands[0, BRAKE] = brake
        fleet.step(commands, np.full((1, 4), mu))
        most = max(most, abs(float(fleet.wheels.a_load[0, 1])))
        if fleet.on_side()[0]:
            break
    return fleet, most / G


def test_thresholds_of_the_lorry_by_hand():
    assert static_stability(LORRY) == pytest.approx(1.95 / 2.8)
    assert rollover_threshold(LORRY) == pytest.approx(1.95 / 2.8 / (1.0 + 0.009 * 9.80665))
    for share, lies in ((0.99, False), (1.01, True)):
        m, *_ = lean_on(share * rollover_threshold(LORRY) * G)
        assert bool(m[OVER]) is lies
        assert abs(m[TILT]) == (ON_SIDE if lies else 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_tipping_body_has_the_energy_that_the_turn_gave_it(side):
    """Work of side force and weight about the outer wheels, over the mass, against I q'^2 / 2."""
    a = 0.8 * G
    m, seconds, arm, inertia = lean_on(side * a)
    h, k = LORRY.cog_height, 1e-4
    half, *_ = lean_on(side * a, seconds - 0.2)
    q, rate = abs(half[TILT]), abs(half[TILT_RATE])
    work = a * (h * sin(q) + arm * (1.0 - cos(q))) - G * (arm * sin(q) - h * (1.0 - cos(q)))
    assert 0.5 < q < ON_SIDE
    assert 0.5 * inertia * rate * rate == pytest.approx(work, rel=50 * k)
    assert m[TILT] == side * ON_SIDE


def test_a_lifted_vehicle_falls_back_below_its_balance_and_over_beyond():
    balance = np.arctan2(0.5 * LORRY.track, LORRY.cog_height)
    assert lean_on(0.0, tilt=0.9 * balance)[0][TILT] == 0.0
    assert lean_on(0.0, tilt=1.02 * balance)[0][OVER] == 1.0


@pytest.mark.parametrize(("name", "share"), [("suv", 0.05), ("pickup", 0.06), ("van", 0.16)])
def test_static_stability_is_near_the_mean_of_its_class(name, share):
    """The van here has a high roof and is half laden."""
    assert static_stability(vehicle_type(name)) == pytest.approx(NHTSA[name], rel=share)


def test_static_stability_of_cars_is_that_of_their_class():
    mean = np.mean([static_stability(vehicle_type(name)) for name in CARS])
    assert mean == pytest.approx(NHTSA["car"], rel=0.05)


@pytest.mark.parametrize("mu", [0.9, 1.05])
def test_a_lorry_rolls_over_in_a_tight_bend_on_asphalt(mu):
    fleet, a_y = bend("truck", mu)
    assert fleet.on_side()[0]
    assert fleet.states.roll[0] == pytest.approx(ON_SIDE)  # to the right in a left bend
    assert a_y > rollover_threshold(LORRY)


@pytest.mark.parametrize("name", CARS)
def test_a_low_car_slides_instead(name):
    fleet, a_y = bend(name, 0.9)
    assert not fleet.on_side()[0]
    assert fleet.wheels.memory[0, TILT] == 0.0
    assert a_y < rollover_threshold(vehicle_type(name))
    assert fleet.wheels.slide[0].max() > 1.0


@pytest.mark.parametrize("name", ["truck", "van", "sports_car"])
def test_nobody_rolls_over_on_ice(name):
    fleet, a_y = bend(name, 0.12)
    assert not fleet.on_side()[0]
    assert a_y < 0.13


def test_off_the_lorry_keeps_on_its_wheels():
    fleet, a_y = bend("truck", 0.9, on=False)
    assert not fleet.on_side()[0]
    assert fleet.wheels.memory[0, TILT] == 0.0
    assert a_y > rollover_threshold(LORRY)


def test_loads_add_up_and_leave_the_road_at_the_threshold():
    fleet, _ = bend("truck", 0.9, seconds=1.2)
    load = fleet.wheels.load[0]
    assert load.sum() == pytest.approx(LORRY.mass * G)
    assert load.min() >= 0.0
    assert fleet.wheels.memory[0, TILT] == 0.0 or load[[0, 2]] == pytest.approx([0.0, 0.0], abs=1.0)


def test_what_lies_on_its_side_slides_to_a_stop_and_stays():
    """v^2 / (2 mu g) by hand; no pedal moves it."""
    fleet, _ = bend("truck", 0.9)
    s = fleet.states
    s.vx[0], s.vy[0], s.yaw_rate[0] = 12.0, 0.0, 0.0
    s.yaw[0] = s.x[0] = 0.0
    commands = np.array([[1.0, 0.0, 0.5, 0.0, 0.0]])
    for _ in range(120):
        fleet.step(commands, np.full((1, 4), 0.9))
    assert np.hypot(s.vx[0], s.vy[0]) < 1e-3
    assert s.x[0] == pytest.approx(12.0**2 / (2.0 * SLIDING * G), rel=0.03)
    fleet.place(0, Pose(0.0, 0.0), 5.0)
    assert not fleet.on_side()[0]
