"""GNSS, inertial unit and speedometer of a body, exact: what they would say without noise."""

from __future__ import annotations

import re
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import GnssFix, ImuReading
from skidpad.core.geometry import Pose
from skidpad.core.maths.constants import G
from skidpad.core.maths.geodesy import geolocation
from skidpad.core.states import ActorStates


def map_origin(geo_reference: str) -> tuple[float, float] | None:
    """Returns latitude and longitude in deg of a map's origin, as its projection text says; None without."""
    number = r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?"
    found = dict(re.findall(rf"\+(lat_0|lon_0)=({number})(?![\w.])", geo_reference))
    return (float(found["lat_0"]), float(found["lon_0"])) if len(found) == 2 else None


def compass(pose: Pose) -> float:
    """Returns rad clockwise from north, [0, 2 pi); north is +y."""
    return (pi / 2.0 - pose.yaw) % (2.0 * pi)


def gnss(antenna: Pose, origin: tuple[float, float]) -> GnssFix:
    """Returns the fix of an antenna in the world; origin: latitude and longitude of the map's, deg."""
    return GnssFix(*geolocation(antenna.x, antenna.y, *origin), antenna.z)


def imu(mount: Pose, states: ActorStates, i: int, gravity: float = G) -> ImuReading:
    """Returns what a unit mounted on actor i feels. gravity: m/s^2.

    The lever arm adds its centripetal acceleration; what changes of the yaw rate would add is left
    out. The road's curvature in height is not felt either: bodies have no vertical acceleration.
    """
    body = states.pose(i)
    rate = float(states.yaw_rate[i])
    ax = float(states.ax[i]) - rate * rate * mount.x
    ay = float(states.ay[i]) - rate * rate * mount.y
    c, s = cos(body.yaw), sin(body.yaw)
    force = np.array([ax * c - ay * s, ax * s + ay * c, gravity])
    return _measure_motion(body @ mount, force, rate)


def imu_at_rest(unit: Pose, gravity: float = G) -> ImuReading:
    """Returns what a unit feels that nothing carries. gravity: m/s^2."""
    return _measure_motion(unit, np.array([0.0, 0.0, gravity]), 0.0)


def _measure_motion(unit: Pose, force: NDArray[np.float64], rate: float) -> ImuReading:
    """Returns the reading of a unit. force: (3,) specific, in the world's axes; rate: rad/s about z."""
    to_sensor = unit.rotation().T
    fx, fy, fz = (to_sensor @ force).tolist()
    wx, wy, wz = (to_sensor @ np.array([0.0, 0.0, rate])).tolist()
    return ImuReading((fx, fy, fz), (wx, wy, wz), compass(unit))


def speed(states: ActorStates, i: int) -> float:
    """Returns the speed of actor i in m/s along its body, negative in reverse."""
    yaw = float(states.yaw[i])
    return float(states.vx[i]) * cos(yaw) + float(states.vy[i]) * sin(yaw)
