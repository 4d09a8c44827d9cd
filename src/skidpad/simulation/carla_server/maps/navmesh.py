"""The navigation mesh that the client's own pedestrian navigation loads: one tile of Detour.

Layout after the public headers of Recast and Detour (DetourNavMesh.h, tile version 7, 32-bit
references) and the set file of its sample; little-endian. Axes are the client's with y and z
swapped: (x, up, y). Corners of a polygon run clockwise there, which is counter-clockwise in ours.
"""

from __future__ import annotations

import hashlib
import struct

import numpy as np
from numpy.typing import NDArray

from skidpad.core.maths.lefthanded import vectors_to_carla
from skidpad.roads.walkable import CORNERS, WalkMesh

SET_MAGIC, SET_VERSION = 0x4D534554, 1  # "MSET"
TILE_MAGIC, TILE_VERSION = 0x444E4156, 7  # "DNAV"
NO_LINK = 0xFFFFFFFF
MAX_VERTICES, MAX_POLYGONS = 0xFFFF, 0x7FFF  # 16-bit indices; the top bit marks other tiles
WALKABLE = (1.8, 0.3, 0.4)  # m: height, radius, climb of a pedestrian (CARLA's height and radius)
MARGIN = 1.0  # m around the mesh
CELL = 0.05  # m, raster of the search tree
Boxes = NDArray[np.int64]  # (n, 6): lower and upper corner

VERTEX = np.dtype("<f4")
POLYGON = np.dtype(
    [
        ("link", "<u4"),
        ("corners", "<u2", CORNERS),
        ("beyond", "<u2", CORNERS),  # polygon index + 1
        ("flags", "<u2"),
        ("size", "u1"),
        ("area", "u1"),
    ]
)
DETAIL = np.dtype([("vertex", "<u4"), ("triangle", "<u4"), ("sizes", "u1", 2), ("pad", "<u2")])
NODE = np.dtype([("lower", "<u2", 3), ("upper", "<u2", 3), ("i", "<i4")])
LINK_SIZE = 12


def file_name(map_name: str, content: bytes) -> str:
    """Returns a file name by map and content, because clients keep files by name for ever."""
    return f"{map_name}-{hashlib.sha256(content).hexdigest()[:16]}.nav"


def pack_mesh(mesh: WalkMesh) -> bytes | None:
    """Returns the mesh as a file of Recast's; None when it is too large for one tile."""
    n = len(mesh.polygons)
    if n > MAX_POLYGONS or len(mesh.vertices) > MAX_VERTICES:
        return None
    x, y, z = vectors_to_carla(*mesh.vertices.T).T
    points = np.column_stack((x, z, y)).astype(VERTEX)
    lower, upper = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    tile = _tile(mesh, points, lower, upper)
    width, _, depth = (upper - lower).tolist()
    head = struct.pack("<3i", SET_MAGIC, SET_VERSION, 1)
    grid = struct.pack("<5f2i", *lower.tolist(), width, depth, 1, n)
    reference = 1 << (n - 1).bit_length()  # first salt, tile 0, polygon 0
    return head + grid + struct.pack("<Ii", reference, len(tile)) + tile


def _tile(mesh: WalkMesh, points: NDArray[np.float32], lower: object, upper: object) -> bytes:
    """Returns the bytes of a Detour mesh tile that holds the whole mesh within the two corners."""
    low, high = np.asarray(lower, dtype=VERTEX), np.asarray(upper, dtype=VERTEX)
    n, sizes = len(mesh.polygons), [len(ring) for ring in mesh.polygons]
    cell = max(CELL, float((high - low).max()) / 65000.0)
    tree = _tree(mesh, points, low, cell)
    counts = (n, len(points), sum(sizes), n, 0, sum(sizes) - 2 * n, len(tree), 0, n)
    head = struct.pack("<6i9i", TILE_MAGIC, TILE_VERSION, 0, 0, 0, 0, *counts)
    head += struct.pack("<10f", *WALKABLE, *low.tolist(), *high.tolist(), 1.0 / cell)
    links = bytes(LINK_SIZE * sum(sizes))
    details, triangles = _details(sizes)
    parts = (head, points.tobytes(), _polygons(mesh).tobytes(), links)
    return b"".join(parts) + details.tobytes() + triangles.tobytes() + tree.tobytes()


def _polygons(mesh: WalkMesh) -> NDArray[np.void]:
    """Returns the table of polygons (n,): corners, neighbours + 1, flags, size and area."""
    table = np.zeros(len(mesh.polygons), dtype=POLYGON)
    table["link"] = NO_LINK
    rows = zip(mesh.polygons, mesh.neighbours(), mesh.areas, strict=True)
    for row, (ring, beyond, area) in zip(table, rows, strict=True):
        size = len(ring)
        row["corners"][:size] = ring
        row["beyond"][:size] = np.array(beyond) + 1
        row["flags"], row["size"], row["area"] = 1 << int(area), size, int(area)
    return table


def _details(sizes: list[int]) -> tuple[NDArray[np.void], NDArray[np.uint8]]:
    """Returns details and triangles that triangulate each polygon: a fan around its first corner.

    A triangle's last byte says which of its edges lie on the polygon's outline, two bits for each.
    """
    details = np.zeros(len(sizes), dtype=DETAIL)
    details["sizes"][:, 1] = np.array(sizes) - 2
    details["triangle"] = np.cumsum(details["sizes"][:, 1]) - details["sizes"][:, 1]
    triangles = []
    for size in sizes:
        for k in range(2, size):
            outline = (k == 2) | 1 << 2 | (k == size - 1) << 4
            triangles.append((0, k - 1, k, outline))
    return details, np.array(triangles, dtype=np.uint8)


def _tree(
    mesh: WalkMesh, points: NDArray[np.float32], low: NDArray[np.float32], cell: float
) -> NDArray[np.void]:
    """Returns bounding boxes in depth-first order; a negative index skips that many nodes.

    low: corner of the mesh; cell: m of the raster.
    """
    boxes = np.array(
        [
            np.concatenate((points[list(r)].min(axis=0), points[list(r)].max(axis=0)))
            for r in mesh.polygons
        ]
    )
    raster = (boxes - np.concatenate((low, low))) / cell
    raster[:, :3], raster[:, 3:] = np.floor(raster[:, :3]), np.ceil(raster[:, 3:])
    nodes: list[tuple[NDArray[np.int64], int]] = []
    _grow(raster.astype(np.int64), np.arange(len(boxes)), nodes)
    table = np.zeros(len(nodes), dtype=NODE)
    for row, (box, i) in zip(table, nodes, strict=True):
        row["lower"], row["upper"], row["i"] = box[:3], box[3:], i
    return table


def _grow(boxes: Boxes, members: NDArray[np.int64], nodes: list[tuple[Boxes, int]]) -> None:
    """Appends a tree of boxes: an index is a polygon at leaves, minus the node's count elsewhere.

    members: polygons below the node that is appended first.
    """
    mine = boxes[members]
    around = np.concatenate((mine[:, :3].min(axis=0), mine[:, 3:].max(axis=0)))
    if len(members) == 1:
        nodes.append((around, int(members[0])))
        return
    here = len(nodes)
    nodes.append((around, 0))
    axis = 0 if around[3] - around[0] > around[5] - around[2] else 2
    order = members[np.argsort(mine[:, axis], kind="stable")]
    half = len(order) // 2
    _grow(boxes, order[:half], nodes)
    _grow(boxes, order[half:], nodes)
    nodes[here] = (around, here - len(nodes))
