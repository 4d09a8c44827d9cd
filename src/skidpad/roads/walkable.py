"""Where pedestrians can walk: a map's pavements, crossings, roads and verges as convex polygons.

Two polygons are neighbours where they share an edge, both of its ends. Maps with sidewalks are cut
as one plane, with heights put back afterwards; on others the shoulders are all there is, each a
strip of its own, so that a shoulder may pass above another.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from skidpad.core.arrays import Floats
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap

Ring = tuple[int, ...]
Place = tuple[float, float]  # x and y in m
Places = Mapping[int, Place]  # of vertices, by index

VERGE = 4.0  # m beside the lanes of a junction on which one walks around its corners
SIMPLIFY = 0.25  # m, root of the area by which an outline may change at a corner left out
GRID = 0.001  # m, raster of outlines, so that neighbours share their vertices
SLIVER = 0.01  # m^2 below which a piece is a rounding of two outlines
WELD = 0.05  # m within which ends of shoulders are the same point
STRIP = 20.0  # m, longest piece of a shoulder
STRIP_TURN = 0.05  # rad by which a piece of a shoulder may bend
NEAR, STOREY = 3.0, 2.5  # m: lanes this near in plan and this far in height lie above each other
CORNERS = 6  # of a polygon at most (Detour's limit)
STRAIGHT = 1e-6  # m^2 by which a corner may seem to be reflex by rounding


class WalkArea(IntEnum):
    """What a pedestrian walks on; numbers as CARLA's navigation has them (public source)."""

    SIDEWALK = 1
    CROSSWALK = 2
    ROAD = 3
    GRASS = 4


@dataclass(frozen=True, slots=True)
class WalkMesh:
    """Convex polygons, counter-clockwise from above, ISO 8855 world frame."""

    vertices: Floats  # (v, 3) m
    polygons: tuple[Ring, ...]  # vertex indices, three to six each
    areas: tuple[WalkArea, ...]  # of each polygon

    def neighbours(self) -> list[list[int]]:
        """Returns per polygon and edge (corner k to k + 1) the polygon beyond, -1 where there is none.

        Where ways part, several begin at one edge: the first of them goes on.
        """
        owners: dict[tuple[int, int], int] = {}
        for i, ring in enumerate(self.polygons):
            for edge in _edges(ring):
                owners.setdefault(edge, i)
        return [
            [owners.get((b, a), -1) if owners[a, b] == i else -1 for a, b in _edges(ring)]
            for i, ring in enumerate(self.polygons)
        ]


def walk_mesh(map: RoadMap) -> WalkMesh | None:
    """Returns the map's walking surface; None when it has neither sidewalks nor shoulders to walk on.

    A plane cannot hold lanes above each other: on maps with sidewalks, a lane of which a part lies above
    another one is left out over its whole length.
    """
    if np.any(map.lanes.kind == LaneKind.SIDEWALK):
        kept = _lowest_lanes(map)
        return _town(map, kept) if np.any(kept & (map.lanes.kind == LaneKind.SIDEWALK)) else None
    lanes = np.flatnonzero(map.lanes.kind == LaneKind.SHOULDER).tolist()
    return _strips(map, lanes) if lanes else None


def _edges(ring: Ring) -> Iterable[tuple[int, int]]:
    """Returns the edges of a ring as pairs of indices, the closing one last."""
    return zip(ring, (*ring[1:], ring[0]), strict=True)


def _borders(map: RoadMap, lane: int) -> tuple[Floats, Floats]:
    """Returns the left and the right border of a lane in m, (k, 3) each, along its driving direction."""
    first = int(map.lanes.first[lane])
    rows, samples = slice(first, first + int(map.lanes.size[lane])), map.samples
    middle = np.column_stack((samples.x[rows], samples.y[rows], samples.z[rows]))
    heading, half = samples.heading[rows], 0.5 * samples.width[rows]
    left = np.column_stack((-np.sin(heading), np.cos(heading), np.tan(samples.bank[rows])))
    return middle + half[:, None] * left, middle - half[:, None] * left


# --- shoulders


def _strips(map: RoadMap, lanes: list[int]) -> WalkMesh:
    """Returns a mesh of quadrilaterals along the lanes, all of the area kind SIDEWALK."""
    points: list[Floats] = []
    rings: list[Ring] = []
    for lane in lanes:
        left, right = _borders(map, lane)
        keep = _stations(map, lane)
        base = 2 * sum(len(p) // 2 for p in points)
        points.append(np.stack((left[keep], right[keep]), axis=1).reshape(-1, 3))
        for k in range(len(keep) - 1):
            a = base + 2 * k
            rings.append((a + 1, a + 3, a + 2, a))
    return _weld_points(np.concatenate(points), rings, [WalkArea.SIDEWALK] * len(rings))


def _stations(map: RoadMap, lane: int) -> list[int]:
    """Returns the samples of a lane, counted from its first, at which its strip is cut."""
    first, size = int(map.lanes.first[lane]), int(map.lanes.size[lane])
    heading, s = map.samples.heading[first : first + size], map.samples.s[first : first + size]
    keep = [0]
    for k in range(1, size - 1):
        turn = abs(np.sin(heading[k + 1] - heading[keep[-1]]))
        if turn > STRIP_TURN or s[k + 1] - s[keep[-1]] > STRIP:
            keep.append(k)
    return [*keep, size - 1]


def _weld_points(points: Floats, rings: list[Ring], areas: list[WalkArea]) -> WalkMesh:
    """Returns a mesh in which points closer than WELD are one; pieces that this flattens are left out."""
    near = cKDTree(points).query_ball_point(points, WELD)
    used, index = np.unique([min(n) for n in near], return_inverse=True)
    whole = [(tuple(int(index[i]) for i in r), a) for r, a in zip(rings, areas, strict=True)]
    whole = [(ring, area) for ring, area in whole if len(set(ring)) == len(ring)]
    return WalkMesh(points[used], tuple(r for r, _ in whole), tuple(a for _, a in whole))


# --- a town


def _owners(map: RoadMap) -> NDArray[np.int64]:
    """Returns the lane (n,) of every sample."""
    owner = np.empty(len(map.samples.x), dtype=np.int64)
    for lane, (first, size) in enumerate(zip(map.lanes.first, map.lanes.size, strict=True)):
        owner[first : first + size] = lane
    return owner


def _lowest_lanes(map: RoadMap) -> NDArray[np.bool_]:
    """Returns which lanes lie above no other one."""
    s = map.samples
    plan = cKDTree(np.column_stack((s.x, s.y)))
    pairs = plan.query_pairs(NEAR, output_type="ndarray")
    rise = s.z[pairs[:, 0]] - s.z[pairs[:, 1]]
    upper = np.where(rise > 0.0, pairs[:, 0], pairs[:, 1])[np.abs(rise) > STOREY]
    kept = np.ones(len(map.lanes.first), dtype=np.bool_)
    kept[_owners(map)[upper]] = False
    return kept


def _town(map: RoadMap, kept: NDArray[np.bool_]) -> WalkMesh:
    """Returns the mesh of the kept lanes and of crossings as convex polygons without overlap."""
    surfaces = _surfaces(map, kept)
    lines = shapely.unary_union([g.boundary for g in surfaces.values()], grid_size=GRID)
    faces = [f for f in shapely.get_parts(shapely.polygonize([lines])) if f.area > SLIVER]
    kinds = _kinds(surfaces, faces)
    faces = [f for f, kind in zip(faces, kinds, strict=True) if kind is not None]
    areas = [kind for kind in kinds if kind is not None]
    cover = shapely.coverage_simplify(np.array(faces), SIMPLIFY)
    corners: dict[Place, int] = {}
    rings: list[Ring] = []
    owned: list[WalkArea] = []
    for face, area in zip(cover, areas, strict=True):
        for ring in _convex_parts(face, corners):
            rings.append(ring)
            owned.append(area)
    plan = np.array(list(corners), dtype=np.float64)
    return WalkMesh(np.column_stack((plan, _heights(map, plan, kept))), tuple(rings), tuple(owned))


def _surfaces(map: RoadMap, kept: NDArray[np.bool_]) -> dict[WalkArea, shapely.Geometry]:
    """Returns outlines of the kept lanes by area, without overlaps.

    A crossing ends at the pavement, a verge at the road.
    """
    kinds, junction = map.lanes.kind, map.lanes.junction

    def union(lanes: NDArray[np.bool_]) -> shapely.Geometry:
        return shapely.unary_union([_outline(map, int(i)) for i in np.flatnonzero(lanes & kept)])

    crossings = shapely.unary_union([shapely.Polygon(c[:, :2]) for c in map.roadside.crosswalks])
    pavements = union(kinds == LaneKind.SIDEWALK)
    roads = union(kinds != LaneKind.SIDEWALK)
    verges = union((junction >= 0) & (kinds != LaneKind.SIDEWALK)).buffer(VERGE)
    paved = _areas_of(shapely.union(pavements, crossings, grid_size=GRID))
    firm = _areas_of(shapely.union(paved, roads, grid_size=GRID))
    return {
        WalkArea.SIDEWALK: pavements,
        WalkArea.CROSSWALK: _areas_of(shapely.difference(crossings, pavements, grid_size=GRID)),
        WalkArea.ROAD: _areas_of(shapely.difference(roads, paved, grid_size=GRID)),
        WalkArea.GRASS: _areas_of(shapely.difference(verges, firm, grid_size=GRID)),
    }


def _areas_of(geometry: shapely.Geometry) -> shapely.Geometry:
    """Returns the polygons of a geometry; on the grid, slivers between them become lines and points."""
    if geometry.geom_type in ("Polygon", "MultiPolygon"):
        return geometry
    parts = shapely.get_parts(shapely.get_parts(geometry))
    return shapely.MultiPolygon([p for p in parts if p.geom_type == "Polygon"])


def _outline(map: RoadMap, lane: int) -> shapely.Geometry:
    """Returns the outline of a lane seen from above, widened by GRID in m."""
    left, right = _borders(map, lane)
    return shapely.Polygon(np.concatenate((left[:, :2], right[::-1, :2]))).buffer(GRID)


def _kinds(
    surfaces: dict[WalkArea, shapely.Geometry], faces: list[shapely.Geometry]
) -> list[WalkArea | None]:
    """Returns the kind of area in which each face lies, the first of `surfaces` first; None where in none."""
    points = shapely.point_on_surface(faces)
    kinds: list[WalkArea | None] = [None] * len(faces)
    for area, surface in reversed(surfaces.items()):
        shapely.prepare(surface)
        for i in np.flatnonzero(shapely.contains(surface, points)).tolist():
            kinds[i] = area
    return kinds


def _heights(map: RoadMap, plan: Floats, kept: NDArray[np.bool_]) -> Floats:
    """Returns the heights (n,) in m of the samples of kept lanes nearest to the points (n, 2)."""
    s, rows = map.samples, np.flatnonzero(kept[_owners(map)])
    _, nearest = cKDTree(np.column_stack((s.x[rows], s.y[rows]))).query(plan)
    return np.asarray(s.z[rows[nearest]], dtype=np.float64)


def _convex_parts(face: shapely.Geometry, corners: dict[Place, int]) -> list[Ring]:
    """Returns a face cut into convex polygons of vertex indices; new vertices are entered into `corners`."""
    triangles = []
    own: dict[int, Place] = {}
    for part in shapely.get_parts(shapely.constrained_delaunay_triangles(face)):
        points = [(float(x), float(y)) for x, y in part.exterior.coords[:3]]
        ring = tuple(corners.setdefault(p, len(corners)) for p in points)
        own.update(zip(ring, points, strict=True))
        triangles.append(ring if part.exterior.is_ccw else ring[::-1])
    return _merge_polygons(triangles, own)


def _merge_polygons(rings: list[Ring], points: Places) -> list[Ring]:
    """Returns polygons joined over their longest common edges while convex and of CORNERS at most."""
    alive = dict(enumerate(rings))
    owner = {edge: i for i, ring in alive.items() for edge in _edges(ring)}
    inner = [(a, b) for a, b in owner if a < b and (b, a) in owner]
    inner.sort(key=lambda e: (-_length(points, e), e))
    for a, b in inner:
        i, j = owner[a, b], owner[b, a]
        joined = _join_polygons(alive[i], alive[j], a, b)
        if i == j or len(joined) > CORNERS or not _convex(joined, points):
            continue
        alive[i] = joined
        del alive[j]
        owner.update(dict.fromkeys(_edges(joined), i))
    return list(alive.values())


def _join_polygons(one: Ring, two: Ring, a: int, b: int) -> Ring:
    """Returns the outline of two polygons; `one` has the edge a to b, `two` the edge b to a."""
    k, m = one.index(b), two.index(a)
    around = one[k:] + one[:k]  # from b to a
    return around + (two[m:] + two[:m])[1:-1]  # and from a back to b


def _convex(ring: Ring, points: Places) -> bool:
    """Returns whether a ring of point indices is convex, counter-clockwise and without repetitions."""
    if len(set(ring)) != len(ring):
        return False
    p = [points[i] for i in ring]
    return all(_turn(p[k - 2], p[k - 1], p[k]) > -STRAIGHT for k in range(len(p)))


def _turn(a: Place, b: Place, c: Place) -> float:
    """Returns twice the area in m^2 of the triangle of three points, below 0 for a turn to the right."""
    return (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])


def _length(points: Places, edge: tuple[int, int]) -> float:
    """Returns the length in m of the edge between two points."""
    (xa, ya), (xb, yb) = points[edge[0]], points[edge[1]]
    return float(np.hypot(xb - xa, yb - ya))
