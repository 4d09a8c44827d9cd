"""The wheel's transforms and vectors to ours and back, through `core.maths.lefthanded` (decision X-4)."""

from __future__ import annotations

from typing import Any

from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import pose_from_carla, pose_to_carla, vector_from_carla


def to_transform(carla: Any, pose: Pose) -> Any:
    """Converts a pose to a carla.Transform."""
    x, y, z, roll, pitch, yaw = pose_to_carla(pose)
    return carla.Transform(
        carla.Location(x=x, y=y, z=z), carla.Rotation(pitch=pitch, yaw=yaw, roll=roll)
    )


def from_transform(transform: Any) -> Pose:
    """Converts a carla.Transform to a pose."""
    p, r = transform.location, transform.rotation
    return pose_from_carla(p.x, p.y, p.z, r.roll, r.pitch, r.yaw)


def to_vector(carla: Any, x: float, y: float, z: float = 0.0) -> Any:
    """Returns the carla.Vector3D of a velocity or place in our world axes."""
    return carla.Vector3D(*vector_from_carla(x, y, z))


def from_vector(vector: Any) -> tuple[float, float, float]:
    """Returns a carla vector as a place or velocity in our world axes."""
    return vector_from_carla(vector.x, vector.y, vector.z)
