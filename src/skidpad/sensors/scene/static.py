"""The static world as triangles in chunks with bounding spheres and levels of detail."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, groupby, islice
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.maths.randomness import stream_key
from skidpad.core.vocabulary import LightState, SemanticClass
from skidpad.roads.lanes import LaneSamples, LaneTable
from skidpad.roads.roadside import Roadside, Shape
from skidpad.roads.terrain import CELL, COARSE, FINE, Heights, terrain_of
from skidpad.sensors.scene.furniture import cell, furniture_pieces, lamp_mesh
from skidpad.sensors.scene.grain import NO_GRAIN, grain_table
from skidpad.sensors.scene.materials import END_FREE, Material, base_palette
from skidpad.sensors.scene.mesh import Mesh, merge, quads
from skidpad.sensors.scene.road_mesh import LEVELS, ChunkKey, road_pieces
from skidpad.sensors.scene.street_light import StreetLight, street_light_of

BULGE = (0.002, 0.002, 0.005, 0.03)  # m, what counts as flat at each level
APRON = 4000.0  # m, flat land beyond it, out to the horizon
FARMED_FROM = 75.0  # m from the nearest lane to the middle of a tile
FIELD = (3, 2)  # tiles of 48 m, along and across
GROWN = (Material.GRASS, Material.HAY, Material.GRASS, Material.CROP, Material.PLOUGHED)
ROAD_STEP = 8  # samples of a lane, of which one is looked at
EVERGREEN = (Shape.CONE, Shape.HEDGE, Shape.WOOD)
SIZE = 16  # triangles: 16 m of one lane at full detail
BATCH = 1024  # chunks that are meshes at a time, while a map is packed
MARGIN = 1e-6  # m, more than rounding can put a vertex outside its sphere
# A lamp lights up in its own colour; everything else is dark.
LIT: dict[LightState, tuple[int, Material]] = {
    LightState.RED: (0, Material.LAMP_RED),
    LightState.YELLOW: (1, Material.LAMP_YELLOW),
    LightState.GREEN: (2, Material.LAMP_GREEN),
}


Block = list[list[Mesh]]  # the pieces of a chunk, each a mesh per level


class Chunks(NamedTuple):
    """C chunks of T triangles in all; level l of chunk c is a block of them, cut into clusters."""

    clusters: Clusters
    key: Ints32  # (T,) class << 8 | material
    centre: Floats  # (C, 3)
    radius: Floats  # (C,)
    triangle_start: Ints32  # (C, LEVELS)
    triangle_count: Ints32  # (C, LEVELS)
    cluster_start: Ints32  # (C, LEVELS)
    cluster_count: Ints32  # (C, LEVELS)


class Lamps(NamedTuple):
    """Where in `Chunks.key` the triangles of the signal lamps are."""

    signal: Ints32  # (n,) signal id
    place: Ints32  # (n,) 0 red, 1 yellow, 2 green
    triangle: Ints32  # (n,) row of Chunks.key


@dataclass(frozen=True, slots=True)
class StaticScene:
    """A map's geometry; read only, so that suites can share it."""

    chunks: Chunks
    lamps: Lamps
    palette: NDArray[np.float32]  # (256, 3) sRGB grey levels by material
    street_light: StreetLight
    grain: NDArray[np.float32]  # unevenness by material; of dressed maps only
    leafy: NDArray[np.intp]  # materials of crowns that are bare in winter
    green: NDArray[np.intp]  # and of conifers, hedges and woods, which are not

    def lamp_keys(self, lights: Mapping[int, LightState]) -> Ints32:
        """Returns (n,) keys of the lamp triangles while the lights show these states; others are dark."""
        keys = (self.chunks.key[self.lamps.triangle] & ~0xFF) | int(Material.LAMP_DARK)
        for signal, state in lights.items():
            if state in LIT:
                place, material = LIT[state]
                lit = (self.lamps.signal == signal) & (self.lamps.place == place)
                keys[lit] = (keys[lit] & ~0xFF) | int(material)
        result: Ints32 = keys.astype(np.int32)
        return result


def build_scene(samples: LaneSamples, lanes: LaneTable, roadside: Roadside) -> StaticScene:
    """Returns a map's scene: about 2000 triangles per 48 m of a four-lane road at full detail."""
    palette = base_palette()
    box_material = _box_materials({b.rgb for b in roadside.boxes}, palette)
    blocks = _blocks(samples, lanes, roadside, box_material)
    keys: list[ChunkKey] = []
    packed = []
    while batch := list(islice(blocks, BATCH)):
        keys += [key for key, _ in batch]
        packed.append(pack([pieces for _, pieces in batch]))
    chunks = _join(packed)
    lamps = _find_lamps(chunks, roadside, keys)
    street_light = street_light_of(roadside.boxes)
    grain = _grain_of(roadside, box_material)
    plants = (
        np.array(
            sorted({box_material[b.rgb] for b in roadside.boxes if b.shape in shapes}), np.intp
        )
        for shapes in ((Shape.CROWN,), EVERGREEN)
    )
    return StaticScene(chunks, lamps, palette, street_light, grain, *plants)


def _blocks(
    samples: LaneSamples,
    lanes: LaneTable,
    roadside: Roadside,
    box_material: dict[tuple[int, int, int], int],
) -> Iterator[tuple[ChunkKey, Block]]:
    """Yields all chunks with their keys, road by road, then what stands or lies beside the roads."""
    is_dressed = _is_dressed(roadside)
    for _, pieces in groupby(road_pieces(samples, lanes, is_dressed), lambda piece: piece[0][:2]):
        yield from _group_pieces(pieces)
    lamps = (
        (cell(head.x, head.y), [lamp_mesh(head, place)] * LEVELS)
        for head in roadside.heads
        for place in range(3)
    )
    ground = ground_pieces(samples, fields=is_dressed)
    yield from _group_pieces(chain(ground, furniture_pieces(roadside, box_material), lamps))


def _group_pieces(
    pieces: Iterable[tuple[ChunkKey, list[Mesh]]],
) -> Iterable[tuple[ChunkKey, Block]]:
    """Returns the pieces of each chunk together, chunks in the order of their first pieces."""
    grouped: dict[ChunkKey, Block] = {}
    for key, levels in pieces:
        grouped.setdefault(key, []).append(levels)
    return grouped.items()


def _is_dressed(roadside: Roadside) -> bool:
    """Returns whether the map has generated scenery."""
    return any(b.shape is not Shape.BOX for b in roadside.boxes)


def _grain_of(
    roadside: Roadside, box_material: Mapping[tuple[int, int, int], int]
) -> NDArray[np.float32]:
    """Returns how uneven materials look on a map with generated things; empty on any other."""
    if not _is_dressed(roadside):
        return NO_GRAIN
    return grain_table((b.label, box_material[b.rgb]) for b in roadside.boxes)


def pack(blocks: Sequence[Block]) -> Chunks:
    """Returns the pieces of chunks as flat arrays; each chunk has one piece or more."""
    flat = [levels[level] for block in blocks for level in range(LEVELS) for levels in block]
    pieces = np.repeat([len(block) for block in blocks], LEVELS)
    triangles = np.array([len(m.triangles) for m in flat], dtype=np.int32)
    count = np.add.reduceat(triangles, _starts(pieces), dtype=np.int32)
    everything = merge(flat)
    clusters, per_block = cluster(everything.vertices, everything.triangles, count)
    vertices = np.array([len(m.vertices) for m in flat], dtype=np.int32)
    ends = LEVELS * np.cumsum([len(block) for block in blocks])
    centre, radius = _spheres(everything.vertices, np.cumsum(vertices)[ends - 1])
    count, per_block = count.reshape(-1, LEVELS), per_block.reshape(-1, LEVELS)
    return Chunks(
        clusters,
        pixel_key(everything),
        centre,
        radius,
        _starts(count),
        count,
        _starts(per_block),
        per_block,
    )


def _join(parts: list[Chunks]) -> Chunks:
    """Returns packed chunks as one; empties `parts`, so that hardly anything is held twice."""
    columns = list(zip(*((*part.clusters, *part[1:]) for part in parts), strict=True))[::-1]
    parts.clear()
    joined = []
    while columns:
        joined.append(np.concatenate(columns.pop()))
    clusters = Clusters(*joined[: len(Clusters._fields)])
    chunks = Chunks(clusters, *joined[len(Clusters._fields) :])
    return chunks._replace(
        clusters=clusters._replace(
            vertex_start=_starts(clusters.vertex_count),
            triangle_start=_starts(clusters.triangle_count),
        ),
        triangle_start=_starts(chunks.triangle_count),
        cluster_start=_starts(chunks.cluster_count),
    )


def _starts(count: NDArray[Any]) -> Ints32:
    """Returns where runs of these lengths begin that lie one after the other, in the same shape."""
    starts: Ints32 = (np.cumsum(count).reshape(count.shape) - count).astype(np.int32)
    return starts


def pixel_key(mesh: Mesh) -> Ints32:
    """Returns (m,) class << 8 | material; the instance is added when drawn."""
    return mesh.label.astype(np.int32) << 8 | mesh.material.astype(np.int32)


def _spheres(vertices: Floats, ends: NDArray[np.intp]) -> tuple[Floats, Floats]:
    """Returns centres (n, 3) and radii (n,) in m of spheres that enclose runs of the vertices.

    ends: (n,) one more than the last row of each run.
    """
    starts = np.concatenate([[0], ends[:-1]])
    low, high = np.minimum.reduceat(vertices, starts), np.maximum.reduceat(vertices, starts)
    centre = (low + high) / 2.0
    away = vertices - np.repeat(centre, ends - starts, axis=0)
    return centre, np.sqrt(np.maximum.reduceat((away**2).sum(axis=1), starts))


def _box_materials(
    colours: set[tuple[int, int, int]], palette: NDArray[np.float32]
) -> dict[tuple[int, int, int], int]:
    """Returns a material for every box colour; writes the colours into the free numbers of `palette`.

    Beyond those, a colour gets the nearest one already given.
    """
    given: dict[tuple[int, int, int], int] = {}
    for rgb in sorted(colours):
        number = int(Material.FIRST_FREE) + len(given)
        if number < END_FREE:
            palette[number] = rgb
        else:
            taken = palette[int(Material.FIRST_FREE) : END_FREE]
            distance = ((taken - np.asarray(rgb)) ** 2).sum(axis=1)
            number = int(Material.FIRST_FREE) + int(distance.argmin())
        given[rgb] = number
    return given


def _find_lamps(chunks: Chunks, roadside: Roadside, keys: Sequence[ChunkKey]) -> Lamps:
    """Returns the rows of the lamp triangles: they stand last in their chunk, in the order of the heads.

    keys: of the chunks.
    """
    order = {key: i for i, key in enumerate(keys)}
    signal: list[int] = []
    place: list[int] = []
    rows: list[int] = []
    behind: dict[ChunkKey, int] = defaultdict(int)
    for head in reversed(roadside.heads):
        key = cell(head.x, head.y)
        for lamp in (2, 1, 0):
            size = len(lamp_mesh(head, lamp).triangles)
            behind[key] += size
            for level in range(LEVELS):
                chunk = order[key]
                end = chunks.triangle_start[chunk, level] + chunks.triangle_count[chunk, level]
                first = end - behind[key]
                rows += range(first, first + size)
                signal += [head.signal] * size
                place += [lamp] * size
    as_ints = (np.array(a, dtype=np.int32) for a in (signal, place, rows))
    return Lamps(*as_ints)


# Short runs of triangles with a bounding sphere each: what a sensor cannot see costs one test.
#
# A road chunk around the ego reaches 24 m ahead and behind; a radar's cone and a camera's picture
# hold a few of its strips. Runs keep the order of the triangles, so nothing changes in a picture.


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
    """Returns the clusters of blocks of consecutive triangles, and (B,) how many each block has.

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


# Triangles of the terrain under and around the roads. Decoration only: nothing drives on it.


def ground_pieces(
    samples: LaneSamples, fields: bool = False
) -> Iterator[tuple[ChunkKey, list[Mesh]]]:
    """Yields terrain chunks on a grid of `CHUNK` m, and the apron around them: key and a mesh per level.

    fields: land away from the roads is farmed, on some of it.
    """
    roads = cKDTree(np.stack([samples.x, samples.y], axis=1)[::ROAD_STEP]) if fields else None
    x0, y0, height = terrain_of(samples)
    nx, ny = height.shape
    for i in range(0, nx - 1, COARSE):
        for j in range(0, ny - 1, COARSE):
            bulge = _bulge(height[i : i + COARSE + 1, j : j + COARSE + 1])
            strides = [COARSE if bulge < limit else FINE for limit in BULGE]
            tiles = {stride: _tile(height, x0, y0, i, j, stride) for stride in set(strides)}
            middle = (x0 + (i + COARSE / 2) * CELL, y0 + (j + COARSE / 2) * CELL)
            if roads is not None and roads.query(middle)[0] > FARMED_FROM:
                grown = _field_at(i // COARSE, j // COARSE)
                tiles = {stride: _sow(mesh, grown) for stride, mesh in tiles.items()}
            yield ("ground", i, j, 0), [tiles[stride] for stride in strides]
    x1, y1 = x0 + (nx - 1) * CELL, y0 + (ny - 1) * CELL
    apron = _apron(x0, y0, x1, y1, float(height.min()))
    yield ("apron", 0, 0, 0), [apron] * LEVELS


def _field_at(i: int, j: int) -> Material:
    """Returns what grows on the tile in row i and column j: fields are some tiles long and wide."""
    long, wide = FIELD
    drawn = stream_key(0, "field", i // long, (j + (i // long) % 2) // wide)
    return GROWN[drawn % len(GROWN)]


def _sow(mesh: Mesh, material: Material) -> Mesh:
    """Returns the mesh with another material."""
    return mesh._replace(material=np.full(len(mesh.triangles), material, dtype=np.uint8))


def _bulge(tile: Heights) -> float:
    """Returns the largest m by which a tile may differ from the surface through its four corners."""
    t = np.linspace(0.0, 1.0, len(tile))
    a, b = t[:, None], t[None, :]
    flat = (1 - a) * ((1 - b) * tile[0, 0] + b * tile[0, -1]) + a * (
        (1 - b) * tile[-1, 0] + b * tile[-1, -1]
    )
    twist = abs(tile[0, 0] + tile[-1, -1] - tile[0, -1] - tile[-1, 0]) / 4.0
    return float(np.abs(tile - flat).max() + twist)


def _tile(height: Heights, x0: float, y0: float, i: int, j: int, stride: int) -> Mesh:
    """Returns the mesh of one tile of terrain, every `stride` cells a vertex."""
    at = np.arange(0, COARSE + 1, stride)
    a, b = np.meshgrid(i + at, j + at, indexing="ij")
    vertices = np.stack([x0 + a * CELL, y0 + b * CELL, height[a, b]], axis=-1).reshape(-1, 3)
    n = len(at)
    p, q = np.meshgrid(np.arange(n - 1), np.arange(n - 1), indexing="ij")
    corners = np.stack([p * n + q, (p + 1) * n + q, (p + 1) * n + q + 1, p * n + q + 1], axis=-1)
    return Mesh.of(vertices, quads(corners), SemanticClass.TERRAIN, Material.GRASS)


def _apron(x0: float, y0: float, x1: float, y1: float, z: float) -> Mesh:
    """Returns four flat trapezia at height z from the terrain's border out to APRON m beyond."""
    inner = np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]])
    out = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) * APRON
    corners = np.array([[i, (i + 1) % 4, 4 + (i + 1) % 4, 4 + i] for i in range(4)])
    return Mesh.of(
        np.concatenate([inner, inner + out]), quads(corners), SemanticClass.TERRAIN, Material.GRASS
    )
