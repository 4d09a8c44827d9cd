"""Short runs of triangles with a bounding sphere each: what a sensor cannot see costs one test.

A road chunk around the ego reaches 24 m ahead and behind; a radar's cone and a camera's picture
hold a few of its strips. Runs keep the order of the triangles, so nothing changes in a picture.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints32

SIZE = 16  # triangles: 16 m of one lane at full detail
MARGIN = 1e-6  # m, more than rounding can put a vertex outside its sphere


class Clusters(NamedTuple):
    """K runs of at most SIZE triangles with V vertices of their own and T triangles in all."""

    vertices: Floats  # (V, 3) world, m
    triangles: Ints32  # (T, 3) indices relative to the cluster's first vertex
    centre: Floats  # (K, 3)
    radius: Floats  # (K,)
    vertex_start: Ints32  # (K,)
    vertex_count: Ints32  # (K,)
    triangle_start: Ints32  # (K,)
    triangle_count: Ints32  # (K,)


def cluster(vertices: Floats, triangles: Ints32, block_size: Ints32) -> tuple[Clusters, Ints32]:
    """Cut blocks of consecutive triangles into clusters; also how many each block has.

    vertices: (V, 3); triangles: (T, 3) indices into them; block_size: (B,) triangles, T in all.
    """
    per_block = (-(-block_size // SIZE)).astype(np.int32)
    block_first = np.repeat(np.cumsum(block_size) - block_size, block_size)
    place = (np.arange(len(triangles)) - block_first) // SIZE
    number = np.repeat(np.cumsum(per_block) - per_block, block_size) + place
    pairs = number[:, None].astype(np.int64) * len(vertices) + triangles
    distinct, corner = np.unique(pairs, return_inverse=True)
    points = vertices[distinct % len(vertices)]
    count = int(per_block.sum())
    vertex_count = np.bincount(distinct // len(vertices), minlength=count)
    vertex_start = np.cumsum(vertex_count) - vertex_count
    low, high = np.minimum.reduceat(points, vertex_start), np.maximum.reduceat(points, vertex_start)
    centre = (low + high) / 2.0
    reach = np.linalg.norm(points - np.repeat(centre, vertex_count, axis=0), axis=1)
    triangle_count = np.bincount(number, minlength=count)
    relative = corner.reshape(-1, 3) - vertex_start[number][:, None]
    clusters = Clusters(
        points,
        relative.astype(np.int32),
        centre,
        np.maximum.reduceat(reach, vertex_start) + MARGIN,
        vertex_start.astype(np.int32),
        vertex_count.astype(np.int32),
        (np.cumsum(triangle_count) - triangle_count).astype(np.int32),
        triangle_count.astype(np.int32),
    )
    return clusters, per_block
