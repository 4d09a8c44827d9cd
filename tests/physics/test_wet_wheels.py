"""Slip stiffness on water, snow and ice, and drag of water: laws, limits, and where they act."""

from itertools import pairwise
from math import atan, pi

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.constants import G
from skidpad.physics.fleet import Fleet
from skidpad.physics.grip import (
    CLEARED,
    ICE_STIFFNESS,
    SNOW_STIFFNESS,
    RoadSurface,
    afloat,
    mu_at,
    physical_params,
    stiffness_at,
    water_drag,
)
from skidpad.physics.types import vehicle_type
from skidpad.physics.wheel import Contact, Torques, Tyre, turn

FILMS, SPEEDS = (0.0, 0.2, 0.5, 1.0, 2.0), (50 / 3.6, 80 / 3.6, 110 / 3.6)
LOAD = 3500.0
TYRE = Tyre(14.0, LOAD, 0.5, 0.31, 1.0)
FREE = Torques(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False, False)


@kernel
def turn_once(c, tyre, q, h):
    return turn(c, tyre, q, h)


def road(film=0.0, ice=0.0, snow=0.0, on=True):
    surface = RoadSurface(film, ice, snow, 0.0, -5.0 if ice or snow else 15.0)
    return physical_params(surface, stiffness=on, drag=on)


def side_force(params, v, slip):
    """Over the load, of a wheel that rolls at a slip angle's tangent."""
    c = Contact(
        v, -slip * v, v / TYRE.radius, slip, LOAD, mu_at(params, v), stiffness_at(params, v)
    )
    return turn_once(c, TYRE, FREE, 0.01).f_y / LOAD


def fleet_on(params, v, *, commands=(0.0, 0.0, 0.0, 0.0, 0.0), t=0.0):
    fleet = Fleet([vehicle_type("hatchback")], 0.01)
    fleet.place(0, Pose(0.0, 0.0), v)
    while t > 0.0:
        now = float(np.hypot(fleet.states.vx[0], fleet.states.vy[0]))
        fleet.stiffness[:] = stiffness_at(params, now)
        fleet.step(np.array([commands]), np.full((1, 4), mu_at(params, now)))
        t -= 0.01
    return fleet


def test_off_means_the_dry_stiffness_and_no_drag():
    for params in (road(1.0, on=False), road(ice=3.0, on=False), road(snow=50.0, on=False)):
        assert stiffness_at(params, 25.0) == 1.0
        assert params.film == 0.0


@pytest.mark.parametrize("v", SPEEDS)
def test_stiffness_falls_with_film_and_speed_as_the_square_of_the_contact(v):
    """Both fall as speed rises (SAE 2006-01-0559, abstract: tyres of 4/32 inch on coated ground)."""
    at = [stiffness_at(road(f), v) for f in FILMS]
    assert at[0] == 1.0
    assert all(a > b for a, b in pairwise(at))
    for film, share in zip(FILMS, at, strict=True):
        assert share == pytest.approx(afloat.py_func(road(film), v) ** 2)
        floats = share < 0.01
        assert film == 0.0 or floats or stiffness_at(road(film), v + 5.0) < share


def test_side_force_over_slip_at_five_films_and_three_speeds():
    slips = np.tan(np.radians([0.1, 1.0, 2.0, 4.0, 8.0]))
    for v in SPEEDS:
        curves = np.array([[side_force(road(f), v, s) for s in slips] for f in FILMS])
        assert (np.diff(curves, axis=0) < 0.0).all()  # more water, less force at every slip
        plain = np.array([[side_force(road(f, on=False), v, s) for s in slips] for f in FILMS])
        assert (curves <= plain + 1e-9).all()
        shares = [stiffness_at(road(f), v) for f in FILMS[1:4]]  # on 2 mm it floats at once
        assert curves[1:4, 0] == pytest.approx(plain[1:4, 0] * shares, rel=0.08)


def test_side_force_on_packed_snow_grows_as_slowly_as_measured():
    """Fitted: 90 % or more of the maximum by 7 to 10 degrees, SAE 2006-01-1627 (CRREL)."""
    angles = np.radians(np.arange(1.0, 25.0, 0.1))
    for on, low, high in ((True, 7.0, 10.0), (False, 1.5, 3.0)):
        force = np.array([side_force(road(snow=50.0, on=on), 15.0, np.tan(a)) for a in angles])
        assert low <= np.degrees(angles[force > 0.9 * force.max()][0]) <= high


def test_side_force_on_ice_has_a_maximum_and_falls():
    """The shape of the same measurement on ice."""
    angles = np.radians(np.arange(0.5, 17.0, 0.25))
    force = np.array([side_force(road(ice=3.0), 15.0, np.tan(a)) for a in angles])
    assert 2 < force.argmax() < len(force) - 10
    assert force[-1] < 0.97 * force.max()


def test_snow_and_ice_shear():
    assert stiffness_at(road(snow=50.0), 20.0) == SNOW_STIFFNESS
    assert stiffness_at(road(ice=3.0), 20.0) == ICE_STIFFNESS


def test_brake_slip_at_two_tenths_of_g_rises_on_water():
    """A gentle stop stays below the grip, and still slips more: stopping distance would not show it."""

    def slip(params):
        fleet = fleet_on(params, 80 / 3.6, commands=(0.0, 0.117, 0.0, 0.0, 0.0), t=0.8)
        v = fleet.states.vx[0]
        assert -fleet.states.ax[0] == pytest.approx(0.2 * G, rel=0.15)
        return 1.0 - fleet.wheels.omega[0, 0] * fleet.params.wheel_radius[0] / v

    assert slip(road(0.5)) / slip(road(0.5, on=False)) == pytest.approx(
        1.0 / stiffness_at(road(0.5), 80 / 3.6), rel=0.2
    )


def test_understeer_gradient_grows_on_water():
    """Both axles soften alike, so the steer that a turn needs beyond the geometry grows with them."""

    def gradient(params):
        fleet = fleet_on(params, 80 / 3.6, commands=(0.28, 0.0, 0.012, 0.0, 0.0), t=4.0)
        s, base = fleet.states, 2.64
        v = float(np.hypot(s.vx[0], s.vy[0]))
        a = v * float(s.yaw_rate[0])
        return (fleet.wheels.steer[0] - atan(base * s.yaw_rate[0] / v)) * 180 / pi / (a / G)

    dry, wet = gradient(road()), gradient(road(0.5))
    assert 1.0 < dry < 3.0
    assert wet / dry == pytest.approx(1.0 / stiffness_at(road(0.5), 80 / 3.6), rel=0.3)


def test_drag_grows_with_depth_and_width_and_is_small_behind():
    assert water_drag.py_func(0.002, 0.2, False) == pytest.approx(0.5 * 0.75 * 1000 * 0.2 * 0.002)
    assert water_drag.py_func(0.004, 0.2, False) == 2 * water_drag.py_func(0.002, 0.2, False)
    assert water_drag.py_func(0.002, 0.3, False) == pytest.approx(
        1.5 * water_drag.py_func(0.002, 0.2, False)
    )
    assert water_drag.py_func(0.002, 0.2, True) == pytest.approx(
        CLEARED * water_drag.py_func(0.002, 0.2, False)
    )


def test_water_slows_a_coasting_car_by_its_drag():
    fleet, dry = fleet_on(road(), 20.0), fleet_on(road(), 20.0)
    drag = water_drag.py_func(0.002, 0.205, False)
    fleet.water[:] = [drag, drag, drag * CLEARED, drag * CLEARED]
    for car in (fleet, dry):
        car.step(np.zeros((1, 5)), np.full((1, 4), 0.6))
    lost = (dry.states.vx[0] - fleet.states.vx[0]) / 0.01
    assert lost == pytest.approx(2 * drag * (1 + CLEARED) * 400 / 1330, rel=0.02)
