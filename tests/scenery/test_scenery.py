"""Generated scenery stands where nobody drives or walks, is drawn by content, and `none` adds nothing."""

from __future__ import annotations

from collections import Counter
from copy import copy
from dataclasses import replace

import numpy as np
import pytest
import shapely

from skidpad.core.courses import Roads
from skidpad.core.geometry import Pose, footprint
from skidpad.core.run import RunSpec, run_from_plain
from skidpad.core.setup import ActorSetup
from skidpad.core.traffic.paints import PAINT_SHARES, PALETTE, draw_paint
from skidpad.core.vocabulary import Scenery, SemanticClass
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import bundled_maps, load_map
from skidpad.roads.lanes import LaneKind, Marking
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import UNPAINTED, Shape
from skidpad.roads.walkable import walk_mesh
from skidpad.scenery import dressing
from skidpad.scenery.dressing import (
    LOWER_EDGE,
    count_things,
    dress_map,
    name_kerbs,
    signs_of,
    things_of,
)
from skidpad.scenery.free_ground import outlines_of, sight_triangles
from skidpad.scenery.sides import RoadKind, kind_of, sides_of
from skidpad.scenery.things import Thing
from skidpad.simulation.carla_server.maps.maps import spawn_points
from skidpad.simulation.world.actors import Role

PARKED = "parked car"
MAPS = (*bundled_maps(), "Town01", "Town02", "Town04", "Town07", "Town10HD")


@pytest.fixture(params=MAPS)
def road_map(request: pytest.FixtureRequest):
    if request.param in bundled_maps():
        return load_map(request.param)
    return load_map(request.getfixturevalue("towns") / f"{request.param}.xodr")


def lane_quads(samples) -> np.ndarray:
    """Returns one quad per step of every lane: another way than the package's hulls."""
    left = np.stack([-np.sin(samples.heading), np.cos(samples.heading)], axis=1)
    middle, half = np.stack([samples.x, samples.y], axis=1), 0.5 * samples.width[:, None]
    a, b = middle + half * left, middle - half * left
    step = np.flatnonzero(samples.lane[:-1] == samples.lane[1:])
    rings = np.stack([a[step], a[step + 1], b[step + 1], b[step]], axis=1)
    return shapely.convex_hull(shapely.multipoints(rings))


def test_nothing_generated_stands_on_or_within_a_metre_of_lanes_crossings_or_ways(road_map) -> None:
    dressed = dress_map(road_map, Scenery.FULL)
    signs = list(signs_of(road_map.samples, road_map.lanes, road_map.signals, road_map.roadside))
    added = [
        b
        for b in dressed.roadside.boxes[len(road_map.roadside.boxes) + len(signs) :]
        if b.shape is not Shape.CAR
    ]
    assert added
    corners = np.array([footprint(b.x, b.y, b.yaw, b.length, b.width) for b in added])
    tree = shapely.STRtree(shapely.polygons(corners.reshape(-1, 4, 2)))
    lanes = lane_quads(road_map.samples)
    assert not tree.query(lanes, predicate="dwithin", distance=1.0).size
    crossings = [shapely.Polygon(p[:, :2]) for p in road_map.roadside.crosswalks]
    spawns = [shapely.Point(p.x, p.y) for p in spawn_points(road_map)]
    assert not tree.query([*crossings, *spawns], predicate="dwithin", distance=1.0).size


def test_no_way_of_pedestrians_leads_through_anything(road_map) -> None:
    mesh = walk_mesh(road_map)
    if mesh is None:  # it has no pavements
        return
    ways = [shapely.Polygon(mesh.vertices[list(ring), :2]) for ring in mesh.polygons]
    added = outlines_of([t for t in things_of(road_map) if t.name != PARKED])
    assert not shapely.STRtree(added).query(ways, predicate="dwithin", distance=1.0).size


def test_sight_triangles_of_junctions_are_free_of_what_is_tall(road_map) -> None:
    triangles = sight_triangles(road_map.samples, road_map.lanes)
    if not triangles:  # it has no junctions
        return
    tall = outlines_of([t for t in things_of(road_map) if t.is_tall])
    assert not shapely.STRtree(tall).query(triangles, predicate="intersects").size


def polygons_of(samples, lanes, kinds=tuple(LaneKind), in_junctions=(True, False)) -> list:
    """Returns the quads of the lanes of these kinds, in junctions or outside of them."""
    step = samples.lane[:-1][samples.lane[:-1] == samples.lane[1:]]
    inside = np.isin(lanes.junction[step] >= 0, in_junctions)
    return lane_quads(samples)[np.isin(lanes.kind[step], kinds) & inside].tolist()


def assert_parked_well(road_map: RoadMap) -> list[Thing]:
    """Returns the parked cars, of which none is where traffic, walkers or drivers' eyes need the place."""
    samples, lanes = road_map.samples, road_map.lanes
    others = [t for t in things_of(road_map) if t.name != PARKED]
    cars = [t for t in things_of(road_map) if t.name == PARKED]
    if not cars:
        return cars
    tree = shapely.STRtree(outlines_of(cars))
    driven = polygons_of(samples, lanes, (LaneKind.DRIVING, LaneKind.RAMP), (False,))
    sidewalks = polygons_of(samples, lanes, (LaneKind.SIDEWALK, LaneKind.BIKING), (False,))
    crossings = [shapely.Polygon(p[:, :2]) for p in road_map.roadside.crosswalks]
    stops = outlines_of([t for t in others if t.name == "bus stop"])
    signals = shapely.points(road_map.signals.x, road_map.signals.y)
    spawns = [shapely.Point(p.x, p.y) for p in spawn_points(road_map)]
    spaces = [
        shapely.Polygon(footprint(p.x, p.y, p.yaw, p.length, p.width))
        for p in road_map.roadside.parking
    ]
    for shapes, distance in (
        (driven, 0.299),
        (sidewalks, 0.0),
        (polygons_of(samples, lanes, in_junctions=(True,)), 5.0),
        ([*crossings, *stops, *signals], 5.0),
        (spawns, 1.0),
        ([*spaces, *outlines_of(others)], 0.5),
        (sight_triangles(samples, lanes), 0.0),
    ):
        found = tree.query(np.array(shapes, dtype=object), "dwithin", distance)
        assert not found.size
    room = polygons_of(samples, lanes, (LaneKind.PARKING, LaneKind.SHOULDER), (False,))
    outlines = outlines_of(cars)
    assert (shapely.area(shapely.difference(outlines, shapely.union_all(room))) < 0.05).all()
    first, second = tree.query(outlines, predicate="dwithin", distance=0.7)
    assert (first == second).all()
    return cars


def test_cars_are_parked_where_nobody_drives_walks_or_looks(road_map) -> None:
    cars = assert_parked_well(road_map)
    assert bool(cars) == (road_map.name in ("town", "Town07", "Town10HD"))


STREET = """<OpenDRIVE><header revMajor="1" revMinor="4"/>
<road name="" length="200" id="1" junction="-1"><type s="0" type="town"><speed max="50" unit="km/h"/></type>
<planView><geometry s="0" x="0" y="0" hdg="0.3" length="200"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="2" b="0.02" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="{kind}"><width sOffset="0" a="{width}" b="0" c="0" d="0"/></lane>
<lane id="-3" type="{beyond}"><width sOffset="0" a="2" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.mark.parametrize(
    ("kind", "width", "beyond", "fits"),
    [
        ("parking", 2.2, "sidewalk", True),
        ("parking", 3.0, "none", True),
        ("parking", 2.1, "sidewalk", False),
        ("parking", 2.5, "driving", False),
        ("shoulder", 2.2, "sidewalk", True),
        ("shoulder", 2.1, "sidewalk", False),
        ("shoulder", 3.0, "none", False),
        ("sidewalk", 3.0, "sidewalk", False),
    ],
)
def test_cars_are_parked_on_wide_parking_lanes_and_on_shoulders_before_sidewalks(
    kind: str, width: float, beyond: str, fits: bool
) -> None:
    text = STREET.format(kind=kind, width=width, beyond=beyond)
    road = RoadMap(bake(text.encode(), "street", "street.xodr"))
    cars = assert_parked_well(road)
    assert bool(cars) == fits
    if not fits:
        return
    assert 10 < len(cars) < 35
    boxes = [b for b in dress_map(road, Scenery.FULL).roadside.boxes if b.shape is Shape.CAR]
    assert len(boxes) == len(cars)
    assert {b.label for b in boxes} == {SemanticClass.CAR}
    assert {b.rgb for b in boxes} <= set(PALETTE)
    for box in boxes:
        assert box.solid
        assert box.yaw == pytest.approx(0.3, abs=0.01)
        ahead = box.x * np.cos(0.3) + box.y * np.sin(0.3)
        assert box.z == pytest.approx(2.0 + 0.02 * ahead, abs=0.02), "it stands on the road"


def test_no_car_is_parked_on_a_steep_street() -> None:
    text = STREET.format(kind="parking", width=2.5, beyond="sidewalk")
    steep = text.replace('b="0.02"', 'b="0.08"')
    road = RoadMap(bake(steep.encode(), "street", "street.xodr"))
    assert not assert_parked_well(road)


def test_things_do_not_stand_in_each_other_or_in_what_the_file_names() -> None:
    road_map = load_map("town")
    outlines = outlines_of(things_of(road_map))
    first, second = shapely.STRtree(outlines).query(outlines, predicate="intersects")
    assert (first == second).all()
    own = [
        shapely.Polygon(footprint(b.x, b.y, b.yaw, b.length, b.width))
        for b in road_map.roadside.boxes
    ]
    assert not shapely.STRtree(outlines).query(own, predicate="intersects").size


def test_a_map_that_is_too_large_is_left_as_it_is(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    road_map = copy(load_map("straight"))  # which no cache knows
    monkeypatch.setattr(dressing, "LARGEST", 3_000.0)
    assert dress_map(road_map, Scenery.FULL) is road_map
    assert "map straight: no scenery beside 9 km of driving lanes, at most 3 km" in caplog.text


def test_none_is_the_map_itself_and_full_leaves_the_roads_as_they_are() -> None:
    road_map = load_map("town")
    assert dress_map(road_map, Scenery.NONE) is road_map
    dressed = dress_map(road_map, Scenery.FULL)
    assert dressed.arrays is road_map.arrays
    assert dressed.lanes is road_map.lanes
    assert dressed.signals is road_map.signals
    own = dressed.roadside.boxes[: len(road_map.roadside.boxes)]
    given = road_map.roadside.boxes
    bare = [
        replace(b, shape=Shape.BOX, variant=0, rgb=g.rgb) for b, g in zip(own, given, strict=True)
    ]
    assert bare == list(given)  # buildings of the file have windows, where they stood
    painted = [b.rgb for b, g in zip(own, given, strict=True) if b.rgb != g.rgb]
    assert len(set(painted)) > 3
    assert {g.rgb for b, g in zip(own, given, strict=True) if b.rgb != g.rgb} == {UNPAINTED}
    assert {b.shape for b in own if b.label == SemanticClass.BUILDING} == {Shape.BLOCK}
    assert dressed.content_hash != road_map.content_hash
    changed = [
        name
        for name, a, b in zip(
            road_map.samples._fields, road_map.samples, dressed.samples, strict=True
        )
        if not np.array_equal(a, b, equal_nan=True)
    ]
    assert set(changed) <= {"marking_left", "marking_right"}


def test_the_same_content_gives_the_same_things_and_another_map_others() -> None:
    town = load_map("town")
    assert things_of(town) == things_of(load_map(str(town.name)))
    assert count_things(things_of(town)) != count_things(things_of(load_map("straight")))


def test_streets_have_houses_and_lamps_and_country_roads_trees() -> None:
    road_map = load_map("town")
    kinds = {s.kind for s in sides_of(road_map.samples, road_map.lanes)}
    assert kinds == {RoadKind.TOWN, RoadKind.RURAL}
    found = count_things(things_of(road_map))
    assert found["block"] + found["house"] > 80
    assert found["lamp"] > 80
    assert found["tree"] > 200
    motorway = load_map("motorway")
    assert {s.kind for s in sides_of(motorway.samples, motorway.lanes)} >= {RoadKind.MOTORWAY}
    assert "block" not in count_things(things_of(motorway))


def test_boxes_have_classes_shapes_and_stand_on_the_ground() -> None:
    road_map = load_map("town")
    dressed = dress_map(road_map, Scenery.FULL)
    added = dressed.roadside.boxes[len(road_map.roadside.boxes) :]
    labels = {SemanticClass(b.label) for b in added}
    assert labels >= {SemanticClass.BUILDING, SemanticClass.VEGETATION, SemanticClass.POLE}
    assert min(b.height for b in added) > 0.0
    low = road_map.samples.z.min() - 1.5
    assert all(b.z > low for b in added)
    crowns = [b for b in added if b.shape is Shape.CROWN]
    assert crowns
    assert not any(b.solid for b in crowns)  # a car passes below them


def test_a_sidewalk_of_a_file_without_kerbs_begins_with_one() -> None:
    road_map = load_map("town")
    samples = name_kerbs(road_map.samples, road_map.lanes)
    walks = np.isin(samples.lane, np.flatnonzero(road_map.lanes.kind == LaneKind.SIDEWALK))
    kerbs = (samples.marking_left == Marking.CURB) | (samples.marking_right == Marking.CURB)
    assert kerbs[walks].mean() > 0.9
    assert not kerbs[~walks].any()


def test_a_run_says_its_scenery_and_one_without_is_described_as_before() -> None:
    plain = RunSpec(course=Roads(map="town"))
    assert "scenery" not in plain.to_plain()
    dressed = RunSpec(course=Roads(map="town"), scenery=Scenery.FULL)
    assert dressed.to_plain()["scenery"] == "full"
    assert run_from_plain(dressed.to_plain(), "here") == dressed
    assert run_from_plain(plain.to_plain(), "here") == plain


def test_paints_are_drawn_as_often_as_cars_have_them_and_only_with_scenery() -> None:
    drawn = Counter(draw_paint(3, f"car_{i}") for i in range(2000))
    for paint, share in zip(PALETTE, PAINT_SHARES, strict=True):
        assert drawn[paint] / 2000 == pytest.approx(share, abs=0.035)
    role = Role(ActorSetup(name="car_1", type=EGO_TYPE, place=Pose(0.0, 0.0)))
    assert role.newcomer(1).rgb == PALETTE[1]
    assert role.newcomer(1, 3).rgb == draw_paint(3, "car_1")


PLATES = """<OpenDRIVE><header revMajor="1" revMinor="4"/>
<road name="" length="60" id="1" junction="-1"><planView>
<geometry s="0" x="0" y="0" hdg="0" length="60"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="2" b="0" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right>
</laneSection></lanes><signals>
<signal id="1" s="20" t="-5" zOffset="0" type="206" subtype="-1" orientation="+" dynamic="no"/>
<signal id="2" s="30" t="-5" zOffset="2.4" type="274" value="50" orientation="+" dynamic="no"/>
<signal id="3" s="40" t="-2" zOffset="0" type="205" subtype="-1" orientation="+" dynamic="no"/>
</signals></road></OpenDRIVE>"""


def test_signs_of_the_file_have_plates_on_posts_unless_they_would_stand_on_a_lane() -> None:
    road = RoadMap(bake(PLATES.encode(), "plates", "plates.xodr"))
    boxes = list(signs_of(road.samples, road.lanes, road.signals, road.roadside))
    plates = [b for b in boxes if b.shape is Shape.SIGN]
    assert [(round(b.x), b.variant, b.label) for b in plates] == [
        (20, 8, SemanticClass.TRAFFIC_SIGN),
        (30, 16, SemanticClass.TRAFFIC_SIGN),
    ]
    assert all(b.z == pytest.approx(2.0 + LOWER_EDGE) for b in plates)
    dressed = dress_map(road, Scenery.FULL)
    assert set(boxes) <= set(dressed.roadside.boxes)
    own = replace(road.roadside, boxes=tuple(boxes))
    assert not list(signs_of(road.samples, road.lanes, road.signals, own))


def test_a_road_without_sidewalks_is_a_street_up_to_50_km_h_only(towns) -> None:
    """Town07 lies among fields: many roads of 35 mph have no sidewalks. All of figure8 is a motorway loop."""
    for road_map, limit, kind in (
        (load_map(towns / "Town07.xodr"), 35 * 1.609344, RoadKind.RURAL),
        (load_map("figure8"), 60.0, RoadKind.MOTORWAY),
    ):
        samples, lanes = road_map.samples, road_map.lanes
        kinds = set()
        for road in np.unique(lanes.road[lanes.junction < 0]).tolist():
            own = np.flatnonzero(lanes.road == road)
            limits = samples.limit[np.isin(samples.lane, own)]
            bare = not (lanes.kind[own] == LaneKind.SIDEWALK).any()
            wide = (lanes.kind[own] == LaneKind.DRIVING).sum() > 1
            if bare and wide and abs(3.6 * np.nanmax(limits) - limit) < 0.5:
                kinds.add(kind_of(samples, lanes, road))
        assert kinds == {kind}, road_map.name
