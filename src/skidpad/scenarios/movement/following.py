"""The kernel of a scripted actor on its lane: its place there, and the pedals and steer of its driver."""

from __future__ import annotations

from math import cos, nan, pi, sin

from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.roads.along import advance_point
from skidpad.roads.kernels import LaneArrays
from skidpad.simulation.scripted import Hands, drive_by

Followed = tuple[
    int, float, float, float, float, float, float, float, float, float, float, float
]  # lane, s, offset, x, y, z, heading, curvature, width; throttle, brake, steer


@kernel
def follow_lane(
    map: Held[LaneArrays], hands: Held[Hands],
    lane: int, s: float, px: float, py: float, heading: float, curvature: float,
    x: float, y: float, yaw: float, vx: float, vy: float,
    v: float, a: float, along: float, offset: float, offset_rate: float, offset_bend: float,
) -> Followed:  # fmt: skip
    """Returns the point of the lane abreast of (x, y), and pedals and steer that keep to it.

    The same as `Guide.demand` and `ActorDriver.command` forwards. lane, s, px, py, heading, curvature: the
    point before; beyond the road's end the lane is -1, and it is braked for the point before.
    """
    return follow(
        map.value, hands.value, lane, s, px, py, heading, curvature, x, y, yaw, vx, vy,
        v, a, along, offset, offset_rate, offset_bend,
    )  # fmt: skip


@inner_kernel
def follow(
    map: LaneArrays, hands: Hands,
    lane: int, s: float, px: float, py: float, heading: float, curvature: float,
    x: float, y: float, yaw: float, vx: float, vy: float,
    v: float, a: float, along: float, offset: float, offset_rate: float, offset_bend: float,
) -> Followed:  # fmt: skip
    """Returns what `follow_lane` does, for hands or a record with their fields."""
    c, s_ = cos(heading), sin(heading)
    point = advance_point(map, lane, s, (x - px) * c + (y - py) * s_, nan)
    if point[0] < 0:
        v, a = 0.0, 0.0
    else:
        px, py, heading, curvature = point[3], point[4], point[6], point[7]
    if along <= 0.0:
        heading = heading + pi
    c, s_ = cos(heading), sin(heading)
    left = (y - py) * c - (x - px) * s_
    drift = vy * c - vx * s_
    pedals = drive_by(
        hands, yaw, vx, vy, v, a, along * curvature, left - along * offset,
        drift - along * offset_rate, along * offset_bend,
    )  # fmt: skip
    return (
        point[0], point[1], point[2], point[3], point[4], point[5], point[6], point[7], point[8],
        pedals[0], pedals[1], pedals[2],
    )  # fmt: skip
