"""The shapes that travel in calls: readers that refuse wrong ones, and writers.

Structs are positional arrays; poses cross here from CARLA's axes to ISO 8855 and back, by
`core.maths.lefthanded` alone.
"""

from __future__ import annotations

from math import degrees, isfinite, radians
from typing import Any

from skidpad.core.errors import BackendError
from skidpad.core.geometry import Pose
from skidpad.core.maths.lefthanded import (
    mirror_value,
    pose_from_carla,
    pose_to_carla,
    turn_from_carla,
    vector_from_carla,
)

Vector = tuple[float, float, float]
FLOAT_MAX = 1.0e12  # beyond this a client's number is a mistake, not a place or a force


class WireError(BackendError):
    """A call whose arguments cannot be used; its text is the client's error."""


def number(value: Any, field: str) -> float:
    """Returns the value as a float, a finite number up to FLOAT_MAX; WireError for any other."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise WireError(f"{field} must be a number")
    if not isfinite(value) or abs(value) > FLOAT_MAX:
        raise WireError(f"{field} must be finite and below {FLOAT_MAX:g}")
    return float(value)


def integer(value: Any, field: str, low: int = 0, high: int = 2**64 - 1) -> int:
    """Returns the value, an integer in [low, high] (64 bits without sign by default).

    WireError for others.
    """
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise WireError(f"{field} must be an integer between {low} and {high}")
    return value


def flag(value: Any, field: str) -> bool:
    """Returns a truth value; 0 and 1 are accepted, WireError for any other."""
    if value not in (0, 1):
        raise WireError(f"{field} must be true or false")
    return bool(value)


def text(value: Any, field: str, longest: int = 4096) -> str:
    """Returns the value, a text of bounded length; raises WireError for any other."""
    if not isinstance(value, str) or len(value) > longest:
        raise WireError(f"{field} must be a text of at most {longest} characters")
    return value


def items(value: Any, field: str, size: int | None = None) -> list[Any]:
    """Returns the value, an array, of `size` members when given; WireError for any other."""
    if not isinstance(value, list) or (size is not None and len(value) != size):
        raise WireError(f"{field} must be an array" + (f" of {size}" if size is not None else ""))
    return value


def numbers(value: Any, field: str, size: int | None = None) -> list[float]:
    """Returns the value, an array of finite numbers, as floats; WireError for any other."""
    return [number(v, field) for v in items(value, field, size)]


def vector(value: Any, field: str) -> Vector:
    """Returns a Vec3 as it came: CARLA's axes, the client's unit."""
    x, y, z = numbers(value, field, 3)
    return (x, y, z)


def iso_vector(value: Any, field: str) -> Vector:
    """Returns a Vec3 of positions, velocities or forces, in ISO axes."""
    return vector_from_carla(*vector(value, field))


def iso_turn(value: Any, field: str) -> Vector:
    """Returns an angular velocity in deg/s, or any axial vector in degrees, as ISO rad."""
    x, y, z = turn_from_carla(*vector(value, field))
    return (radians(x), radians(y), radians(z))


def iso_steer(steer: float) -> float:
    """Returns a steer command or angle, right positive, as ISO; and back."""
    return mirror_value(steer)


def iso_to_wire(v: Vector) -> Vector:
    """Returns an ISO 8855 vector in CARLA's axes."""
    return vector_from_carla(*v)


def yaw_to_wire(yaw: float) -> float:
    """Returns a yaw in rad as CARLA's degrees, right positive."""
    return mirror_value(degrees(yaw))


def pose(value: Any, field: str) -> Pose:
    """Returns the ISO 8855 pose of a Transform on the wire; WireError for another shape."""
    location, rotation = items(value, field, 2)
    x, y, z = numbers(location, f"{field}.location", 3)
    pitch, yaw, roll = numbers(rotation, f"{field}.rotation", 3)
    return pose_from_carla(x, y, z, roll=roll, pitch=pitch, yaw=yaw)


def transform(place: Pose) -> list[list[float]]:
    """Returns an ISO 8855 pose as a Transform on the wire."""
    x, y, z, roll, pitch, yaw = pose_to_carla(place)
    return [[x, y, z], [pitch, yaw, roll]]


def optional(value: Any, field: str) -> Any | None:
    """Returns the content of an optional as it is, None when empty; WireError for another shape."""
    if isinstance(value, list) and len(value) == 1 and value[0] is False:
        return None
    if isinstance(value, list) and len(value) == 2 and value[0] is True:
        return value[1]
    raise WireError(f"{field} must be an optional")


def some(value: Any | None) -> list[Any]:
    """Returns an optional value as on the wire: [False] for None, else [True, value]."""
    return [False] if value is None else [True, value]


def box(centre: Vector, half: Vector, yaw_deg: float = 0.0) -> list[list[float]]:
    """Returns a BoundingBox as on the wire: centre, half extents in m, rotation; all in CARLA's axes."""
    return [list(centre), list(half), [0.0, yaw_deg, 0.0]]
