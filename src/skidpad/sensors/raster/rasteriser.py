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

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.raster.projection import (
    BEHIND,
    Scratch,
    clip_near,
    composed,
    frustum_sides,
    project_block,
    rotated,
    sphere_visible,
)
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.static import Chunks

LEVEL_DISTANCE = (60.0, 150.0, 400.0)  # m from the camera to the chunk's sphere
AUTO_LEVEL = -1
BACKGROUND = int(SemanticClass.SKY) << 8 | int(Material.SKY)
SLIVER = 1e-7  # px^2, twice the area below which a triangle has no usable slope of depth


class Actors(NamedTuple):
    """n actors to draw, with the meshes of all of them one after the other."""

    vertices: Floats  # (V, 3) body frame
    triangles: Ints32  # (T, 3) relative to the actor's first vertex
    key: Ints32  # (T,) class << 8 | material
    vertex_start: Ints32  # (n,)
    vertex_count: Ints32
    triangle_start: Ints32
    triangle_count: Ints32
    radius: Floats  # (n,) around the origin
    rotation: Floats  # (n, 3, 3) body to world
    position: Floats  # (n, 3)
    present: NDArray[np.bool_]


@inner_kernel
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
    key: Ints32,
) -> None:
    """Draws a projected triangle where it is nearest: columns x, rows y, inverse depths w at its corners."""
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


@inner_kernel
def _draw_block(
    triangles: Ints32,
    keys: Ints32,
    first: int,
    count: int,
    instance: int,
    view: View,
    scratch: Scratch,
    clipped: Floats,
    inverse: NDArray[np.float32],
    key: Ints32,
) -> None:
    """Draws triangles whose vertices `project_block` has prepared into `inverse` and `key`.

    instance: row of the actor + 1, shifted left by 16; 0: the map.
    """
    screen, code, ramp = scratch.screen, scratch.code, scratch.ramp
    for t in range(first, first + count):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if code[a] & code[b] & code[c]:
            continue
        value = np.int32(keys[t] | instance)
        if (code[a] | code[b] | code[c]) & BEHIND:
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


@inner_kernel
def chunk_level(centre: Floats, radius: float, view: View, level: int) -> int:
    """Returns the level of detail of a chunk by its distance, or `level` unless that is negative."""
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
    static_key: Ints32,
    actors: Actors,
    hidden: int,
    view: View,
    level: int,
    scratch: Scratch,
    inverse: NDArray[np.float32],
    key: Ints32,
) -> None:
    """Draws the view's rows into `inverse` (H, W) and `key` (H, W), cleared there first.

    static_key: `chunks.key` with the lamps as they shine now. hidden: index of the actor that is
    not drawn, or -1. level: a level of detail for all chunks, or AUTO_LEVEL.
    """
    inverse[view.top : view.height] = np.float32(0.0)
    key[view.top : view.height] = BACKGROUND
    sides = frustum_sides(view)
    clipped = np.empty((4, 3))
    shift = -rotated(view.rotation, view.centre)
    clusters = chunks.clusters
    for c in range(chunks.radius.size):
        if not sphere_visible(chunks.centre[c], chunks.radius[c], view, sides, shift):
            continue
        k = chunk_level(chunks.centre[c], chunks.radius[c], view, level)
        first = chunks.cluster_start[c, k]
        for j in range(first, first + chunks.cluster_count[c, k]):
            if not sphere_visible(clusters.centre[j], clusters.radius[j], view, sides, shift):
                continue
            project_block(
                clusters.vertices,
                clusters.vertex_start[j],
                clusters.vertex_count[j],
                view.rotation,
                shift,
                view,
                scratch,
            )
            _draw_block(
                clusters.triangles,
                static_key,
                clusters.triangle_start[j],
                clusters.triangle_count[j],
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
