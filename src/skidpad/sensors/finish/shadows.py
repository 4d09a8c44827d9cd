"""Shadows under and beside vehicles and furniture, over a finished picture: for people only (R-13).

A pixel of the ground knows where it lies: its inverse depth says so. Near a body's outline it gets
less of the sky, and where the body stands between it and the sun, less of the sun. Depth and
classes stay as they are. Strengths are chosen by eye.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.camera import share_left
from skidpad.physics.optics import Air, air_depth
from skidpad.roads.roadside import Box, Shape
from skidpad.sensors.finish.outline import MOST, spans
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import ASPHALTS, FIELDS, MATERIALS, Material

GROUND = (
    *ASPHALTS,
    Material.SHOULDER,
    Material.MARKING,
    Material.SIDEWALK,
    Material.GRASS,
    Material.EMBANKMENT,
    Material.MEDIAN,
    *FIELDS,
)
REACH = 90.0  # m; farther shadows are a pixel or two
CONTACT, CONTACT_DARK = 0.5, 0.62  # m around the outline, share of light lost below the body
EDGE = 0.25  # m, how soft the sun's shadow ends
LONGEST = 8.0  # m of the sun's shadow beyond the body
FARTHEST = 25.0  # m from a hanging body, beyond which its shadow is not drawn
ROUNDED = 0.85  # of half the width of a crown: the radius of its shadow
SUN_DARK = 0.85  # share of the sun's light that a body keeps away
NO_SUN = 0.02  # share of the light below which the sun casts no shadow that is seen
LEVEL = 1.2  # m above or below, beyond which the ground is another road's
SLACK, SLOPE = 0.15, 0.05  # m and m per m by which the ground may lie off the body's own height
NARROWER = 0.94  # of its box is the outline of a body that casts a shadow: edges are rounded


class Bodies(NamedTuple):
    """What casts shadows: boxes, arrays of shape (n,)."""

    x: Floats
    y: Floats
    z: Floats
    yaw: Floats
    length: Floats
    width: Floats
    height: Floats
    present: NDArray[np.bool_]
    lift: Floats  # m of the lower side above the ground
    round: NDArray[np.bool_]  # the crown of a tree: a disc throws its shadow


class Shade(NamedTuple):
    """How light falls in one weather."""

    sun_x: float  # m of shadow per m of height, away from the sun
    sun_y: float
    sun: float  # share of the light that comes from the sun's direction
    air: Air  # between a shadow and the eye
    curved: float  # as in `Lighting`


def bodies_of(table: ActorTable, states: ActorStates) -> Bodies:
    """Returns the boxes of all actors but props."""
    present = states.present & (table.kind != ActorKind.PROP)
    return Bodies(
        states.x, states.y, states.z, states.yaw, table.length, table.width, table.height, present,
        np.zeros(len(table)), np.zeros(len(table), dtype=np.bool_),
    )  # fmt: skip


def standing(boxes: Sequence[Box]) -> Bodies:
    """Returns what stands beside the road as bodies.

    What stands on a post or a stem throws its shadow from there; other things over a road throw none.
    """

    def each(name: str) -> Floats:
        return np.array([getattr(b, name) for b in boxes], dtype=np.float64)

    foot: dict[tuple[float, float], float] = {}
    places = [(round(b.x, 1), round(b.y, 1)) for b in boxes]
    for place, box in zip(places, boxes, strict=True):
        foot[place] = min(box.z, foot.get(place, box.z))
    lift = [box.z - foot[place] for place, box in zip(places, boxes, strict=True)]
    return Bodies(
        each("x"), each("y"), each("z"), each("yaw"), each("length"), each("width"),
        each("height"), np.ones(len(boxes), dtype=np.bool_), np.array(lift, dtype=np.float64),
        np.array([b.shape in (Shape.CROWN, Shape.CONE) for b in boxes], dtype=np.bool_),
    )  # fmt: skip


def shade_of(light: Lighting) -> Shade:
    """Returns where shadows fall, and how dark they are."""
    direction, sun, sky = light.sun_direction, float(light.sun.mean()), float(light.sky.mean())
    up = max(float(direction[2]), 0.05)
    share = sun * max(float(direction[2]), 0.0) / max(sun * up + sky, 1e-6)
    x, y = -float(direction[0]) / up, -float(direction[1]) / up
    return Shade(x, y, share, light.air, light.curved)


GROUND_MASK = np.zeros(MATERIALS, dtype=np.bool_)  # by material: shadows are seen on it
GROUND_MASK[list(GROUND)] = True


class _Cast(NamedTuple):
    """One body and the end of its shadow, in the body's axes."""

    c: float
    s: float
    half_l: float
    half_w: float
    begin_x: float  # m by which the shadow begins beside the body: it hangs
    begin_y: float
    end_x: float
    end_y: float
    round: bool
    sun: float  # share of light that the sun's shadow takes away; 0: there is none


@inner_kernel
def _cast_of(bodies: Bodies, i: int, shade: Shade) -> _Cast:
    """Returns the shadow of body i: its rectangle, the throw along its axes in m and its darkness."""
    c, s = np.cos(bodies.yaw[i]), np.sin(bodies.yaw[i])
    throw = np.hypot(shade.sun_x, shade.sun_y)
    tall = bodies.height[i] * min(1.0, LONGEST / max(bodies.height[i] * throw, 1e-6))
    tx, ty = tall * shade.sun_x, tall * shade.sun_y
    lift = bodies.lift[i]
    dark = SUN_DARK * shade.sun if shade.sun > NO_SUN and lift * throw < FARTHEST else 0.0
    bx, by = lift * shade.sun_x, lift * shade.sun_y
    half_l, half_w = 0.5 * bodies.length[i], 0.5 * bodies.width[i]
    return _Cast(
        c, s, half_l, half_w, c * bx + s * by, -s * bx + c * by,
        c * tx + s * ty, -s * tx + c * ty, bodies.round[i], dark,
    )  # fmt: skip


@inner_kernel
def _corners(bodies: Bodies, i: int, cast: _Cast, out: Floats) -> None:
    """Writes (16, 3) corners of what a shadow can darken: the body's footprint and the shadow's end."""
    size = cast.half_l + cast.half_w
    if cast.sun > 0.0:
        size += np.hypot(cast.end_x, cast.end_y)
    slack = min(SLACK + SLOPE * size, LEVEL)
    k = 0
    for end in range(2):
        far = float(end) if cast.sun > 0.0 else 0.0
        for a in (-1.0, 1.0):
            for b in (-1.0, 1.0):
                lx = a * (cast.half_l + CONTACT) + cast.begin_x + far * cast.end_x
                ly = b * (cast.half_w + CONTACT) + cast.begin_y + far * cast.end_y
                for side in (-1.0, 1.0):
                    out[k, 0] = bodies.x[i] + cast.c * lx - cast.s * ly
                    out[k, 1] = bodies.y[i] + cast.s * lx + cast.c * ly
                    out[k, 2] = bodies.z[i] - bodies.lift[i] + side * slack
                    k += 1


@inner_kernel
def _outside(lx: float, ly: float, half_l: float, half_w: float) -> float:
    """Returns the distance in m to a box's outline, negative inside."""
    qx, qy = abs(lx) - half_l, abs(ly) - half_w
    if qx <= 0.0 or qy <= 0.0:
        return float(max(qx, qy))
    return float(np.sqrt(qx * qx + qy * qy))


@inner_kernel
def _beyond_shadow(cast: _Cast, lx: float, ly: float) -> float:
    """Returns the m to the outline that the box sweeps to the end of its shadow, negative inside.

    A swept box is bounded by its own two directions and by that of the way; beyond a corner the
    largest of the three is a little less than the distance.
    """
    px = lx - cast.begin_x - 0.5 * cast.end_x
    py = ly - cast.begin_y - 0.5 * cast.end_y
    if cast.round:
        return _beyond_disc(cast, px, py)
    half_l, half_w = NARROWER * cast.half_l, NARROWER * cast.half_w
    along = abs(px) - half_l - 0.5 * abs(cast.end_x)
    aside = abs(py) - half_w - 0.5 * abs(cast.end_y)
    way = np.sqrt(cast.end_x * cast.end_x + cast.end_y * cast.end_y)
    if way < 1e-6:
        return float(max(along, aside))
    nx, ny = -cast.end_y / way, cast.end_x / way
    across = abs(nx * px + ny * py) - half_l * abs(nx) - half_w * abs(ny)
    return float(max(along, aside, across))


@inner_kernel
def _beyond_disc(cast: _Cast, px: float, py: float) -> float:
    """Returns the m to the outline that a disc sweeps, negative inside; (px, py): from its middle."""
    square = cast.end_x * cast.end_x + cast.end_y * cast.end_y
    along = (px * cast.end_x + py * cast.end_y) / max(square, 1e-9)
    along = min(max(along, -0.5), 0.5)
    dx, dy = px - along * cast.end_x, py - along * cast.end_y
    return float(np.sqrt(dx * dx + dy * dy) - ROUNDED * min(cast.half_l, cast.half_w))


@inner_kernel
def _light_at(cast: _Cast, lx: float, ly: float, hangs: bool) -> float:
    """Returns the share of the light that reaches the ground at (lx, ly) in the body's axes.

    hangs: the body does not touch the ground.
    """
    light = 1.0
    near = (
        0.0 if hangs else (CONTACT - _outside(lx, ly, cast.half_l, cast.half_w)) / (1.6 * CONTACT)
    )
    if near > 0.0:
        near = min(near, 1.0)
        light = 1.0 - CONTACT_DARK * near * near
    if cast.sun > 0.0:
        dark = min((0.5 * EDGE - _beyond_shadow(cast, lx, ly)) / EDGE, 1.0)
        light *= 1.0 - cast.sun * max(dark, 0.0)
    return float(light)


@inner_kernel
def _dim_pixel(p: np.uint32, light: float) -> np.uint32:
    """Returns the packed pixel dimmed to the share `light` of its light.

    Its bytes are square roots of light, so they are multiplied by the root of `light`.
    """
    gain = np.float32(np.sqrt(light))  # the picture's bytes are square roots of light
    red, green, blue = unpack(p)
    return pack(red * gain, green * gain, blue * gain)


@inner_kernel
def _darken(
    view: View,
    bodies: Bodies,
    i: int,
    cast: _Cast,
    shade: Shade,
    rows: tuple[int, int],
    columns: NDArray[np.int64],
    ground: NDArray[np.bool_],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Draws one body's shadow into `out`, in the spans that it can reach, as much as the air lets through."""
    air, curved = shade.air, np.float32(shade.curved)
    r, per = view.rotation, 1.0 / view.focal
    ox, oy = view.centre[0] - bodies.x[i], view.centre[1] - bodies.y[i]
    oz = view.centre[2] - bodies.z[i] + bodies.lift[i]
    hangs = bodies.lift[i] > CONTACT
    x0, y0 = cast.c * ox + cast.s * oy, -cast.s * ox + cast.c * oy
    x_u = (cast.c * r[0, 0] + cast.s * r[0, 1]) * per
    y_u = (-cast.s * r[0, 0] + cast.c * r[0, 1]) * per
    z_u = r[0, 2] * per
    for row in range(rows[0], rows[1]):
        v = (row + 0.5 - view.cy) * per
        dx, dy, dz = r[1, 0] * v + r[2, 0], r[1, 1] * v + r[2, 1], r[1, 2] * v + r[2, 2]
        x_v, y_v = cast.c * dx + cast.s * dy, -cast.s * dx + cast.c * dy
        for column in range(columns[row, 0], columns[row, 1]):
            k = key[row, column]
            if (k >> 16) != 0 or not ground[k & 255]:
                continue
            w = inverse[row, column]
            if w <= 0.0:
                continue
            u, z = column + 0.5 - view.cx, 1.0 / w
            if abs(z * (dz + z_u * u) + oz) > LEVEL:
                continue
            lx, ly = z * (x_v + x_u * u) + x0, z * (y_v + y_u * u) + y0
            light = _light_at(cast, lx, ly, hangs)
            if light < 0.995:
                way = z * np.sqrt(1.0 + v * v + per * per * u * u)
                light = 1.0 - (1.0 - light) * share_left(np.float32(air_depth(air, way)), curved)
                out[row, column] = _dim_pixel(out[row, column], light)


@kernel
def cast_shadows(
    view: View,
    bodies: Bodies,
    shade: Shade,
    reach: float,
    ground: NDArray[np.bool_],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Darkens the ground in the rows of a view's picture `out`, packed as by `shade`; reach in m."""
    corners, points = np.empty((16, 3)), np.empty((MOST, 2))
    ring = np.empty(2 * MOST, dtype=np.int64)
    columns = np.empty((out.shape[0], 2), dtype=np.int64)
    for i in range(bodies.x.size):
        far = np.hypot(bodies.x[i] - view.centre[0], bodies.y[i] - view.centre[1]) > reach
        if far or not bodies.present[i]:
            continue
        cast = _cast_of(bodies, i, shade)
        _corners(bodies, i, cast, corners)
        rows = spans(view, corners, points, ring, columns)
        _darken(view, bodies, i, cast, shade, rows, columns, ground, inverse, key, out)
