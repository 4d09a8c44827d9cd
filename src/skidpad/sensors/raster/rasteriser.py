"""From triangles to one int32 key and one float32 inverse depth per pixel.

key = instance << 16 | class << 8 | material; semantic and instance images are views of it. Near chunks
are drawn first and what they hide is skipped; of equally near triangles the first of the map is seen, so
the order changes no picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.raster.canvas import KEY, clear, fill, rows_at_once, settle
from skidpad.sensors.raster.occlusion import Tiles, is_block_hidden, is_sphere_hidden, make_tiles
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
from skidpad.sensors.scene.static import Chunks

LEVEL_DISTANCE = (60.0, 150.0, 400.0)  # m from the camera to the chunk's sphere
AUTO_LEVEL = -1
BAND, BANDS = 16.0, 32  # m of distance that are drawn in the map's order; the last band is endless
MOST_RANKS = 0x7FFF


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
def _draw_block(
    triangles: Ints32,
    keys: Ints32,
    first: int,
    count: int,
    instance: int,
    rank: int,
    view: View,
    scratch: Scratch,
    clipped: Floats,
) -> None:
    """Draws triangles whose vertices `project_block` has prepared into the canvas of `scratch`.

    instance: row of the actor + 1, shifted left by 16; 0: the map.
    """
    screen, code, canvas = scratch.screen, scratch.code, scratch.canvas
    for t in range(first, first + count):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if code[a] & code[b] & code[c]:
            continue
        value = np.int32(~(keys[t] | instance) if instance > 0 else rank | keys[t])
        limit = np.int32(0x7FFFFFFF if instance > 0 else value | KEY)
        if (code[a] | code[b] | code[c]) & BEHIND:
            k = clip_near(a, b, c, view, scratch, clipped)
            for i in range(1, k - 1):
                fill(
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
                    limit,
                    view,
                    canvas,
                )
        else:
            fill(
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
                limit,
                view,
                canvas,
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
    shift = -rotated(view.rotation, view.centre)
    order, rank, band = sort_chunks(chunks, view, frustum_sides(view), shift)
    rows = rows_at_once(view.width)
    for top in range(view.top, view.height, rows):
        part = View(
            view.width, min(top + rows, view.height), view.focal, view.cx, view.cy, view.rotation,
            view.centre, top,
        )  # fmt: skip
        sides = frustum_sides(part)
        clear(part, scratch.canvas)
        tiles = make_tiles(part, scratch.canvas.inverse)
        _draw_map(chunks, static_key, order, rank, band, part, level, sides, shift, scratch, tiles)
        _draw_actors(actors, hidden, part, sides, shift, scratch, tiles)
        settle(part, scratch.canvas, inverse, key)


@inner_kernel
def _draw_map(
    chunks: Chunks,
    static_key: Ints32,
    order: Ints32,
    rank: Ints32,
    band: Ints32,
    view: View,
    level: int,
    sides: Floats,
    shift: Floats,
    scratch: Scratch,
    tiles: Tiles,
) -> None:
    """Draws chunks in an order, with their bands of distance, into the canvas of `scratch`."""
    clipped = np.empty((4, 3))
    clusters = chunks.clusters
    for at in range(order.size):
        c = order[at]
        if not sphere_visible(chunks.centre[c], chunks.radius[c], view, sides, shift):
            continue
        if is_sphere_hidden(chunks.centre[c], chunks.radius[c], band[at], view, shift, tiles):
            continue
        k = chunk_level(chunks.centre[c], chunks.radius[c], view, level)
        first = chunks.cluster_start[c, k]
        for j in range(first, first + chunks.cluster_count[c, k]):
            if not sphere_visible(clusters.centre[j], clusters.radius[j], view, sides, shift):
                continue
            if is_sphere_hidden(
                clusters.centre[j], clusters.radius[j], band[at], view, shift, tiles
            ):
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
            if is_block_hidden(clusters.vertex_count[j], band[at], view, scratch, tiles):
                continue
            _draw_block(
                clusters.triangles,
                static_key,
                clusters.triangle_start[j],
                clusters.triangle_count[j],
                0,
                rank[at] << 16,
                view,
                scratch,
                clipped,
            )


@inner_kernel
def _draw_actors(
    actors: Actors,
    hidden: int,
    view: View,
    sides: Floats,
    shift: Floats,
    scratch: Scratch,
    tiles: Tiles,
) -> None:
    """Draws the actors but `hidden` into the canvas of `scratch`, on which the map is drawn."""
    clipped = np.empty((4, 3))
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
        if is_block_hidden(actors.vertex_count[n], BANDS + 1, view, scratch, tiles):
            continue
        _draw_block(
            actors.triangles,
            actors.key,
            actors.triangle_start[n],
            actors.triangle_count[n],
            (n + 1) << 16,
            0,
            view,
            scratch,
            clipped,
        )


@inner_kernel
def sort_chunks(
    chunks: Chunks, view: View, sides: Floats, shift: Floats
) -> tuple[Ints32, Ints32, Ints32]:
    """Returns the chunks in sight, near ones first, their ranks in the map's order, and their bands.

    A band of distance is 1 or more. So many chunks that ranks have no room are in the map's order.
    """
    start = np.zeros(BANDS + 2, dtype=np.int32)
    found, away = np.empty(chunks.radius.size, np.int32), np.empty(chunks.radius.size, np.int32)
    n = 0
    for c in range(chunks.radius.size):
        if not sphere_visible(chunks.centre[c], chunks.radius[c], view, sides, shift):
            continue
        dx = chunks.centre[c, 0] - view.centre[0]
        dy = chunks.centre[c, 1] - view.centre[1]
        dz = chunks.centre[c, 2] - view.centre[2]
        distance = np.sqrt(dx * dx + dy * dy + dz * dz) - chunks.radius[c]
        found[n], away[n] = c, 1 + int(min(max(distance / BAND, 0.0), BANDS - 1.0))
        start[away[n] + 1] += 1
        n += 1
    if n > MOST_RANKS:
        return found[:n], np.zeros(n, np.int32), np.ones(n, np.int32)
    for b in range(1, BANDS + 1):
        start[b + 1] += start[b]
    order, rank, band = np.empty(n, np.int32), np.empty(n, np.int32), np.empty(n, np.int32)
    for m in range(n):
        at = start[away[m]]
        order[at], rank[at], band[at] = found[m], m, away[m]
        start[away[m]] += 1
    return order, rank, band
