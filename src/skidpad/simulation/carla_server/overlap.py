"""Do upright boxes overlap? Separating axes in the plane, intervals in height."""

from __future__ import annotations

from math import cos, sin

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.wire import Vector

Box = tuple[Pose, Vector]  # pose of the centre, half extents


def apart(a: Box, b: Box) -> bool:
    """Whether two boxes have no point in common."""
    (p, g), (q, h) = a, b
    if abs(p.z - q.z) > g[2] + h[2]:
        return True
    dx, dy = q.x - p.x, q.y - p.y
    turn = q.yaw - p.yaw
    c, s = abs(cos(turn)), abs(sin(turn))
    for pose, own, other, cross in (
        (p, g[0], h[0] * c + h[1] * s, False),
        (p, g[1], h[0] * s + h[1] * c, True),
        (q, h[0], g[0] * c + g[1] * s, False),
        (q, h[1], g[0] * s + g[1] * c, True),
    ):
        ux, uy = cos(pose.yaw), sin(pose.yaw)
        if cross:
            ux, uy = -uy, ux
        if abs(dx * ux + dy * uy) > own + other:
            return True
    return False
