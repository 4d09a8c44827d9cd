"""What drivers make of grip and sight: how hard they brake and steer, how fast and how close they go.

Forces scale with the friction that the road has at the speed driven, so that nobody counts on more
than there is. In the dry every bound below lies above what drivers do anyway: there, care changes
nothing but the manners at the end of this page.
"""

from __future__ import annotations

from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.maths.constants import G
from skidpad.core.setup import Setup
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import GripParams, grip_params, left_at, mu_at, road_of
from skidpad.physics.optics import seen_range
from skidpad.simulation.world.traffic.idm import (
    A_EMERGENCY,
    B_COMFORT,
    GAP_MIN,
    Character,
)

# Shares of the friction at hand, mu g. Ours: tyres then keep a reserve for steering corrections; the
# share of bends is that which 3.5 m/s^2 (idm.A_CURVE) takes of a dry road.
COMFORT_SHARE = 0.25  # braking that is planned
FIRM_SHARE = 0.6  # braking that is counted upon when something turns up
HARDEST_SHARE = 0.8  # braking at most
DRIVE_SHARE = 0.25  # acceleration that is asked for
TRACTION_SHARE = 0.6  # drive force at most, hills included, of what the driven wheels carry
SLIDE = (
    0.02,
    0.06,
)  # rad at the rear axle; drivers begin to lift, and have lifted. Dry bends: 0.017
CURVE_SHARE = 0.4  # lateral, in bends
BEND_HALVINGS = 6  # of the range of speeds for a bend
STEER_SHARE = 0.6  # lateral at most, corrections included
CHANGE_SHARE = 0.3  # lateral, peak in a change of lane
CHANGE_PEAK = 0.81  # m/s^2, of a quintic over 3.5 m in CHANGE_TIME
V_STEADY = 8.0  # m/s, from which on the whole gap is the headway; slower, it tends to GAP_MIN
LEAST_PART = 0.3  # of a headway, beside GAP_MIN
V_CHANGE = 8.0  # m/s; slower ones change over the way of this speed, else they would stand across
REACTION = 1.0  # s from seeing an obstacle to braking; AASHTO's design value is 2.5 s
SEEN_AT_MOST = 140.0  # m: drivers look as far as driver.REACH_AHEAD
STOP_MARGIN = 10.0  # m

A_STEER = 7.0  # m/s^2, the most that a driver steers for who knows no ice
# Advantage in m/s^2 for which lanes are changed, and changes per m without a reason that MOBIL knows.
# Kesting, Treiber and Helbing (2007) have 0.1. highD counts 5600 complete changes in 45 000 km, 0.12
# per km (Krajewski et al. 2018, section I), a lower bound as only those within 420 m are complete; the
# 0.36 per mile of naturalistic driving (DOT HS 809 702), 0.22 per km, lie above it.
A_CHANGE, DRAWN = 0.5, 0.00005
A_CHANGE_CARELESS, DRAWN_CARELESS = 0.1, 0.00016  # 0.36 per mile, most of it drawn


class Care(NamedTuple):
    """What drivers know of weather; off: nothing, as CARLA's."""

    on: bool
    grip: GripParams
    sight: float  # m at which the lamps of others are seen
    a_change: float  # m/s^2, advantage for which a lane is changed
    drawn: float  # changes of lane per m without such an advantage


def careless() -> Care:
    """Returns the care of drivers that take every road for dry and every day for clear."""
    grip = grip_params(Weather(), GripModel.NONE)
    return Care(False, grip, inf, A_CHANGE_CARELESS, DRAWN_CARELESS)


def care_of(setup: Setup, slow_in_weather: bool) -> Care:
    """Returns what the drivers of a set-up know of its weather; nothing unless they slow in it."""
    if not slow_in_weather:
        return careless()
    grip = road_of(setup).params()
    return Care(True, grip, seen_range(setup.weather), A_CHANGE, DRAWN)


@kernel
def grip_at(care: Care, v: float) -> float:
    """Returns friction times gravity in m/s^2 at speed v in m/s."""
    return G * mu_at(care.grip, v)


@kernel
def character(
    care: Care, v: float, headway: float, a_max: float, is_exact: bool = False
) -> Character:
    """Returns how a driver with these habits follows at speed v in m/s.

    headway: s on a dry road; a_max: m/s^2; is_exact: the headway is that of the whole gap.
    """
    if not care.on:
        return Character(headway, a_max, B_COMFORT, A_EMERGENCY, False)
    g = grip_at(care, v)
    if is_exact:
        headway = max(headway - GAP_MIN / max(v, V_STEADY), LEAST_PART * headway)
    return Character(
        headway / sqrt(min(left_at(care.grip, v), 1.0)),
        min(a_max, DRIVE_SHARE * g),
        min(B_COMFORT, COMFORT_SHARE * g),
        max(A_EMERGENCY, -HARDEST_SHARE * g),
        is_exact,
    )


@kernel
def braking(care: Care, v: float) -> float:
    """Returns comfortable braking in m/s^2 at speed v in m/s."""
    return min(B_COMFORT, COMFORT_SHARE * grip_at(care, v)) if care.on else B_COMFORT


@inner_kernel
def firm_braking(care: Care, v: float, dry: float) -> float:
    """Returns the braking in m/s^2 that is counted upon at v in m/s; `dry`: on a dry road."""
    return min(dry, FIRM_SHARE * grip_at(care, v)) if care.on else dry


@kernel
def speed_choice(care: Care, v: float, patch: float = 1.0) -> float:
    """Returns the desired speed over that on a dry road, at the grip of v in m/s.

    patch: share of it that a patch leaves. Source: SUMO's friction device, documentation
    "Simulation/Friction".
    """
    grip = left_at(care.grip, v) * patch if care.on else 1.0
    if grip >= 1.0:
        return 1.0
    return -0.3491 * grip * grip + 0.8922 * grip + 0.4493


@kernel
def sight_speed(care: Care, v: float) -> float:
    """Returns the m/s from which one stops within sight, at the friction of v in m/s; inf without care."""
    if not care.on:
        return np.inf
    b = FIRM_SHARE * grip_at(care, v)
    way = max(min(care.sight, SEEN_AT_MOST) - STOP_MARGIN, 1.0)
    return sqrt(b * b * REACTION * REACTION + 2.0 * b * way) - b * REACTION


@kernel
def bend_speed_sq(care: Care, curvature: float, a_curve: float) -> float:
    """Returns the square of the speed in (m/s)^2 for a bend: v^2 |curvature| <= CURVE_SHARE mu_ref left(v) g.

    curvature: 1/m, not 0. a_curve in m/s^2 bounds it on a dry road. Grip falls with speed: by halving,
    from below.
    """
    bend = abs(curvature)
    free = a_curve / bend
    if not care.on:
        return free
    scale = CURVE_SHARE * G * care.grip.mu_ref / bend
    low = 0.0
    high = sqrt(min(free, scale * left_at(care.grip, 0.0)))
    if high * high <= scale * left_at(care.grip, high):
        return high * high
    for _ in range(BEND_HALVINGS):
        v = 0.5 * (low + high)
        if v * v <= scale * left_at(care.grip, v):
            low = v
        else:
            high = v
    return low * low


@kernel
def steering_limit(care: Care, v: float) -> float:
    """Returns the lateral acceleration in m/s^2 that is steered for at most, at v in m/s."""
    return min(A_STEER, STEER_SHARE * grip_at(care, v)) if care.on else A_STEER


@kernel
def traction_limit(care: Care, v: float, carried: float, slide: float) -> float:
    """Returns the drive force over mass in m/s^2 that is asked for at most; inf without care.

    carried: share of the weight on the driven wheels; slide: sideways over forward motion at the rear
    axle, beyond SLIDE drivers lift.
    """
    if not care.on:
        return np.inf
    left = (SLIDE[1] - abs(slide)) / (SLIDE[1] - SLIDE[0])
    return TRACTION_SHARE * carried * grip_at(care, v) * min(max(left, 0.0), 1.0)


@inner_kernel
def drive_limit(care: Care, v: float, a_max: float) -> float:
    """Returns the acceleration in m/s^2 that is asked for at most, at v in m/s."""
    return min(a_max, DRIVE_SHARE * grip_at(care, v)) if care.on else a_max


@inner_kernel
def change_pace(care: Care, v: float) -> float:
    """Returns how fast a change of lane goes, 1 in the dry; its lateral peak falls with the square."""
    pace = min(1.0, max(v, 0.0) / V_CHANGE)
    if not care.on:
        return pace
    return min(pace, sqrt(CHANGE_SHARE * grip_at(care, v) / CHANGE_PEAK))


@kernel
def reach(care: Care, v: float, least: float) -> float:
    """Returns the m within which one looks for what one may have to stop for.

    `least`, or what stopping from v m/s takes where that is more.
    """
    if not care.on:
        return least
    return max(least, v * v / (2.0 * FIRM_SHARE * grip_at(care, v)) + STOP_MARGIN)


@kernel
def speed_to_stop_within(care: Care, way: float, most: float) -> float:
    """Returns the m/s, at most `most`, from which `way` m are enough to stop."""
    if not care.on:
        return most
    return min(most, sqrt(2.0 * FIRM_SHARE * grip_at(care, most) * way))
