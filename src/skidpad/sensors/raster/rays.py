"""Exact samples of the scene along given rays, in the same triangle loop as the images.

The rays of one sensor lie in the pyramid of a `View` whose pixels are cells: each triangle is
tested against the rays of the cells that its bounding box touches. Full detail, no tolerance.
Clusters and actors whose bounding sphere no ray meets are skipped before any vertex is projected.
"""

from __future__ import annotations

from math import floor
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.kernels.jit import inner_kernel, kernel
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
from skidpad.sensors.raster.rasteriser import Actors
from skidpad.sensors.raster.view import NEAR, View
from skidpad.sensors.scene.static import Chunks

SPHERE_MARGIN = 1e-3  # m, far more than rounding can move a ray past a bounding sphere


class Rays(NamedTuple):
    """n rays through a view, sorted into its cells."""

    column: Floats  # (n,) on screen
    row: Floats  # (n,)
    start: Ints32  # (width * height + 1,) rays of cell i are order[start[i]:start[i + 1]]
    order: Ints32  # (n,)
    x: Floats  # (n,) columns in this order: what is read together lies together
    y: Floats  # (n,) rows in this order


class Hits(NamedTuple):
    """What n rays met."""

    inverse: Floats  # (n,) 1/m, planar; 0 where nothing was met
    key: Ints32  # (n,) as in the images
    cosine: Floats  # (n,) of the angle of incidence, in [0, 1]


def make_rays(n: int, width: int, height: int) -> Rays:
    """Returns room for n rays in width x height cells."""
    return Rays(
        np.zeros(n),
        np.zeros(n),
        np.zeros(width * height + 1, dtype=np.int32),
        np.zeros(n, dtype=np.int32),
        np.zeros(n),
        np.zeros(n),
    )


def make_hits(n: int) -> Hits:
    """Returns arrays that have room for n hits."""
    return Hits(np.zeros(n), np.zeros(n, dtype=np.int32), np.zeros(n))


@inner_kernel
def sort_into_cells(view: View, rays: Rays) -> None:
    """Fills `start`, `order`, `x` and `y` from the rays' columns and rows (a counting sort)."""
    rays.start[:] = 0
    for i in range(rays.column.size):
        x = min(max(floor(rays.column[i]), 0), view.width - 1)
        y = min(max(floor(rays.row[i]), 0), view.height - 1)
        rays.start[y * view.width + x + 1] += 1
    for cell in range(rays.start.size - 1):
        rays.start[cell + 1] += rays.start[cell]
    for i in range(rays.column.size - 1, -1, -1):
        x = min(max(floor(rays.column[i]), 0), view.width - 1)
        y = min(max(floor(rays.row[i]), 0), view.height - 1)
        cell = y * view.width + x + 1
        rays.start[cell] -= 1
        at = rays.start[cell]
        rays.order[at], rays.x[at], rays.y[at] = i, rays.column[i], rays.row[i]
    for cell in range(rays.start.size - 1):
        rays.start[cell] = rays.start[cell + 1]
    rays.start[rays.start.size - 1] = rays.order.size


@inner_kernel
def _in_axes(view: View, point: Floats, shift: Floats) -> tuple[float, float, float]:
    """Returns a point (3,) of the world in camera axes."""
    r = view.rotation
    x = r[0, 0] * point[0] + r[0, 1] * point[1] + r[0, 2] * point[2] + shift[0]
    y = r[1, 0] * point[0] + r[1, 1] * point[1] + r[1, 2] * point[2] + shift[1]
    z = r[2, 0] * point[0] + r[2, 1] * point[1] + r[2, 2] * point[2] + shift[2]
    return x, y, z


@inner_kernel
def _is_touched(
    centre: Floats, radius: float, view: View, shift: Floats, rays: Rays, hits: Hits
) -> bool:
    """Returns whether any ray comes to within the sphere before its hit so far.

    Only rays of the cells that the sphere's box covers on screen are asked.
    """
    x, y, z = _in_axes(view, centre, shift)
    reach = radius + SPHERE_MARGIN
    near, far = z - reach, z + reach
    if near <= NEAR:
        return True
    left = view.cx + view.focal * (x - reach) / (near if x < reach else far)
    right = view.cx + view.focal * (x + reach) / (near if x > -reach else far)
    top = view.cy + view.focal * (y - reach) / (near if y < reach else far)
    bottom = view.cy + view.focal * (y + reach) / (near if y > -reach else far)
    first, last = floor(max(left, 0.0)), floor(min(right, view.width - 1.0))
    if first > last:
        return False
    nearest = 1.0 / near
    for row in range(floor(max(top, 0.0)), floor(min(bottom, view.height - 1.0)) + 1):
        base = row * view.width
        begin, end = np.uint64(rays.start[base + first]), np.uint64(rays.start[base + last + 1])
        for k in range(begin, end):
            if nearest <= hits.inverse[np.uint64(rays.order[k])]:
                continue
            u, v = (rays.x[k] - view.cx) / view.focal, (rays.y[k] - view.cy) / view.focal
            cross_x, cross_y, cross_z = y - z * v, z * u - x, x * v - y * u
            apart = cross_x * cross_x + cross_y * cross_y + cross_z * cross_z
            if apart <= reach * reach * (u * u + v * v + 1.0):
                return True
    return False


@inner_kernel
def _meet(
    x0: float, y0: float, w0: float, x1: float, y1: float, w1: float, x2: float, y2: float, w2: float,
    value: int, view: View, rays: Rays, hits: Hits,
) -> None:  # fmt: skip
    """Writes one projected triangle into `hits` of those rays that meet it nearer than before.

    x, y, w: column, row and inverse depth of its corners.
    """
    det = (x1 - x0) * (y2 - y0) - (x2 - x0) * (y1 - y0)
    if det == 0.0:
        return
    left = floor(max(min(x0, x1, x2), 0.0))
    right = floor(min(max(x0, x1, x2), view.width - 1.0))
    top = floor(max(min(y0, y1, y2), 0.0))
    bottom = floor(min(max(y0, y1, y2), view.height - 1.0))
    if left > right or top > bottom:
        return
    a = ((w1 - w0) * (y2 - y0) - (w2 - w0) * (y1 - y0)) / det
    b = ((x1 - x0) * (w2 - w0) - (x2 - x0) * (w1 - w0)) / det
    for y in range(top, bottom + 1):
        base = y * view.width
        first, end = np.uint64(rays.start[base + left]), np.uint64(rays.start[base + right + 1])
        for k in range(first, end):
            px, py = rays.x[k], rays.y[k]
            e0 = (x1 - x0) * (py - y0) - (y1 - y0) * (px - x0)
            e1 = (x2 - x1) * (py - y1) - (y2 - y1) * (px - x1)
            e2 = (x0 - x2) * (py - y2) - (y0 - y2) * (px - x2)
            inside = (e0 >= 0.0 and e1 >= 0.0 and e2 >= 0.0) or (
                e0 <= 0.0 and e1 <= 0.0 and e2 <= 0.0
            )
            if not inside:
                continue
            i = np.uint64(rays.order[k])
            w = w0 + a * (px - x0) + b * (py - y0)
            if w > hits.inverse[i]:
                hits.inverse[i] = w
                hits.key[i] = value
                hits.cosine[i] = _incidence(a, b, w, px, py, view)


@inner_kernel
def _incidence(a: float, b: float, w: float, px: float, py: float, view: View) -> float:
    """Returns the cosine between the ray and the normal of the plane whose inverse depth has slopes a, b.

    w: inverse depth; px, py: column and row.
    """
    u, v = (px - view.cx) / view.focal, (py - view.cy) / view.focal
    nx, ny = a * view.focal, b * view.focal
    nz = w - nx * u - ny * v
    return float(w / np.sqrt((nx * nx + ny * ny + nz * nz) * (u * u + v * v + 1.0)))


@inner_kernel
def _meet_block(
    triangles: Ints32,
    keys: Ints32,
    first: int,
    count: int,
    instance: int,
    view: View,
    scratch: Scratch,
    work: Floats,
    rays: Rays,
    hits: Hits,
) -> None:
    """Intersects the rays with `count` triangles of a block, clipped at the near plane, and updates hits."""
    screen, code = scratch.screen, scratch.code
    for t in range(first, first + count):
        a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        if code[a] & code[b] & code[c]:
            continue
        value = keys[t] | instance
        if (code[a] | code[b] | code[c]) & BEHIND:
            k = clip_near(a, b, c, view, scratch, work)
            for i in range(1, k - 1):
                _meet(
                    work[0, 0], work[0, 1], work[0, 2], work[i, 0], work[i, 1], work[i, 2],
                    work[i + 1, 0], work[i + 1, 1], work[i + 1, 2], value, view, rays, hits,
                )  # fmt: skip
        else:
            _meet(
                screen[a, 0], screen[a, 1], screen[a, 2], screen[b, 0], screen[b, 1], screen[b, 2],
                screen[c, 0], screen[c, 1], screen[c, 2], value, view, rays, hits,
            )  # fmt: skip


@kernel
def cast(
    chunks: Chunks,
    static_key: Ints32,
    actors: Actors,
    hidden: int,
    view: View,
    reach: float,
    scratch: Scratch,
    rays: Rays,
    hits: Hits,
) -> None:
    """Writes the nearest surface along every ray into `hits`; inverse depth 0 where there is none.

    hidden: the actor that carries the sensor, or -1. reach: chunks and actors wholly beyond it
    (m) are skipped; a hit beyond it may still be reported.
    """
    hits.inverse[:] = 0.0
    hits.key[:] = 0
    hits.cosine[:] = 0.0
    sort_into_cells(view, rays)
    sides = frustum_sides(view)
    work = np.empty((4, 3))
    shift = -rotated(view.rotation, view.centre)
    clusters = chunks.clusters
    for c in range(chunks.radius.size):
        offset = chunks.centre[c] - view.centre
        limit = reach + chunks.radius[c]
        if offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2 > limit * limit:
            continue
        if not sphere_visible(chunks.centre[c], chunks.radius[c], view, sides, shift):
            continue
        begin = chunks.cluster_start[c, 0]
        for j in range(begin, begin + chunks.cluster_count[c, 0]):
            if not _is_touched(clusters.centre[j], clusters.radius[j], view, shift, rays, hits):
                continue
            first, count = clusters.vertex_start[j], clusters.vertex_count[j]
            project_block(clusters.vertices, first, count, view.rotation, shift, view, scratch)
            first, count = clusters.triangle_start[j], clusters.triangle_count[j]
            _meet_block(
                clusters.triangles, static_key, first, count, 0, view, scratch, work, rays, hits
            )
    for n in range(actors.radius.size):
        if n == hidden or not actors.present[n]:
            continue
        if not sphere_visible(actors.position[n], actors.radius[n], view, sides, shift):
            continue
        if not _is_touched(actors.position[n], actors.radius[n], view, shift, rays, hits):
            continue
        turn = composed(view.rotation, actors.rotation[n])
        place = rotated(view.rotation, actors.position[n]) + shift
        first, count = actors.vertex_start[n], actors.vertex_count[n]
        project_block(actors.vertices, first, count, turn, place, view, scratch)
        first, count = actors.triangle_start[n], actors.triangle_count[n]
        instance = (n + 1) << 16
        _meet_block(
            actors.triangles, actors.key, first, count, instance, view, scratch, work, rays, hits
        )
