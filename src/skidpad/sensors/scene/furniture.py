"""Guardrails, walls, gantries, poles, buildings, signs and signal heads beside the road."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, floor, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside, Shape, SignalHead
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.mesh import Mesh, Points, box, disc, merge, ribbon
from skidpad.sensors.scene.road_mesh import CHORDS, CHUNK, LEVELS, MARKING_LIFT, ChunkKey
from skidpad.sensors.scene.shapes import shape_levels

RAIL_DEPTH = 0.31  # m, height of a W-beam's face, EN 1317 systems
POST_SPACING = 4.0  # m
POST = 0.05  # m, half the edge of a post
POST_LEVELS = 2  # posts are drawn in this many levels, the nearest ones
WALL_THICKNESS = 0.25  # m
CROSSWALK_STRIPE = 0.5  # m, stripe and gap
BARRIER_LOOK: dict[BarrierKind, tuple[SemanticClass, Material]] = {
    BarrierKind.GUARDRAIL: (SemanticClass.GUARD_RAIL, Material.STEEL),
    BarrierKind.WALL: (SemanticClass.WALL, Material.CONCRETE),
    BarrierKind.KERB: (SemanticClass.SIDEWALK, Material.KERB),
    BarrierKind.FENCE: (SemanticClass.FENCE, Material.FENCE),
}
Pieces = Iterator[tuple[ChunkKey, list[Mesh]]]


def cell(x: float, y: float) -> ChunkKey:
    """Returns the key of the chunk that holds things at (x, y) m which stand alone."""
    return ("side", floor(x / CHUNK), floor(y / CHUNK), 0)


def furniture_pieces(roadside: Roadside, box_material: dict[tuple[int, int, int], int]) -> Pieces:
    """Yields everything beside the road but the lamps, which change: chunk key and a mesh per level.

    box_material: material of boxes by their colour.
    """
    for barrier in roadside.barriers:
        yield from _barrier(barrier)
    for thing in roadside.boxes:
        yield cell(thing.x, thing.y), _box(thing, box_material[thing.rgb])
    for head in roadside.heads:
        yield cell(head.x, head.y), [_housing(head)] * LEVELS
    for polygon in roadside.crosswalks:
        yield cell(*polygon[:, :2].mean(axis=0)), [_crosswalk(polygon)] * LEVELS


def _barrier(barrier: Barrier) -> Pieces:
    """Yields (cell, meshes by level of detail) for each chunk of a barrier."""
    points = _resample_polyline(np.asarray(barrier.points, dtype=np.float64), CHORDS[0])
    per_chunk = int(CHUNK / CHORDS[0])
    label, material = BARRIER_LOOK[barrier.kind]
    for a in range(0, len(points) - 1, per_chunk):
        part = points[a : a + per_chunk + 1]
        meshes = []
        for level, chord in enumerate(CHORDS):
            step = int(chord / CHORDS[0])
            at = np.unique([*range(0, len(part), step), len(part) - 1])
            meshes.append(_barrier_mesh(barrier, part[at], label, material))
            if barrier.kind is BarrierKind.GUARDRAIL and level < POST_LEVELS:
                posts = part[:: int(POST_SPACING / CHORDS[0])]
                meshes[-1] = merge([meshes[-1], *(_post(p, barrier.height) for p in posts)])
        x, y = part[:, :2].mean(axis=0)
        yield cell(float(x), float(y)), meshes


def _resample_polyline(points: Points, step: float) -> Points:
    """Returns the polyline (n, 3) in even steps of about `step` m, ends kept."""
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    n = max(1, round(s[-1] / step))
    at = np.linspace(0.0, s[-1], n + 1)
    return np.stack([np.interp(at, s, points[:, i]) for i in range(3)], axis=1)


def _barrier_mesh(barrier: Barrier, foot: Points, label: int, material: int) -> Mesh:
    """Returns a barrier's mesh along its foot points (n, 3): a rail, a fence or a wall."""
    top: Points = np.add(foot, (0.0, 0.0, barrier.height))
    if barrier.kind is BarrierKind.GUARDRAIL:
        return ribbon(top, top - (0.0, 0.0, min(RAIL_DEPTH, barrier.height)), label, material)
    if barrier.kind is BarrierKind.FENCE:
        return ribbon(top, foot, label, material)
    along = np.gradient(foot[:, :2], axis=0)
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    side = np.stack([-along[:, 1], along[:, 0], np.zeros(len(foot))], axis=1)
    side *= WALL_THICKNESS / 2.0
    faces = [
        ribbon(top + side, foot + side, label, material),
        ribbon(top - side, foot - side, label, material),
        ribbon(top + side, top - side, label, material),
    ]
    return merge(faces)


def _post(foot: Points, height: float) -> Mesh:
    """Returns the mesh of a guard rail's post at its foot point in m."""
    x, y, z = foot
    return box(
        (x - POST, x + POST),
        (y - POST, y + POST),
        (z - 0.3, z + height - 0.04),
        SemanticClass.GUARD_RAIL,
        Material.STEEL,
    )


def _box(thing: Box, material: int) -> list[Mesh]:
    """Returns one mesh per level of detail of a box or shape, where it stands."""
    rotation = Pose(thing.x, thing.y, thing.z, yaw=thing.yaw).rotation()
    place = np.array([thing.x, thing.y, thing.z])
    if thing.shape is Shape.BOX:
        a, b = thing.length / 2, thing.width / 2
        upright = box((-a, a), (-b, b), (0.0, thing.height), thing.label, material)
        return [upright.moved(rotation, place)] * LEVELS
    return [mesh.moved(rotation, place) for mesh in shape_levels(thing, material)]


def _facing(head: SignalHead, mesh: Mesh) -> Mesh:
    """Returns a mesh in the world, turned from a frame whose x looks back at the traffic."""
    c, s = -cos(head.heading), -sin(head.heading)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return mesh.moved(turn, np.array([head.x, head.y, head.z]))


def _housing(head: SignalHead) -> Mesh:
    """Returns the mesh of the housing of a signal head."""
    d = head.lamp_diameter
    body = box(
        (-0.6 * d, 0.0),
        (-0.75 * d, 0.75 * d),
        (-2.1 * d, 2.1 * d),
        SemanticClass.TRAFFIC_LIGHT,
        Material.LAMP_HOUSING,
    )
    return _facing(head, body)


def lamp_mesh(head: SignalHead, place: int) -> Mesh:
    """Returns the mesh of one lamp: place 0 is red on top, 1 yellow, 2 green."""
    d = head.lamp_diameter
    centre = (0.02, 0.0, (1 - place) * 1.25 * d)
    lens = disc(centre, 0, d / 2, 12, SemanticClass.TRAFFIC_LIGHT, Material.LAMP_DARK)
    return _facing(head, lens)


def _crosswalk(polygon: NDArray[np.float64]) -> Mesh:
    """Returns zebra stripes along the polygon's short side, over its first four corners; of three one."""
    p: Points = np.add(polygon[:4], (0.0, 0.0, 1.4 * MARKING_LIFT))
    if len(p) < 4:
        return ribbon(p[:2], p[1:3], SemanticClass.ROAD_LINE, Material.MARKING)
    if np.linalg.norm(p[1] - p[0]) < np.linalg.norm(p[2] - p[1]):
        p = np.roll(p, -1, axis=0)
    length = float(np.linalg.norm(p[1] - p[0]))
    count = max(1, int(length / (2.0 * CROSSWALK_STRIPE)))
    stripes = []
    for i in range(count):
        a, b = i / count, (i + 0.5) / count
        near = p[0] + np.outer([a, b], p[1] - p[0])
        far = p[3] + np.outer([a, b], p[2] - p[3])
        stripes.append(ribbon(near, far, SemanticClass.ROAD_LINE, Material.MARKING))
    return merge(stripes)
