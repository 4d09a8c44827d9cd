"""The speeds that sight, a lead, bends and water allow: pure functions, each with its source.

Speeds in m/s, distances in m, decelerations positive in m/s^2. The lowest speed of all wins.
"""

from __future__ import annotations

from enum import IntEnum
from math import inf, sqrt
from typing import NamedTuple

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel

STRAIGHT = 1e-5  # 1/m, less is no bend
INCH_MM = 25.4
MPH = 0.44704  # m/s
FILM_LEAST, FILM_MOST = 0.2, 2.54  # mm between which `floating_speed` is used; thinner: no floating


class Binding(IntEnum):
    """Which limit is the lowest."""

    NONE = 0  # none is below the speed that a car can drive
    SIGHT = 1
    LEAD = 2
    BEND = 3
    WATER = 4
    TABLE = 5  # of a rival of the envelope: a table of speeds, or one fixed speed
    LANE = 6  # these three only where they are asked for
    WALKER = 7
    BRIDGE = 8


@kernel
def sight_speed(distance: float, deceleration: float, delay: float) -> float:
    """Returns the highest speed from which a car stops within `distance`; 0 where that is not above 0.

    Solves d = v t + v^2 / (2 a) for v: stopping sight distance, AASHTO, A Policy on Geometric Design
    of Highways and Streets (2011), equation 3-2, with the delay in the place of the reaction time.
    """
    if distance <= 0.0:
        return 0.0
    b = deceleration * delay
    return sqrt(b * b + 2.0 * deceleration * distance) - b


@kernel
def following_speed(
    gap: float, v_lead: float, deceleration: float, lead_deceleration: float, delay: float
) -> float:
    """Returns the highest speed for which `gap` keeps a follower out of a lead that brakes at once.

    It solves gap = v t + v^2 / (2 a) - v_lead^2 / (2 a_lead) for v: the longitudinal distance of RSS without
    acceleration in the response time (Shalev-Shwartz, Shammah and Shashua, On a Formal Model of Safe and
    Scalable Self-driving Cars, 2017, arXiv 1708.06374, lemma 2; IEEE 2846-2022 has the same form). The
    stops are compared. Where the lead brakes less hard than the follower can, the two may come
    nearer before both stand, so the lead's deceleration must be its hardest possible one.
    """
    lead_way = v_lead * v_lead / (2.0 * lead_deceleration)
    return sight_speed(max(gap, 0.0) + lead_way, deceleration, delay)


class RssParameters(NamedTuple):
    """Constants of RSS, here those of intel/ad-rss-lib's documentation; they know no weather."""

    response: float = 1.0  # s
    acceleration: float = 3.5  # m/s^2, at most in the response time
    brake_least: float = 4.0  # m/s^2 of the follower
    brake_most: float = 8.0  # m/s^2 of the lead


@kernel
def rss_speed(gap: float, v_lead: float, constants: RssParameters) -> float:
    """Returns the highest speed for which `gap` is the safe distance of RSS, which is solved for v + a t.

    v t + a t^2 / 2 + (v + a t)^2 / (2 b_least) - v_lead^2 / (2 b_most), at least 0 (arXiv 1708.06374, lemma
    2; IEEE 2846-2022).
    """
    t, a = constants.response, constants.acceleration
    way = max(gap, 0.0) + v_lead * v_lead / (2.0 * constants.brake_most) + 0.5 * a * t * t
    return max(sight_speed(way, constants.brake_least, t) - a * t, 0.0)


@kernel
def bend_speed(curvature: float, lateral: float) -> float:
    """Returns the speed at which a bend takes `lateral` m/s^2; inf below a curvature (1/m) of STRAIGHT.

    v^2 times curvature: the balance of a point mass, AASHTO's simplified curve formula, without
    superelevation.
    """
    return sqrt(lateral / abs(curvature)) if abs(curvature) > STRAIGHT else inf


@kernel
def speed_before_bend(v_bend: float, distance: float, approach: float) -> float:
    """Returns the speed `distance` before a bend from which `approach` m/s^2 slows to v_bend; inf for inf."""
    return sqrt(v_bend * v_bend + 2.0 * approach * max(distance, 0.0)) if v_bend < inf else inf


@kernel
def bends_speed(
    distance: Floats, curvature: Floats, lateral: float, approach: float, delay: float, v: float
) -> float:
    """Returns the speed that all bends allow, inf without any; `v` drives on for the delay before braking.

    distance, curvature: (n,) m ahead and 1/m of points of the lane.
    """
    least = inf
    for i in range(len(distance)):
        bend = bend_speed(curvature[i], lateral)
        least = min(least, speed_before_bend(bend, distance[i] - v * delay, approach))
    return least


@kernel
def preview_speed(distance: float, preview: float) -> float:
    """Returns the highest speed at which `distance` m of lane boundary are `preview` s of driving.

    Herland, Road visibility, lateral position and speed (VTI, driving simulator, for COST 331), took sight of
    the markings over speed for the measure: 1.8 s at least where the speed was free.
    """
    return max(distance, 0.0) / preview


@kernel
def bridge_speed(
    distance: float, reach: float, deceleration: float, approach: float, delay: float, v: float
) -> float:
    """Returns the speed now from which a car can stop in sight on a bridge that begins `distance` m ahead.

    deceleration: m/s^2 that the bridge allows; reach: m that are seen; approach: m/s^2 of slowing before it;
    `v` drives on for the delay. Bridges freeze first: Birnie, Transportation Research Record 598 (1976).
    """
    on_it = sight_speed(reach, deceleration, delay)
    return speed_before_bend(on_it, distance - v * delay, approach) if distance > 0.0 else on_it


@kernel
def floating_speed(film_mm: float) -> float:
    """Returns the speed at which tyres begin to float on so much water; inf on less than 0.2 mm.

    V = 26.04 d^-0.259, in mph and inches, for less than 0.1 inch; deeper water counts as 0.1 inch.
    After Huebner, Reed and Henry, Criteria for Predicting Hydroplaning Potential, Journal of
    Transportation Engineering 112 (1986), as in PAVDRN of NCHRP 1-29; the paper's text was not found.
    """
    if film_mm < FILM_LEAST:
        return inf
    return float(MPH * 26.04 * (min(film_mm, FILM_MOST) / INCH_MM) ** -0.259)


@kernel
def lowest(limits: Floats, counted: int, most: float) -> tuple[float, int]:
    """Returns the lowest speed and its Binding; `most` and NONE where no limit is below it.

    limits: (n,) by Binding, inf: none; counted: those that count, as bits by Binding.
    """
    speed, binding = most, 0
    for name in range(len(limits)):
        if (counted >> name) & 1 and limits[name] < speed:
            speed, binding = limits[name], name
    return speed, binding
