"""CARLA's left-handed axes to ISO 8855 and back: the only place where a sign is flipped (X-4).

CARLA: x forward, y right, z up, degrees, yaw clockwise seen from above, pitch > 0 nose up,
steer > 0 right, azimuth > 0 right. ISO 8855: y left, radians, yaw counter-clockwise, pitch > 0
nose down, steer > 0 left, azimuth > 0 left. Every map is its own inverse up to units.
"""

from __future__ import annotations

from math import degrees, pi, radians

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose


def pose_from_carla(
    x: float, y: float, z: float, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
) -> Pose:
    """Returns the ISO 8855 pose (right-handed, m, rad) of one of CARLA (left-handed, m, deg)."""
    return Pose(x, -y, z, radians(roll), -radians(pitch), -radians(yaw))


def pose_to_carla(pose: Pose) -> tuple[float, float, float, float, float, float]:
    """Returns the CARLA pose of one of ISO 8855: x, y, z in m, roll, pitch, yaw in deg."""
    return (
        pose.x,
        -pose.y,
        pose.z,
        degrees(pose.roll),
        -degrees(pose.pitch),
        180.0 if pose.yaw == pi else -degrees(pose.yaw),  # CARLA's range is (-180, 180]
    )


def vector_from_carla(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Returns a place, velocity or force in the other axes; its own inverse."""
    return (x, -y, z)


def turn_from_carla(x: float, y: float, z: float) -> tuple[float, float, float]:
    """Returns a rate of rotation about x, y, z, or a torque, in the other axes; its own inverse, no unit."""
    return (x, -y, -z)


def poses_to_carla(
    x: Floats, y: Floats, z: Floats, roll: Floats, pitch: Floats, yaw: Floats
) -> Floats:
    """Returns (n, 6) CARLA's x, y, z in m, pitch, yaw, roll in deg, in the order of its snapshots.

    Arguments: (n,) each, in m and rad, in ISO 8855 axes.
    """
    turned = np.where(yaw == pi, 180.0, np.degrees(-yaw))  # in (-180, 180]
    return np.column_stack((x, -y, z, np.degrees(-pitch), turned, np.degrees(roll)))


def vectors_to_carla(x: Floats, y: Floats, z: Floats) -> Floats:
    """Returns (n, 3) places, velocities or forces from ISO columns."""
    return np.column_stack((x, -y, z))


def turns_to_carla(x: Floats, y: Floats, z: Floats) -> Floats:
    """Returns (n, 3) rates of rotation from ISO columns, no unit changed."""
    return np.column_stack((x, -y, -z))


def angles_to_carla(angle: Floats) -> Floats:
    """Returns azimuths (n,) in rad in CARLA's left-handed frame: negated."""
    return -angle


def mirror_value(value: float) -> float:
    """Returns a steer, azimuth, yaw rate, lateral offset, curvature or y in the other axes, either way."""
    return -value


def lanes_left_from_carla(offset: int) -> int:
    """Returns a CARLA-handed lane offset (+1 is one lane right) as lanes to the left."""
    return -offset
