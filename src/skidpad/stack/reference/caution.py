"""What a driver makes of road and air: the friction it is believed to have, and speeds that follow.

The driver sees what the road looks like, never its friction.
"""

from __future__ import annotations

from math import inf, sqrt

from skidpad.core.maths.constants import G
from skidpad.core.traffic.sight import RoadLook
from skidpad.stack.reference.following import Manner
from skidpad.stack.reference.person import Person

# Friction that a driver believes in, at 50, 90 and 130 km/h. Dry, wet (0.2 mm) and flooded (1 mm) with
# new tyres: Bosch Automotive Handbook, coefficients of static friction for pneumatic tyres. Snow and
# ice, the lower values: Noon (1994), Engineering Analysis of Vehicular Accidents.
SPEEDS = (50.0 / 3.6, 90.0 / 3.6, 130.0 / 3.6)  # m/s
BELIEFS: dict[RoadLook, tuple[float, float, float]] = {
    RoadLook.DRY: (0.85, 0.80, 0.75),
    RoadLook.WET: (0.65, 0.60, 0.55),
    RoadLook.FLOODED: (0.55, 0.30, 0.20),
    RoadLook.SNOW: (0.20, 0.20, 0.20),
    RoadLook.ICE: (0.10, 0.10, 0.10),
}
# Shares of that friction, as the background's drivers have them (simulation/world/traffic/care.py);
# the hardest braking leaves less, as the car has ABS.
COMFORT_SHARE, HARDEST_SHARE, DRIVE_SHARE, CURVE_SHARE = 0.25, 0.9, 0.25, 0.4
FIRM_SHARE = 0.6  # braking that is counted upon when something turns up
B_COMFORT, B_HARDEST = 2.0, 8.0  # m/s^2 at most
A_CURVE = 3.0  # m/s^2 in bends at most; see stack/control/bends.py
TOO_FAST_TIME, B_TOO_FAST = 0.7, 4.0  # s, m/s^2 at most; as the background (traffic/driver.py)
B_YELLOW = 3.0  # m/s^2, a yellow light that needs more is passed
STOP_MARGIN = 10.0  # m kept to what may stand at the end of sight
CAR_WIDTH = 1.8  # m, of what may stand there
LOOMING = 0.003  # rad/s, slower growth is not noticed: Hoffmann and Mortimer (1996)
STRAIGHT = 1e-5  # 1/m, less is no bend
HALVINGS = 8  # of the range of speeds within which one can stop in sight


def believed_friction(road: RoadLook, v: float) -> float:
    """Returns the friction coefficient that a driver expects of this road at speed v (m/s)."""
    low, middle, high = BELIEFS[road]
    slow, medium, fast = SPEEDS
    if v <= medium:
        share = min(max((v - slow) / (medium - slow), 0.0), 1.0)
        return low + share * (middle - low)
    share = min((v - medium) / (fast - medium), 1.0)
    return middle + share * (high - middle)


def manner(person: Person, road: RoadLook, v: float) -> Manner:
    """Returns how the person follows at v m/s on this road; the headway grows as friction falls."""
    g = G * believed_friction(road, v)
    left = believed_friction(road, v) / BELIEFS[RoadLook.DRY][0]
    return Manner(
        headway=person.headway / sqrt(min(left, 1.0)),
        a_max=min(person.a_max, DRIVE_SHARE * g),
        b=min(B_COMFORT, COMFORT_SHARE * g),
        a_min=max(-B_HARDEST, -HARDEST_SHARE * g),
    )


def speed_factor(road: RoadLook, v: float) -> float:
    """Returns the desired speed over that on a dry road: SUMO's friction device, as in the background."""
    left = min(believed_friction(road, v) / BELIEFS[RoadLook.DRY][0], 1.0)
    return min(-0.3491 * left * left + 0.8922 * left + 0.4493, 1.0)


def bend_speed(road: RoadLook, curvature: float) -> float:
    """Returns the m/s for a bend of `curvature` 1/m; inf on a straight."""
    bend = abs(curvature)
    if bend < STRAIGHT:
        return inf
    v = sqrt(A_CURVE / bend)
    for _ in range(2):  # friction is that of the speed found
        v = min(v, sqrt(CURVE_SHARE * G * believed_friction(road, v) / bend))
    return v


def too_fast(excess: float, road: RoadLook, v: float) -> float:
    """Returns the acceleration in m/s^2 that takes off `excess` m/s over a bend's or a limit's speed."""
    firm = min(B_TOO_FAST, FIRM_SHARE * G * believed_friction(road, v))
    return max(-excess / TOO_FAST_TIME, -firm)


def sight_speed(road: RoadLook, visibility: float, reaction: float, fastest: float) -> float:
    """Returns the m/s, at most `fastest`, from which one stops for what stands at the end of sight.

    visibility: m; reaction: s. What stands is recognised as standing when its image grows fast enough,
    however clear the air.
    """
    low, high = 0.0, fastest
    if _stops(road, visibility, reaction, high):
        return high
    for _ in range(HALVINGS):
        v = 0.5 * (low + high)
        low, high = (v, high) if _stops(road, visibility, reaction, v) else (low, v)
    return low


def _stops(road: RoadLook, visibility: float, reaction: float, v: float) -> bool:
    """Returns whether a driver at v in m/s can stop within what can be recognised ahead."""
    recognised = min(visibility, sqrt(CAR_WIDTH * v / LOOMING))
    b = FIRM_SHARE * G * believed_friction(road, v)
    return v * reaction + v * v / (2.0 * b) + STOP_MARGIN <= max(recognised, STOP_MARGIN + 1.0)
