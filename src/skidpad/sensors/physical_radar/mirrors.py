"""Upright surfaces beside a road that mirror a radar's wave, and the way by one of them (image method)."""

from __future__ import annotations

from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel
from skidpad.physics.mirrors import RAIL_SHARE, WALL_ROUGHNESS, fresnel_across, smooth_share
from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside, Shape
from skidpad.sensors.object_level.boxes import (
    WallGroups,
    Walls,
    group_walls,
    walls_in_view,
    walls_of,
)

HOUSES = (Shape.BOX, Shape.BLOCK, Shape.HOUSE)
LEAST_SIDE = 5.0  # m, sides of boxes that are long enough to mirror: an assumption


class Mirrors(NamedTuple):
    """Upright surfaces that mirror a wave."""

    walls: Walls
    groups: WallGroups
    rail: NDArray[np.bool_]  # (n,) steel of a guardrail; else concrete


class Reflection(NamedTuple):
    """One way from the antenna by a mirror to a point."""

    way: tuple[float, float, float]  # m, from the antenna to the point's image
    foot: tuple[float, float, float]  # m, from the antenna to where the mirror is met
    nx: float  # the mirror's normal
    ny: float
    power: float  # share that one reflection leaves; 0: the mirror is not met


def mirrors_of(roadside: Roadside) -> Mirrors:
    """Returns the guardrails, walls and sides of houses beside a road."""
    steel = tuple(b for b in roadside.barriers if b.kind is BarrierKind.GUARDRAIL)
    stone = [b for b in roadside.barriers if b.kind is BarrierKind.WALL]
    stone += [_sides_of(b) for b in roadside.boxes if b.solid and b.shape in HOUSES
              and max(b.length, b.width) >= LEAST_SIDE]  # fmt: skip
    walls = walls_of(Roadside(barriers=steel + tuple(stone)))
    rails = sum(len(b.points) - 1 for b in steel)
    return Mirrors(walls, group_walls(walls), np.arange(len(walls.x0)) < rails)


def _sides_of(box: Box) -> Barrier:
    """Returns the four sides of a box as one wall around it."""
    c, s = np.cos(box.yaw), np.sin(box.yaw)
    along = np.array([1.0, 1.0, -1.0, -1.0, 1.0]) * box.length / 2.0
    aside = np.array([-1.0, 1.0, 1.0, -1.0, -1.0]) * box.width / 2.0
    points = np.column_stack(
        [box.x + c * along - s * aside, box.y + s * along + c * aside, np.full(5, box.z)]
    )
    return Barrier(BarrierKind.WALL, points, box.height)


@inner_kernel
def mirrors_near(
    mirrors: Mirrors, origin: Floats, yaw: float, slope: float, reach: float
) -> NDArray[np.int64]:
    """Returns the mirrors in the antenna's view, without those that it is edge-on to."""
    room = np.empty(mirrors.walls.x0.size, np.int64)
    n = walls_in_view(origin, yaw, slope, mirrors.walls, mirrors.groups, reach, room)
    return room[:n]


@inner_kernel
def reflect(
    mirrors: Mirrors, w: int, origin: Floats, point: tuple[float, float, float],
    permittivity: complex, wave_number: float,
) -> Reflection:  # fmt: skip
    """Returns the way by mirror `w` from the antenna to a point; its power is 0 where there is none."""
    none = Reflection((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0, 0.0)
    walls = mirrors.walls
    ex, ey = walls.x1[w] - walls.x0[w], walls.y1[w] - walls.y0[w]
    length = sqrt(ex * ex + ey * ey)
    if length == 0.0:
        return none
    ex, ey = ex / length, ey / length
    ax, ay = origin[0] - walls.x0[w], origin[1] - walls.y0[w]
    px, py = point[0] - walls.x0[w], point[1] - walls.y0[w]
    a, b = ex * ay - ey * ax, ex * py - ey * px  # m, distances to the left of the mirror
    if a * b <= 0.0:
        return none
    share = a / (a + b)
    at = (ex * ax + ey * ay) * (1.0 - share) + (ex * px + ey * py) * share
    if at < 0.0 or at > length:
        return none
    high = origin[2] + (point[2] - origin[2]) * share
    rise = high - walls.z0[w] - at / length * (walls.z1[w] - walls.z0[w])
    if rise < 0.0 or rise > walls.height[w]:
        return none
    nx, ny = -ey, ex
    way = (point[0] - 2.0 * b * nx - origin[0], point[1] - 2.0 * b * ny - origin[1],
           point[2] - origin[2])  # fmt: skip
    if mirrors.rail[w]:
        power = RAIL_SHARE
    else:
        sine = (abs(a) + abs(b)) / sqrt(way[0] ** 2 + way[1] ** 2 + way[2] ** 2)
        amplitude = abs(fresnel_across(permittivity, sine))
        power = (amplitude * smooth_share(WALL_ROUGHNESS, sine, wave_number)) ** 2
    foot = (share * way[0], share * way[1], share * way[2])
    return Reflection(way, foot, nx, ny, power)
