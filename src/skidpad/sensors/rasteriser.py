"""From triangles to one int32 key and one float32 inverse depth per pixel.

key = instance << 16 | class << 8 | material; semantic and instance images are views of it. Spans
are half open at pixel centres and every edge is evaluated from its upper to its lower end, so two
triangles that share an edge neither leave a gap nor fight for a pixel. Edge set-up in float64,
spans in float32, no fast-math: the same bytes on every processor.
"""

from __future__ import annotations

from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import kernel
from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.materials import Material
from skidpad.sensors.scene import Chunks
from skidpad.sensors.view import NEAR, View

LEVEL_DISTANCE = (60.0, 150.0, 400.0)  # m from the camera to the chunk's sphere
AUTO_LEVEL = -1
BACKGROUND = int(SemanticClass.SKY) << 8 | int(Material.SKY)
SLIVER = 1e-7  # px^2, twice the area below which a triangle has no usable slope of depth

_LEFT, _RIGHT, _UP, _DOWN, _BEHIND = 1, 2, 4, 8, 16

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


class Actors(NamedTuple):
    """n actors to draw, with the meshes of all of them one after the other."""

    vertices: Floats  # (V, 3) body frame
    triangles: Ints  # (T, 3) relative to the actor's first vertex
    key: Ints  # (T,) class << 8 | material
    vertex_start: Ints  # (n,)
    vertex_count: Ints
    triangle_start: Ints
    triangle_count: Ints
    radius: Floats  # (n,) around the origin
    rotation: Floats  # (n, 3, 3) body to world
    position: Floats  # (n, 3)
    present: NDArray[np.bool_]


class Scratch(NamedTuple):
    """Working memory for the vertices of one block."""

    camera: Floats  # (m, 3) camera axes, m
    screen: Floats  # (m, 3) column, row, inverse depth
    code: NDArray[np.uint8]  # (m,) which planes of the frustum the vertex lies beyond
    ramp: NDArray[np.float32]  # (width,) 0, 1, 2, ...


def make_scratch(largest_block: int, width: int) -> Scratch:
    """Room for blocks of so many vertices and images of so many columns."""
    return Scratch(
        np.empty((largest_block, 3)),
        np.empty((largest_block, 3)),
        np.empty(largest_block, dtype=np.uint8),
        np.arange(width, dtype=np.float32),
    )


@kernel
def _fill(
    x0: float,
    y0: float,
    w0: float,
    x1: float,
    y1: float,
    w1: float,
    x2: float,
    y2: float,
    w2: float,
    value: np.int32,
    first_row: int,
    end_row: int,
    ramp: NDArray[np.float32],
    inverse: NDArray[np.float32],
    key: Ints,
) -> None:
    """Draw one projected triangle: columns x, rows y, inverse depths w at its corners."""
    width = inverse.shape[1]
    top = max(first_row, ceil(min(y0, y1, y2) - 0.5))
    bottom = min(end_row, ceil(max(y0, y1, y2) - 0.5))
    if top >= bottom:
        return
    if max(x0, x1, x2) <= 0.5 or min(x0, x1, x2) > width - 0.5:
        return
    det = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if abs(det) > SLIVER:
        slope_x = ((w1 - w0) * (y2 - y0) - (w2 - w0) * (y1 - y0)) / det
        slope_y = ((x1 - x0) * (w2 - w0) - (x2 - x0) * (w1 - w0)) / det
        anchor = w0 - slope_x * x0 - slope_y * y0
    else:
        slope_x = 0.0
        slope_y = 0.0
        anchor = (w0 + w1 + w2) / 3.0
    if y1 < y0:
        x0, y0, x1, y1 = x1, y1, x0, y0
    if y2 < y0:
        x0, y0, x2, y2 = x2, y2, x0, y0
    if y2 < y1:
        x1, y1, x2, y2 = x2, y2, x1, y1
    long_edge = (x2 - x0) / (y2 - y0)
    upper_edge = (x1 - x0) / (y1 - y0) if y1 > y0 else 0.0
    lower_edge = (x2 - x1) / (y2 - y1) if y2 > y1 else 0.0
    step = np.float32(slope_x)
    for row in range(top, bottom):
        yc = row + 0.5
        xa = x0 + (yc - y0) * long_edge
        if yc < y1:
            xb = x0 + (yc - y0) * upper_edge
        else:
            xb = x1 + (yc - y1) * lower_edge
        first = ceil(max(min(xa, xb), 0.0) - 0.5)
        last = ceil(min(max(xa, xb), float(width)) - 0.5)
        if first >= last:
            continue
        start = np.float32(anchor + slope_x * (first + 0.5) + slope_y * yc)
        depths = inverse[row, first:last]
        keys = key[row, first:last]
        for i in range(depths.size):
            w = start + step * ramp[i]
            nearer = w > depths[i]
            depths[i] = w if nearer else depths[i]
            keys[i] = value if nearer else keys[i]


@kernel
def project_block(
    vertices: Floats,
    first: int,
    count: int,
    turn: Floats,
    shift: Floats,
    view: View,
    scratch: Scratch,
) -> None:
    """Vertices to camera axes, screen and frustum codes. turn, shift: their frame to camera."""
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
            code |= _LEFT
        if f * x - right * z > 0.0:
            code |= _RIGHT
        if f * y + up * z < 0.0:
            code |= _UP
        if f * y - down * z > 0.0:
            code |= _DOWN
        if z < NEAR:
            code |= _BEHIND
        w = 1.0 / z
        scratch.camera[i, 0] = x
        scratch.camera[i, 1] = y
        scratch.camera[i, 2] = z
        scratch.screen[i, 0] = cx + f * x * w
        scratch.screen[i, 1] = cy + f * y * w
        scratch.screen[i, 2] = w
        scratch.code[i] = code


@kernel
def clip_near(a: int, b: int, c: int, view: View, scratch: Scratch, out: Floats) -> int:
    """Corners (k, 3) of the part of a triangle beyond the near plane, on screen; k is 0, 3 or 4."""
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


@kernel
def _draw_block(
    triangles: Ints,
    keys: Ints,
    first: int,
    count: int,
    instance: int,
    view: View,
    scratch: Scratch,
    clipped: Floats,
    inverse: NDArray[np.float32],
    key: Ints,
) -> None:
    """Draw triangles whose vertices `project_block` has prepared."""
    screen, code, ramp = scratch.screen, scratch.code, scratch.ramp
    for t in range(first, first + count):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if code[a] & code[b] & code[c]:
            continue
        value = np.int32(keys[t] | instance)
        if (code[a] | code[b] | code[c]) & _BEHIND:
            k = clip_near(a, b, c, view, scratch, clipped)
            for i in range(1, k - 1):
                _fill(
                    clipped[0, 0],
                    clipped[0, 1],
                    clipped[0, 2],
                    clipped[i, 0],
                    clipped[i, 1],
                    clipped[i, 2],
                    clipped[i + 1, 0],
                    clipped[i + 1, 1],
                    clipped[i + 1, 2],
                    value,
                    view.top,
                    view.height,
                    ramp,
                    inverse,
                    key,
                )
        else:
            _fill(
                screen[a, 0],
                screen[a, 1],
                screen[a, 2],
                screen[b, 0],
                screen[b, 1],
                screen[b, 2],
                screen[c, 0],
                screen[c, 1],
                screen[c, 2],
                value,
                view.top,
                view.height,
                ramp,
                inverse,
                key,
            )


@kernel
def sphere_visible(centre: Floats, radius: float, view: View, sides: Floats, shift: Floats) -> bool:
    """Whether any of a sphere may lie in the frustum. sides: (4,) lengths of the side normals."""
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


@kernel
def frustum_sides(view: View) -> Floats:
    """(4,) lengths of the inward normals of the left, right, upper and lower plane."""
    sides = np.empty(4)
    sides[0] = np.hypot(view.focal, view.cx)
    sides[1] = np.hypot(view.focal, view.width - view.cx)
    sides[2] = np.hypot(view.focal, view.cy - view.top)
    sides[3] = np.hypot(view.focal, view.height - view.cy)
    return sides


@kernel
def rotated(m: Floats, v: Floats) -> Floats:
    """m @ v of a (3, 3) and a (3,), in a fixed order of additions."""
    out = np.empty(3)
    for i in range(3):
        out[i] = m[i, 0] * v[0] + m[i, 1] * v[1] + m[i, 2] * v[2]
    return out


@kernel
def composed(a: Floats, b: Floats) -> Floats:
    """a @ b of two (3, 3), in a fixed order of additions."""
    out = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            out[i, j] = a[i, 0] * b[0, j] + a[i, 1] * b[1, j] + a[i, 2] * b[2, j]
    return out


@kernel
def chunk_level(centre: Floats, radius: float, view: View, level: int) -> int:
    """The level of detail of a chunk, unless one is prescribed."""
    if level >= 0:
        return level
    dx, dy, dz = (
        centre[0] - view.centre[0],
        centre[1] - view.centre[1],
        centre[2] - view.centre[2],
    )
    distance = np.sqrt(dx * dx + dy * dy + dz * dz) - radius
    chosen = 0
    for limit in LEVEL_DISTANCE:
        if distance > limit:
            chosen += 1
    return chosen


@kernel
def raster(
    chunks: Chunks,
    static_key: Ints,
    actors: Actors,
    hidden: int,
    view: View,
    level: int,
    scratch: Scratch,
    inverse: NDArray[np.float32],
    key: Ints,
) -> None:
    """Draw the view's rows into `inverse` (H, W) and `key` (H, W), cleared there first.

    static_key: `chunks.key` with the lamps as they shine now. hidden: index of the actor that is
    not drawn, or -1. level: a level of detail for all chunks, or AUTO_LEVEL.
    """
    inverse[view.top : view.height] = np.float32(0.0)
    key[view.top : view.height] = BACKGROUND
    sides = frustum_sides(view)
    clipped = np.empty((4, 3))
    shift = -rotated(view.rotation, view.centre)
    for c in range(chunks.radius.size):
        if not sphere_visible(chunks.centre[c], chunks.radius[c], view, sides, shift):
            continue
        k = chunk_level(chunks.centre[c], chunks.radius[c], view, level)
        project_block(
            chunks.vertices,
            chunks.vertex_start[c, k],
            chunks.vertex_count[c, k],
            view.rotation,
            shift,
            view,
            scratch,
        )
        _draw_block(
            chunks.triangles,
            static_key,
            chunks.triangle_start[c, k],
            chunks.triangle_count[c, k],
            0,
            view,
            scratch,
            clipped,
            inverse,
            key,
        )
    for n in range(actors.radius.size):
        if n == hidden or not actors.present[n]:
            continue
        if not sphere_visible(actors.position[n], actors.radius[n], view, sides, shift):
            continue
        turn = composed(view.rotation, actors.rotation[n])
        place = rotated(view.rotation, actors.position[n]) + shift
        project_block(
            actors.vertices,
            actors.vertex_start[n],
            actors.vertex_count[n],
            turn,
            place,
            view,
            scratch,
        )
        _draw_block(
            actors.triangles,
            actors.key,
            actors.triangle_start[n],
            actors.triangle_count[n],
            (n + 1) << 16,
            view,
            scratch,
            clipped,
            inverse,
            key,
        )
