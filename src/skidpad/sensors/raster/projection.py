"""From vertices to the screen of a view: frustum tests, projection, clipping.

Edge set-up in float64 and in a fixed order of additions: the same bytes on every processor.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.raster.canvas import Canvas, make_canvas
from skidpad.sensors.raster.view import NEAR, View

LEFT, RIGHT, UP, DOWN, BEHIND = 1, 2, 4, 8, 16  # planes of the frustum, as bits


class Scratch(NamedTuple):
    """Working memory for the vertices of one block."""

    camera: Floats  # (m, 3) camera axes, m
    screen: Floats  # (m, 3) column, row, inverse depth
    code: NDArray[np.uint8]  # (m,) which planes of the frustum the vertex lies beyond
    canvas: Canvas


def make_scratch(largest_block: int, width: int) -> Scratch:
    """Returns room for blocks of so many vertices and images of so many columns."""
    return Scratch(
        np.empty((largest_block, 3)),
        np.empty((largest_block, 3)),
        np.empty(largest_block, dtype=np.uint8),
        make_canvas(width),
    )


@inner_kernel
def project_block(
    vertices: Floats,
    first: int,
    count: int,
    turn: Floats,
    shift: Floats,
    view: View,
    scratch: Scratch,
) -> None:
    """Writes `count` vertices from `first` on to rows 0 to count - 1 of `scratch`.

    A row has camera axes in m, column and row in px, inverse depth, and a code of the planes of sight
    that it lies beyond. turn (3, 3), shift (3,): from the frame of the vertices to the camera.
    """
    m00, m01, m02 = turn[0, 0], turn[0, 1], turn[0, 2]
    m10, m11, m12 = turn[1, 0], turn[1, 1], turn[1, 2]
    m20, m21, m22 = turn[2, 0], turn[2, 1], turn[2, 2]
    t0, t1, t2 = shift[0], shift[1], shift[2]
    f, cx, cy = view.focal, view.cx, view.cy
    right, up, down = view.width - cx, cy - view.top, view.height - cy
    for i in range(count):
        vx, vy, vz = vertices[first + i, 0], vertices[first + i, 1], vertices[first + i, 2]
        x = m00 * vx + m01 * vy + m02 * vz + t0
        y = m10 * vx + m11 * vy + m12 * vz + t1
        z = m20 * vx + m21 * vy + m22 * vz + t2
        code = 0
        if f * x + cx * z < 0.0:
            code |= LEFT
        if f * x - right * z > 0.0:
            code |= RIGHT
        if f * y + up * z < 0.0:
            code |= UP
        if f * y - down * z > 0.0:
            code |= DOWN
        if z < NEAR:
            code |= BEHIND
        w = 1.0 / z
        scratch.camera[i, 0] = x
        scratch.camera[i, 1] = y
        scratch.camera[i, 2] = z
        scratch.screen[i, 0] = cx + f * x * w
        scratch.screen[i, 1] = cy + f * y * w
        scratch.screen[i, 2] = w
        scratch.code[i] = code


@inner_kernel
def clip_near(a: int, b: int, c: int, view: View, scratch: Scratch, out: Floats) -> int:
    """Writes the corners (k, 3) on screen of a triangle's part beyond the near plane into `out`; returns k.

    k is 0, 3 or 4. a, b, c: vertices in `scratch`.
    """
    corners = (a, b, c)
    k = 0
    for e in range(3):
        i, j = corners[e], corners[(e + 1) % 3]
        zi, zj = scratch.camera[i, 2], scratch.camera[j, 2]
        if zi >= NEAR:
            out[k, 0] = scratch.screen[i, 0]
            out[k, 1] = scratch.screen[i, 1]
            out[k, 2] = scratch.screen[i, 2]
            k += 1
        if (zi >= NEAR) != (zj >= NEAR):
            if zi < NEAR:  # always from the far end, so that both triangles of an edge agree
                i, j = j, i
                zi, zj = zj, zi
            t = (zi - NEAR) / (zi - zj)
            x = scratch.camera[i, 0] + t * (scratch.camera[j, 0] - scratch.camera[i, 0])
            y = scratch.camera[i, 1] + t * (scratch.camera[j, 1] - scratch.camera[i, 1])
            out[k, 0] = view.cx + view.focal * x / NEAR
            out[k, 1] = view.cy + view.focal * y / NEAR
            out[k, 2] = 1.0 / NEAR
            k += 1
    return k


@inner_kernel
def sphere_visible(centre: Floats, radius: float, view: View, sides: Floats, shift: Floats) -> bool:
    """Returns whether any of a sphere may lie in the frustum. sides: (4,) lengths of the side normals.

    shift: (3,) of the world's origin in camera axes.
    """
    r = view.rotation
    x = r[0, 0] * centre[0] + r[0, 1] * centre[1] + r[0, 2] * centre[2] + shift[0]
    y = r[1, 0] * centre[0] + r[1, 1] * centre[1] + r[1, 2] * centre[2] + shift[1]
    z = r[2, 0] * centre[0] + r[2, 1] * centre[1] + r[2, 2] * centre[2] + shift[2]
    f = view.focal
    if z < NEAR - radius:
        return False
    if f * x + view.cx * z < -radius * sides[0]:
        return False
    if f * x - (view.width - view.cx) * z > radius * sides[1]:
        return False
    if f * y + (view.cy - view.top) * z < -radius * sides[2]:
        return False
    return bool(f * y - (view.height - view.cy) * z <= radius * sides[3])


@inner_kernel
def frustum_sides(view: View) -> Floats:
    """Returns (4,) lengths of the inward normals of the left, right, upper and lower plane."""
    sides = np.empty(4)
    sides[0] = np.hypot(view.focal, view.cx)
    sides[1] = np.hypot(view.focal, view.width - view.cx)
    sides[2] = np.hypot(view.focal, view.cy - view.top)
    sides[3] = np.hypot(view.focal, view.height - view.cy)
    return sides


@inner_kernel
def rotated(m: Floats, v: Floats) -> Floats:
    """Returns m @ v of a (3, 3) and a (3,), in a fixed order of additions."""
    out = np.empty(3)
    for i in range(3):
        out[i] = m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2]
    return out


@inner_kernel
def composed(a: Floats, b: Floats) -> Floats:
    """Returns a @ b of two (3, 3), in a fixed order of additions."""
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out
