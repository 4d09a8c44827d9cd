"""Walking surfaces: whole, convex, without overlaps, and connected as feet are."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from skidpad.roads.bundled import FOLDER, bake_file, load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.roads.walkable import (
    WalkArea,
    WalkMesh,
    _areas_of,
    _convex_parts,
    _kinds,
    _outline,
    walk_mesh,
)


def mesh_of(name: str) -> WalkMesh:
    mesh = walk_mesh(load_map(name))
    assert mesh is not None
    return mesh


def plan(mesh: WalkMesh, *areas: WalkArea) -> list[shapely.Polygon]:
    rings = zip(mesh.polygons, mesh.areas, strict=True)
    return [shapely.Polygon(mesh.vertices[list(r), :2]) for r, a in rings if a in areas]


def lane_area(name: str, kind: LaneKind) -> float:
    """m^2, by widths along the lanes."""
    map = load_map(name)
    total = 0.0
    for lane in np.flatnonzero(map.lanes.kind == kind).tolist():
        first = int(map.lanes.first[lane])
        rows = slice(first, first + int(map.lanes.size[lane]))
        total += float(np.trapezoid(map.samples.width[rows], map.samples.s[rows]))
    return total


def reached(mesh: WalkMesh, start: int, allowed: set[WalkArea]) -> set[int]:
    beyond, found, edge = mesh.neighbours(), {start}, [start]
    while edge:
        for other in beyond[edge.pop()]:
            if other >= 0 and other not in found and mesh.areas[other] in allowed:
                found.add(other)
                edge.append(other)
    return found


@pytest.mark.parametrize("name", ["town", "figure8", "straight"])
def test_polygons_are_convex_small_and_counter_clockwise(name: str) -> None:
    mesh = mesh_of(name)
    for ring, shape in zip(mesh.polygons, plan(mesh, *WalkArea), strict=True):
        assert 3 <= len(ring) <= 6
        assert shape.exterior.is_ccw
        assert shape.convex_hull.area - shape.area < 1e-3


@pytest.mark.parametrize("name", ["town", "figure8", "straight"])
def test_neighbours_are_mutual_and_share_the_edge(name: str) -> None:
    mesh = mesh_of(name)
    beyond = mesh.neighbours()
    for i, others in enumerate(beyond):
        for j in others:
            if j >= 0:
                assert i in beyond[j]
                assert len(set(mesh.polygons[i]) & set(mesh.polygons[j])) >= 2


@pytest.mark.parametrize(
    ("name", "kind"),
    [("town", LaneKind.SIDEWALK), ("figure8", LaneKind.SHOULDER), ("straight", LaneKind.SHOULDER)],
)
def test_the_pavement_is_as_large_as_its_lanes(name: str, kind: LaneKind) -> None:
    total = sum(shape.area for shape in plan(mesh_of(name), WalkArea.SIDEWALK))
    assert total == pytest.approx(lane_area(name, kind), rel=0.01)


def test_nothing_overlaps_in_town() -> None:
    shapes = plan(mesh_of("town"), *WalkArea)
    assert sum(s.area for s in shapes) == pytest.approx(shapely.unary_union(shapes).area, rel=1e-6)


def test_each_zebra_joins_its_pavements_without_the_road() -> None:
    mesh, map = mesh_of("town"), load_map("town")
    middles = [mesh.vertices[list(ring), :2].mean(axis=0) for ring in mesh.polygons]
    for corners in map.roadside.crosswalks:
        outline = shapely.Polygon(corners[:, :2])
        start = next(
            i
            for i, area in enumerate(mesh.areas)
            if area is WalkArea.CROSSWALK and outline.contains(shapely.Point(middles[i]))
        )
        joined = reached(mesh, start, {WalkArea.SIDEWALK, WalkArea.CROSSWALK})
        across = np.ptp(corners[:, :2], axis=0).argmax()  # the axis along which one crosses
        aside = [
            middles[i][across] - corners[:, across].mean()
            for i in joined
            if mesh.areas[i] is WalkArea.SIDEWALK
        ]
        assert min(aside) < 0.0 < max(aside)


def test_one_can_walk_around_town_without_stepping_on_a_road() -> None:
    mesh = mesh_of("town")
    pavement = {i for i, area in enumerate(mesh.areas) if area is WalkArea.SIDEWALK}
    everywhere = set(WalkArea) - {WalkArea.ROAD}
    parts = []
    while pavement:
        part = reached(mesh, min(pavement), everywhere)
        parts.append(part)
        pavement -= part
    largest = max(parts, key=len)
    assert sum(mesh.areas[i] is WalkArea.CROSSWALK for i in largest) >= 1
    assert len(parts) <= 6  # blocks inside and around the streets, joined by four zebras


def test_shoulders_keep_their_heights_where_roads_cross() -> None:
    mesh, map = mesh_of("figure8"), load_map("figure8")
    for x, y, z in mesh.vertices[::5].tolist():
        place = map.project(x, y, z, driving=False)
        assert place is not None
        assert z == pytest.approx(place.z, abs=0.3)
    assert np.ptp(mesh.vertices[:, 2]) > 5.0


def test_lines_and_points_between_surfaces_are_left_out() -> None:
    one, two, three = (shapely.box(x, 0, x + 1, 1) for x in (0, 3, 6))
    line, point = shapely.LineString([(1, 0), (3, 0)]), shapely.Point(9, 9)
    mixed = shapely.GeometryCollection([shapely.MultiPolygon([one, two]), three, line, point])
    kept = _areas_of(mixed)
    assert kept.equals(shapely.union_all([one, two, three]))
    assert shapely.union(kept, one, grid_size=0.01).area == pytest.approx(3.0)


def test_under_a_bridge_one_walks_below_it_only() -> None:
    """town with a copy of one of its roads 6 m above another: the upper lanes are left out."""
    baked = bake_file(FOLDER / "town.xodr")
    map, samples = RoadMap(baked), baked.samples
    plain = walk_mesh(map)
    assert plain is not None
    pavement = int(np.flatnonzero(map.lanes.kind == LaneKind.SIDEWALK)[0])
    first, size = int(map.lanes.first[pavement]), int(map.lanes.size[pavement])
    over = int(np.flatnonzero(map.lanes.kind == LaneKind.DRIVING)[0])
    rows = slice(int(map.lanes.first[over]), int(map.lanes.first[over] + map.lanes.size[over]))
    moved = {c: getattr(samples, c).copy() for c in ("x", "y", "z")}
    below = np.linspace(first, first + size - 1, rows.stop - rows.start).round().astype(int)
    moved["x"][rows], moved["y"][rows] = samples.x[below], samples.y[below]
    moved["z"][rows] = samples.z[below] + 6.0
    bridged = RoadMap(replace(baked, samples=samples._replace(**moved)))
    mesh = walk_mesh(bridged)
    assert mesh is not None
    assert float(mesh.vertices[:, 2].max()) == pytest.approx(float(plain.vertices[:, 2].max()))
    walked = [sum(p.area for p in plan(m, WalkArea.SIDEWALK)) for m in (mesh, plain)]
    assert walked[0] == pytest.approx(walked[1], rel=1e-6)


def test_a_town_with_bridges_has_a_walking_surface(towns: Path) -> None:
    map = load_map(towns / "Town04.xodr")
    mesh = walk_mesh(map)
    assert mesh is not None
    outlines = [_outline(map, int(i)) for i in np.flatnonzero(map.lanes.kind == LaneKind.SIDEWALK)]
    walked = sum(p.area for p in plan(mesh, WalkArea.SIDEWALK))
    assert walked > 0.5 * shapely.union_all(outlines).area
    assert plan(mesh, WalkArea.CROSSWALK)


@pytest.mark.parametrize("town", ["Town01", "Town02", "Town07", "Town10HD"])
def test_towns_have_walking_surfaces_with_their_sidewalks(towns: Path, town: str) -> None:
    map = load_map(towns / f"{town}.xodr")
    mesh = walk_mesh(map)
    assert mesh is not None
    walked = sum(p.area for p in plan(mesh, WalkArea.SIDEWALK))
    outlines = [_outline(map, int(i)) for i in np.flatnonzero(map.lanes.kind == LaneKind.SIDEWALK)]
    assert walked == pytest.approx(shapely.union_all(outlines).area, rel=0.01)
    crossings = [shapely.Polygon(c[:, :2]) for c in map.roadside.crosswalks]
    if crossings:
        assert plan(mesh, WalkArea.CROSSWALK)


def lowest_time(work: Callable[[], object]) -> float:
    """s of processor time, the least of three."""
    times = []
    for _ in range(3):
        began = time.process_time()
        work()
        times.append(time.process_time() - began)
    return min(times)


def test_the_corners_of_other_faces_cost_a_face_nothing() -> None:
    """Each face copied all corners found before it: most of a network of 10 x 10 km was that."""
    ring = [(10.0 * np.cos(a), 10.0 * np.sin(a)) for a in np.linspace(0.0, 2.0 * np.pi, 40)[:-1]]
    face = shapely.Polygon(ring)
    few = {(float(k), 1e6): k for k in range(10)}
    many = {(float(k), 1e6): k for k in range(1_000_000)}
    assert lowest_time(lambda: _convex_parts(face, many)) < 5.0 * lowest_time(
        lambda: _convex_parts(face, few)
    )


def test_the_kinds_of_four_times_as_many_faces_take_four_times_as_long() -> None:
    def work(n: int) -> Callable[[], object]:
        places = [(3.0 * (k % 50), 3.0 * (k // 50)) for k in range(n)]
        faces = [shapely.box(x, y, x + 1.0, y + 1.0) for x, y in places]
        surfaces = {WalkArea.ROAD: shapely.MultiPolygon(faces)}
        assert set(_kinds(surfaces, faces)) == {WalkArea.ROAD}
        return lambda: _kinds({WalkArea.ROAD: shapely.MultiPolygon(faces)}, faces)

    assert lowest_time(work(8000)) < 9.0 * lowest_time(work(2000))  # 15 when each looks at all
