"""CARLA's left-handed axes to ISO 8855 and back: the only place where a sign is flipped (X-4).

CARLA: x forward, y right, z up, degrees, yaw clockwise seen from above, pitch > 0 nose up,
steer > 0 right, azimuth > 0 right. ISO 8855: y left, radians, yaw counter-clockwise, pitch > 0
nose down, steer > 0 left, azimuth > 0 left. Every map is its own inverse up to units.
"""

from __future__ import annotations

from math import degrees, radians

from skidpad.core.geometry import Pose


def pose_from_carla(
    x: float, y: float, z: float, roll: float = 0.0, pitch: float = 0.0, yaw: float = 0.0
) -> Pose:
    """CARLA (left-handed, m, deg) to ISO 8855 (right-handed, m, rad)."""
    return Pose(x, -y, z, radians(roll), -radians(pitch), -radians(yaw))


def pose_to_carla(pose: Pose) -> tuple[float, float, float, float, float, float]:
    """ISO 8855 to CARLA: x, y, z in m, roll, pitch, yaw in deg."""
    return (
        pose.x,
        -pose.y,
        pose.z,
        degrees(pose.roll),
        -degrees(pose.pitch),
        -degrees(pose.yaw),
    )


def mirrored(value: float) -> float:
    """A steer, azimuth, yaw rate, lateral offset, curvature or y, in either direction."""
    return -value


def lanes_left_from_carla(offset: int) -> int:
    """CARLA-handed lane offset (+1 is one lane right) to lanes to the left."""
    return -offset
