"""Road surface, markings and embankments from baked lane samples, at four levels of detail.

Lanes are cut every `CHUNK` metres of OpenDRIVE s, and every level keeps the cut's own samples: so
neighbouring pieces of different levels meet in the same points, and lanes of one road change level
together.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.maths.randomness import stream_key
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, Marking
from skidpad.sensors.scene.materials import TRACKS, Material
from skidpad.sensors.scene.mesh import Mesh, Points, merge, patches, ribbon

CHUNK = 48.0  # m
CHORDS = (2.0, 4.0, 8.0, 24.0)  # m between cross-sections, by level
LEVELS = len(CHORDS)
DASHED_LEVELS = 2  # a dash beyond them is 0.4 px wide and a tenth of a pixel high
MARKING_WIDTH = 0.15  # m, RMS part 1 (Germany), narrow line on motorways
DASH, DASH_PERIOD = 6.0, 18.0  # m, RMS part 1: 6 m line, 12 m gap
MARKING_LIFT = 0.015  # m above the asphalt, so that depth decides which is in front
SKIRT_WIDTH, SKIRT_DROP = 4.0, 2.0  # m, the embankment beside the outermost lane

SURFACE: dict[LaneKind, tuple[SemanticClass, Material]] = {
    LaneKind.DRIVING: (SemanticClass.ROAD, Material.ASPHALT),
    LaneKind.RAMP: (SemanticClass.ROAD, Material.ASPHALT),
    LaneKind.PARKING: (SemanticClass.ROAD, Material.ASPHALT),
    LaneKind.BIKING: (SemanticClass.ROAD, Material.ASPHALT),
    LaneKind.SHOULDER: (SemanticClass.ROAD, Material.SHOULDER),
    LaneKind.BORDER: (SemanticClass.ROAD, Material.SHOULDER),
    LaneKind.SIDEWALK: (SemanticClass.SIDEWALK, Material.SIDEWALK),
    LaneKind.MEDIAN: (SemanticClass.TERRAIN, Material.MEDIAN),
    LaneKind.OTHER: (SemanticClass.ROAD, Material.SHOULDER),
}
AGES = (  # drawn from: what lies on a stretch of road or lane
    Material.NEW_ASPHALT, Material.WORN_ASPHALT,
    Material.ASPHALT, Material.ASPHALT, Material.ASPHALT, Material.WORN_ASPHALT,
)  # fmt: skip
PAINT = (SemanticClass.ROAD_LINE, Material.MARKING)
KERB = (SemanticClass.SIDEWALK, Material.KERB)
EMBANKMENT = (SemanticClass.TERRAIN, Material.EMBANKMENT)
OWN_AGES = 2  # so many of AGES, from the first, let a lane's stretch differ from its road's
STRETCH = 2  # chunks, the shortest that is laid anew
LINES = (Marking.SOLID, Marking.SOLID_SOLID, Marking.SOLID_BROKEN, Marking.BROKEN_SOLID)
IS_LINE = np.isin(np.arange(256), LINES)  # by the number of a marking
BROKEN, CURB = int(Marking.BROKEN), int(Marking.CURB)
RAISED = (LaneKind.SIDEWALK, LaneKind.MEDIAN, LaneKind.BORDER, LaneKind.OTHER)  # beyond a kerb
TRACK_LEVELS = 2  # a wheel's track beyond them is a pixel wide
# m from the middle of a lane: where what drips ends, and from where to where wheels roll
OIL, TRACK = 0.28, (0.50, 1.00)
KERB_HEIGHT, KERB_WIDTH = 0.12, 0.15  # m, of a kerb that the file names and gives no size
DRIVABLE = (LaneKind.DRIVING, LaneKind.RAMP)
MIN_WIDTH = 0.02  # m; a lane narrower than this over a whole piece is not drawn

ChunkKey = tuple[str, int, int, int]


class Edges(NamedTuple):
    """The two borders of a run of samples, in increasing OpenDRIVE s."""

    left: Points  # (k, 3) seen in driving direction
    right: Points
    normal: Points  # (k, 3) unit, to the left
    s: NDArray[np.float64]  # OpenDRIVE s
    marking_left: NDArray[np.uint8]
    marking_right: NDArray[np.uint8]


def road_pieces(
    samples: LaneSamples, lanes: LaneTable, ages: bool = False
) -> Iterator[tuple[ChunkKey, list[Mesh]]]:
    """Yields the pieces of all lanes, each with its chunk key and one mesh per level.

    ages: asphalt is new or worn on some stretches of lanes.
    """
    outer = _outermost(lanes)
    for lane in range(len(lanes.road)):
        edges = _edges(samples, lanes, lane)
        if edges is None:
            continue
        index = np.floor(edges.s / CHUNK).astype(int)
        starts = np.concatenate([[0], np.flatnonzero(np.diff(index)) + 1, [len(index) - 1]])
        for a, b in itertools.pairwise(starts):
            if b > a:
                key = ("road", int(lanes.road[lane]), int(lanes.section[lane]), int(index[a]))
                piece = _cut_edges(edges, slice(a, b + 1))
                look = SURFACE[LaneKind(int(lanes.kind[lane]))]
                if ages and look[1] is Material.ASPHALT and lanes.junction[lane] < 0:
                    look = (look[0], _age_of(lanes, lane, int(index[a])))
                worn = ages and lanes.junction[lane] < 0
                yield key, _levels(piece, lanes, lane, outer[lane], look, worn)


def _age_of(lanes: LaneTable, lane: int, chunk: int) -> Material:
    """Returns the asphalt of a lane in a chunk of its road: as old as the road, or laid on its own."""
    road, one = int(lanes.road[lane]), int(lanes.lane_id[lane])
    own = stream_key(0, "asphalt", road, one, chunk // STRETCH) % len(AGES)
    whole = stream_key(0, "asphalt", road, chunk // (3 * STRETCH)) % len(AGES)
    return AGES[own if own < OWN_AGES else whole]


def _edges(samples: LaneSamples, lanes: LaneTable, lane: int) -> Edges | None:
    """Returns a lane's edges in the direction of the road; None for a lane narrower than MIN_WIDTH."""
    first, size = int(lanes.first[lane]), int(lanes.size[lane])
    part = slice(first, first + size)
    if samples.width[part].max() < MIN_WIDTH:
        return None
    step = 1 if samples.s_road[first + size - 1] >= samples.s_road[first] else -1
    heading, bank = samples.heading[part], samples.bank[part]
    normal = np.stack(
        [-np.sin(heading) * np.cos(bank), np.cos(heading) * np.cos(bank), np.sin(bank)], axis=1
    )
    centre = np.stack([samples.x[part], samples.y[part], samples.z[part]], axis=1)
    half = normal * samples.width[part, None] / 2.0
    edges = Edges(
        centre + half,
        centre - half,
        normal,
        samples.s_road[part],
        samples.marking_left[part],
        samples.marking_right[part],
    )
    return _cut_edges(edges, slice(None, None, step))


def _cut_edges(edges: Edges, part: slice) -> Edges:
    """Returns the edges cut to a slice of their stations."""
    return Edges._make(field[part] for field in edges)


def _outermost(lanes: LaneTable) -> NDArray[np.bool_]:
    """Returns (L, 2) whether no lane of the road's section lies further to the left, to the right."""
    result = np.zeros((len(lanes.road), 2), dtype=np.bool_)
    groups: dict[tuple[int, int], list[int]] = {}
    for i, key in enumerate(zip(lanes.road.tolist(), lanes.section.tolist(), strict=True)):
        groups.setdefault(key, []).append(i)
    for members in groups.values():
        for pick, along_is_left in ((max, True), (min, False)):
            i = pick(members, key=lambda m: int(lanes.lane_id[m]))
            with_s = lanes.lane_id[i] < 0  # driven along increasing s
            result[i, 0 if along_is_left == with_s else 1] = True
    return result


def _stations(s: NDArray[np.float64], chord: float) -> NDArray[np.intp]:
    """Returns indices of the samples that a level keeps: both ends, and one per `chord` m of s."""
    bins = np.floor(s / chord + 1e-9)
    starts = bins[1:] != bins[:-1]
    starts[-1] = True
    return np.concatenate([[0], np.flatnonzero(starts) + 1])


def _levels(
    piece: Edges,
    lanes: LaneTable,
    lane: int,
    outer: NDArray[np.bool_],
    look: tuple[SemanticClass, Material],
    worn: bool,
) -> list[Mesh]:
    """Returns the meshes of a piece of lane by level of detail, with kerbs, skirts and edge lines.

    worn: lanes that are driven on show where wheels roll.
    """
    kind = LaneKind(int(lanes.kind[lane]))
    label, material = look
    ground = piece
    piece, is_raised = _raise_beyond_kerbs(piece, kind)
    meshes = []
    for level, chord in enumerate(CHORDS):
        at = _stations(piece.s, chord)
        if worn and level < TRACK_LEVELS and kind in DRIVABLE and material in TRACKS:
            parts = _worn_strips(piece, at, label, material)
        else:
            parts = [ribbon(piece.left[at], piece.right[at], label, material)]
        for side, is_outer in enumerate(outer):
            if is_outer:
                parts.append(_skirt(piece, at, side))
            if (is_raised or is_outer) and level < LEVELS - 1:
                parts += _kerb(ground, at, side, is_raised)
        if level < LEVELS - 1:  # beyond that a line is a quarter of a pixel wide
            parts += _paint_edge(piece, at, level, 1)
            if kind in DRIVABLE and lanes.left[lane] < 0:
                parts += _paint_edge(piece, at, level, 0)
        meshes.append(merge(parts))
    return meshes


def _worn_strips(
    piece: Edges, at: NDArray[np.intp], label: SemanticClass, material: Material
) -> list[Mesh]:
    """Returns a piece of lane as strips side by side: two that wheels polish, oil between them.

    A lane narrower than its tracks keeps those that fit.
    """
    left, right = piece.left[at], piece.right[at]
    width = np.linalg.norm(left - right, axis=1)
    half = 0.5 * np.maximum(width, MIN_WIDTH)
    track, oil = TRACKS[material]
    borders = (-np.inf, -TRACK[1], -TRACK[0], -OIL, OIL, TRACK[0], TRACK[1], np.inf)
    fills = (material, track, material, oil, material, track, material)
    lines = []
    for border in borders:
        share = 0.5 + 0.5 * np.clip(border / half, -1.0, 1.0)
        lines.append(left + share[:, None] * (right - left))
    return [
        ribbon(a, b, label, fill)
        for (a, b), fill in zip(itertools.pairwise(lines), fills, strict=True)
    ]


def _raise_beyond_kerbs(piece: Edges, kind: LaneKind) -> tuple[Edges, bool]:
    """Returns the piece as high as the kerbs at its edges, and whether it was raised.

    Only kinds in RAISED with a kerb are; any other piece comes back as it is.
    """
    kerbs = (piece.marking_left == CURB) | (piece.marking_right == CURB)
    if kind not in RAISED or not kerbs.any():
        return piece, False
    lift = np.stack([np.zeros(len(kerbs)), np.zeros(len(kerbs)), KERB_HEIGHT * kerbs], axis=1)
    return piece._replace(left=piece.left + lift, right=piece.right + lift), True


def _kerb(piece: Edges, at: NDArray[np.intp], side: int, inside: bool) -> list[Mesh]:
    """Returns the faces of a kerb on one edge of a piece; [] where none is marked.

    at: indices of the samples; side: 0 left, 1 right; inside: the stones lie inside the edge.
    """
    style = (piece.marking_left, piece.marking_right)[side][at]
    stretches = np.flatnonzero((style[:-1] == CURB) & (style[1:] == CURB))
    if not len(stretches):
        return []
    pairs = np.stack([stretches, stretches + 1], axis=1)
    foot = (piece.left, piece.right)[side][at]
    outward = piece.normal[at] * (KERB_WIDTH if side == 0 else -KERB_WIDTH)
    up = np.array([0.0, 0.0, KERB_HEIGHT + (MARKING_LIFT if inside else 0.0)])
    behind = foot - outward if inside else foot + outward
    faces = [patches(foot + up, foot, pairs, *KERB), patches(behind + up, foot + up, pairs, *KERB)]
    if not inside:
        faces.append(patches(behind + up, behind, pairs, *KERB))
    return faces


def _skirt(piece: Edges, at: NDArray[np.intp], side: int) -> Mesh:
    """Returns the mesh of the embankment that falls from an outer edge into the terrain."""
    edge = (piece.left, piece.right)[side][at]
    out = edge + piece.normal[at] * (SKIRT_WIDTH if side == 0 else -SKIRT_WIDTH)
    out[:, 2] = edge[:, 2] - SKIRT_DROP
    return ribbon(edge, out, *EMBANKMENT)


def _paint_edge(piece: Edges, at: NDArray[np.intp], level: int, side: int) -> list[Mesh]:
    """Returns the paint on one edge of a piece of lane; [] where there is none.

    side: 0 left, 1 right; level: of detail.
    """
    style = (piece.marking_left, piece.marking_right)[side]
    pairs = _painted_stretches(piece.s, at, style, level)
    if not len(pairs):
        return []
    edge = (piece.left, piece.right)[side] + (0.0, 0.0, MARKING_LIFT)
    half = piece.normal * (MARKING_WIDTH / 2.0)
    return [patches(edge + half, edge - half, pairs, *PAINT)]


def _painted_stretches(
    s: NDArray[np.float64], at: NDArray[np.intp], style: NDArray[np.uint8], level: int
) -> NDArray[np.intp]:
    """Returns (q, 2) index pairs of the painted stretches; dashes are left out from DASHED_LEVELS on."""
    solid = np.stack([at[:-1], at[1:]], axis=1)[IS_LINE[style[at[:-1]]]]
    if level >= DASHED_LEVELS:
        return solid
    on = (style == BROKEN) & (np.mod(s, DASH_PERIOD) < DASH)
    if not on.any():
        return solid
    bounds = np.flatnonzero(np.diff(np.concatenate([[False], on, [False]]).astype(np.int8)))
    runs = bounds.reshape(-1, 2)
    runs[:, 1] = np.minimum(runs[:, 1], len(s) - 1)
    if level == 0:
        runs = np.array(
            [(i, min(i + 2, b)) for a, b in runs for i in range(a, b, 2)], dtype=np.intp
        ).reshape(-1, 2)
    return np.concatenate([solid, runs[runs[:, 1] > runs[:, 0]]])
