"""The static world as triangles in chunks with bounding spheres and levels of detail."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import chain
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints32
from skidpad.core.vocabulary import LightState
from skidpad.roads.lanes import LaneSamples, LaneTable
from skidpad.roads.roadside import Roadside, Shape
from skidpad.sensors.scene.clusters import Clusters, cluster
from skidpad.sensors.scene.furniture import cell, furniture_pieces, lamp_mesh
from skidpad.sensors.scene.grain import NO_GRAIN, grain_table
from skidpad.sensors.scene.ground import ground_pieces
from skidpad.sensors.scene.materials import MATERIALS, Material, base_palette
from skidpad.sensors.scene.mesh import Mesh, merge
from skidpad.sensors.scene.road_mesh import LEVELS, ChunkKey, road_pieces
from skidpad.sensors.scene.street_light import StreetLight, street_light_of

# A lamp lights up in its own colour; everything else is dark.
LIT: dict[LightState, tuple[int, Material]] = {
    LightState.RED: (0, Material.LAMP_RED),
    LightState.YELLOW: (1, Material.LAMP_YELLOW),
    LightState.GREEN: (2, Material.LAMP_GREEN),
}


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

    def lamp_keys(self, lights: Mapping[int, LightState]) -> Ints32:
        """(n,) keys of the lamp triangles while the lights show these states."""
        keys = (self.chunks.key[self.lamps.triangle] & ~0xFF) | int(Material.LAMP_DARK)
        for signal, state in lights.items():
            if state in LIT:
                place, material = LIT[state]
                lit = (self.lamps.signal == signal) & (self.lamps.place == place)
                keys[lit] = (keys[lit] & ~0xFF) | int(material)
        result: Ints32 = keys.astype(np.int32)
        return result


def build_scene(samples: LaneSamples, lanes: LaneTable, roadside: Roadside) -> StaticScene:
    """Triangulate a map: about 2000 triangles per 48 m of a four-lane road at full detail."""
    palette = base_palette()
    box_material = _box_materials({b.rgb for b in roadside.boxes}, palette)
    pieces = chain(
        road_pieces(samples, lanes),
        ground_pieces(samples),
        furniture_pieces(roadside, box_material),
    )
    grouped: dict[ChunkKey, list[list[Mesh]]] = {}
    for key, levels in pieces:
        grouped.setdefault(key, []).append(levels)
    lamps = [(head, place, lamp_mesh(head, place)) for head in roadside.heads for place in range(3)]
    for head, _, mesh in lamps:
        grouped.setdefault(cell(head.x, head.y), []).append([mesh] * LEVELS)
    blocks = {
        key: [merge([p[level] for p in parts]) for level in range(LEVELS)]
        for key, parts in grouped.items()
    }
    chunks = pack(blocks.values())
    lamps_found = _find_lamps(chunks, roadside, blocks, grouped)
    street_light = street_light_of(roadside.boxes)
    grain = _grain_of(roadside, box_material)
    return StaticScene(chunks, lamps_found, palette, street_light, grain)


def _grain_of(
    roadside: Roadside, box_material: Mapping[tuple[int, int, int], int]
) -> NDArray[np.float32]:
    """Returns how uneven materials look on a map with generated things; empty on any other."""
    if all(b.shape is Shape.BOX for b in roadside.boxes):
        return NO_GRAIN
    return grain_table((b.label, box_material[b.rgb]) for b in roadside.boxes)


def pack(blocks: Iterable[list[Mesh]]) -> Chunks:
    """Meshes per chunk and level to flat arrays."""
    blocks = list(blocks)
    flat = [mesh for levels in blocks for mesh in levels]
    shape = (len(blocks), LEVELS)
    count = np.array([len(m.triangles) for m in flat], dtype=np.int32)
    everything = merge(flat)
    clusters, per_block = cluster(everything.vertices, everything.triangles, count)
    centre, radius = _spheres(blocks)
    return Chunks(
        clusters,
        pixel_key(everything),
        centre,
        radius,
        (np.cumsum(count) - count).astype(np.int32).reshape(shape),
        count.reshape(shape),
        (np.cumsum(per_block) - per_block).astype(np.int32).reshape(shape),
        per_block.reshape(shape),
    )


def pixel_key(mesh: Mesh) -> Ints32:
    """(m,) class << 8 | material; the instance is added when drawn."""
    return mesh.label.astype(np.int32) << 8 | mesh.material.astype(np.int32)


def _spheres(blocks: list[list[Mesh]]) -> tuple[Floats, Floats]:
    """Returns centres (n, 3) and radii (n,) in m of spheres that enclose each block."""
    centre = np.empty((len(blocks), 3))
    radius = np.empty(len(blocks))
    for i, levels in enumerate(blocks):
        points = np.concatenate([m.vertices for m in levels])
        centre[i] = (points.min(axis=0) + points.max(axis=0)) / 2.0
        radius[i] = np.sqrt(((points - centre[i]) ** 2).sum(axis=1).max())
    return centre, radius


def _box_materials(
    colours: set[tuple[int, int, int]], palette: NDArray[np.float32]
) -> dict[tuple[int, int, int], int]:
    """Give every box colour a free material; beyond those, the nearest one already given."""
    given: dict[tuple[int, int, int], int] = {}
    for rgb in sorted(colours):
        number = int(Material.FIRST_FREE) + len(given)
        if number < MATERIALS:
            palette[number] = rgb
        else:
            taken = palette[int(Material.FIRST_FREE) :]
            distance = ((taken - np.asarray(rgb)) ** 2).sum(axis=1)
            number = int(Material.FIRST_FREE) + int(distance.argmin())
        given[rgb] = number
    return given


def _find_lamps(
    chunks: Chunks,
    roadside: Roadside,
    blocks: Mapping[ChunkKey, list[Mesh]],
    grouped: Mapping[ChunkKey, list[list[Mesh]]],
) -> Lamps:
    """Rows of the lamp triangles: they stand last in their chunk, in the order of the heads."""
    order = {key: i for i, key in enumerate(blocks)}
    signal: list[int] = []
    place: list[int] = []
    rows: list[int] = []
    behind: dict[ChunkKey, int] = dict.fromkeys(grouped, 0)
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
