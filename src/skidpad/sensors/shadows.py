"""Shadows under and beside vehicles, drawn over a finished picture: for people, never for a stack.

A pixel of the ground knows where it lies: its inverse depth says so. Near a body's outline it gets
less of the sky, and where the body stands between it and the sun, less of the sun. Depth and
classes stay as they are (decision R-13). Strengths are chosen by eye.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import kernel
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.sensors.lighting import Lighting
from skidpad.sensors.materials import MATERIALS, Material
from skidpad.sensors.view import View

Floats = NDArray[np.float64]

GROUND = (
    Material.ASPHALT,
    Material.SHOULDER,
    Material.MARKING,
    Material.SIDEWALK,
    Material.GRASS,
    Material.EMBANKMENT,
    Material.MEDIAN,
)
REACH = 90.0  # m; farther shadows are a pixel or two
CONTACT, CONTACT_DARK = 0.5, 0.62  # m around the outline, share of light lost below the body
EDGE = 0.25  # m, how soft the sun's shadow ends
LONGEST = 8.0  # m of the sun's shadow beyond the body
SUN_DARK = 0.85  # share of the sun's light that a body keeps away
LEVEL = 1.2  # m above or below, beyond which the ground is another road's
STEPS = 4  # copies of the outline between body and the end of its shadow


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


class Shade(NamedTuple):
    """How light falls in one weather."""

    sun_x: float  # m of shadow per m of height, away from the sun
    sun_y: float
    sun: float  # share of the light that comes from the sun's direction


def bodies_of(table: ActorTable, states: ActorStates) -> Bodies:
    """The boxes of all who take part."""
    present = states.present & (table.kind != ActorKind.PROP)
    return Bodies(
        states.x, states.y, states.z, states.yaw, table.length, table.width, table.height, present
    )


def shade_of(light: Lighting) -> Shade:
    """Where shadows fall, and how dark they are."""
    direction, sun, sky = light.sun_direction, float(light.sun.mean()), float(light.sky.mean())
    up = max(float(direction[2]), 0.05)
    share = sun * max(float(direction[2]), 0.0) / max(sun * up + sky, 1e-6)
    return Shade(-float(direction[0]) / up, -float(direction[1]) / up, share)


GROUND_MASK = np.zeros(MATERIALS, dtype=np.bool_)  # by material: shadows are seen on it
GROUND_MASK[list(GROUND)] = True


@kernel
def _outside(lx: float, ly: float, half_l: float, half_w: float) -> float:
    """Distance in m to a box's outline, negative inside."""
    qx, qy = abs(lx) - half_l, abs(ly) - half_w
    beyond = np.sqrt(max(qx, 0.0) ** 2 + max(qy, 0.0) ** 2)
    return float(beyond + min(max(qx, qy), 0.0))


@kernel
def _window(view: View, bodies: Bodies, i: int, shade: Shade, out: NDArray[np.int64]) -> bool:
    """First and end row, first and end column in which a body's shadow can lie; False: none."""
    r = view.rotation
    long = min(bodies.height[i] * np.hypot(shade.sun_x, shade.sun_y), LONGEST)
    reach = 0.5 * np.hypot(bodies.length[i], bodies.width[i]) + CONTACT + long
    left, right, top, bottom = np.inf, -np.inf, np.inf, -np.inf
    behind = 0
    for n in range(8):
        angle = n * np.pi / 4.0
        dx = bodies.x[i] + 1.1 * reach * np.cos(angle) - view.centre[0]
        dy = bodies.y[i] + 1.1 * reach * np.sin(angle) - view.centre[1]
        dz = bodies.z[i] - view.centre[2]
        depth = r[2, 0] * dx + r[2, 1] * dy + r[2, 2] * dz
        if depth < 0.3:
            behind += 1
            continue
        u = view.cx + view.focal * (r[0, 0] * dx + r[0, 1] * dy + r[0, 2] * dz) / depth
        v = view.cy + view.focal * (r[1, 0] * dx + r[1, 1] * dy + r[1, 2] * dz) / depth
        left, right, top, bottom = min(left, u), max(right, u), min(top, v), max(bottom, v)
    if behind == 8:
        return False
    width = int(2.0 * view.cx)
    if behind:
        left, right, bottom = 0.0, float(width), float(view.height)
    out[0], out[1] = max(int(top) - 2, view.top), min(int(bottom) + 3, view.height)
    out[2], out[3] = max(int(left) - 1, 0), min(int(right) + 2, width)
    return bool(out[0] < out[1] and out[2] < out[3])


@kernel
def _light_at(bodies: Bodies, i: int, shade: Shade, dx: float, dy: float) -> float:
    """Share of the light that reaches the ground at (dx, dy) from a body's centre."""
    c, s = np.cos(bodies.yaw[i]), np.sin(bodies.yaw[i])
    lx, ly = c * dx + s * dy, -s * dx + c * dy
    half_l, half_w = 0.5 * bodies.length[i], 0.5 * bodies.width[i]
    near = (CONTACT - _outside(lx, ly, half_l, half_w)) / (1.6 * CONTACT)
    near = min(max(near, 0.0), 1.0)
    light = 1.0 - CONTACT_DARK * near * near
    tall = bodies.height[i] * min(1.0, LONGEST / max(
        bodies.height[i] * np.hypot(shade.sun_x, shade.sun_y), 1e-6))  # fmt: skip
    tx, ty = tall * shade.sun_x, tall * shade.sun_y
    ox, oy = c * tx + s * ty, -s * tx + c * ty
    dark = 0.0
    for n in range(1, STEPS + 1):
        t = n / STEPS
        small = 1.0 - 0.18 * t  # roofs are smaller than floors
        d = _outside(lx - t * ox, ly - t * oy, small * half_l, small * half_w)
        dark = max(dark, min(max((0.5 * EDGE - d) / EDGE, 0.0), 1.0))
    return float(light * (1.0 - SUN_DARK * shade.sun * dark))


@kernel
def cast_shadows(
    view: View,
    bodies: Bodies,
    shade: Shade,
    ground: NDArray[np.bool_],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Darken the ground in the rows of a view's picture, packed as by `shade`."""
    r = view.rotation
    window = np.zeros(4, dtype=np.int64)
    for i in range(bodies.x.size):
        far = np.hypot(bodies.x[i] - view.centre[0], bodies.y[i] - view.centre[1]) > REACH
        if far or not bodies.present[i] or not _window(view, bodies, i, shade, window):
            continue
        for row in range(window[0], window[1]):
            v = (row + 0.5 - view.cy) / view.focal
            for column in range(window[2], window[3]):
                k = key[row, column]
                w = inverse[row, column]
                if w <= 0.0 or (k >> 16) != 0 or not ground[k & 255]:
                    continue
                z = 1.0 / w
                px, py = z * (column + 0.5 - view.cx) / view.focal, z * v
                dx = r[0, 0] * px + r[1, 0] * py + r[2, 0] * z + view.centre[0] - bodies.x[i]
                dy = r[0, 1] * px + r[1, 1] * py + r[2, 1] * z + view.centre[1] - bodies.y[i]
                dz = r[0, 2] * px + r[1, 2] * py + r[2, 2] * z + view.centre[2] - bodies.z[i]
                if abs(dz) > LEVEL:
                    continue
                light = _light_at(bodies, i, shade, dx, dy)
                if light < 0.995:
                    gain = np.sqrt(light)  # the picture's bytes are square roots of light
                    p = np.int64(out[row, column])
                    red = int((p & 255) * gain)
                    green = int(((p >> 8) & 255) * gain)
                    blue = int(((p >> 16) & 255) * gain)
                    out[row, column] = np.uint32(red | green << 8 | blue << 16 | 0xFF000000)
