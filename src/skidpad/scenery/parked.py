"""Parked cars: where a parking lane, or the shoulder between a street and its sidewalk, has room."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray

from skidpad.core.maths.randomness import stream
from skidpad.core.traffic.paints import PAINT_SHARES, PALETTE
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, SignalTable
from skidpad.roads.roadside import Roadside
from skidpad.scenery import things
from skidpad.scenery.free_ground import (
    CORNER,
    DRIVEN,
    OWN,
    find_named_objects,
    lane_polygons,
    outlines_of,
    sight_triangles,
    stand_apart,
)
from skidpad.scenery.sides import RoadKind, kind_of
from skidpad.scenery.things import Place, Thing

SIZES = (  # m: supermini, hatchback, saloon, SUV; none is wider than 1.8 m
    (3.75, 1.68, 1.47),
    (4.25, 1.78, 1.46),
    (4.65, 1.80, 1.45),
    (4.40, 1.80, 1.64),
)
LEAST_WIDTH = 2.2  # m of a lane in which cars are parked
TO_TRAFFIC = 0.3  # m, at least, between a parked car and a lane that is driven
TO_KERB = (
    0.1,
    0.3,
)  # m between a parked car and the outer border of its lane, as far as there is room
BETWEEN = 0.8  # m, at least, between two cars
STEP = (0.4, 1.6)  # m between two places that are tried
EXACT = 2  # samples of a lane in one polygon: long ones reach beyond the inner border of a bend
OCCUPIED = {
    RoadKind.TOWN: 0.65,
    RoadKind.RURAL: 0.35,
    RoadKind.MOTORWAY: 0.2,
}  # share of places (assumption)
STEEPEST = 0.05  # beyond it an upright box would leave the road


def parking_places(samples: LaneSamples, lanes: LaneTable, seed: int) -> Iterator[Thing]:
    """Yields places for cars, lane by lane, which overlap; those without a box are left empty."""
    for lane in np.flatnonzero(_fits_parking(lanes)).tolist():
        road = int(lanes.road[lane])
        name = (road, int(lanes.section[lane]), int(lanes.lane_id[lane]))
        rng = stream(seed, "scenery", "parked", *name)
        yield from _row(samples, lanes, lane, OCCUPIED[kind_of(samples, lanes, road)], rng)


def _fits_parking(lanes: LaneTable) -> NDArray[np.bool_]:
    """Returns (l,) whether cars may be parked on a lane: no lane beyond it is driven.

    A shoulder, unlike a parking lane, must lie along a street and have a sidewalk beyond it.
    """
    fits = np.isin(lanes.kind, (LaneKind.PARKING, LaneKind.SHOULDER)) & (lanes.junction < 0)
    for lane in np.flatnonzero(fits).tolist():
        own = lanes.lane_id[lane]
        beyond = lanes.kind[
            (lanes.road == lanes.road[lane])
            & (lanes.section == lanes.section[lane])
            & (lanes.lane_id * np.sign(own) > abs(own))
        ]
        fits[lane] = not np.isin(beyond, DRIVEN).any()
        if lanes.kind[lane] == LaneKind.SHOULDER:
            fits[lane] &= LaneKind.SIDEWALK in beyond
    return fits


def _row(
    samples: LaneSamples, lanes: LaneTable, lane: int, share: float, rng: np.random.Generator
) -> Iterator[Thing]:
    """Yields places along one lane near its outer border; share: of those with a car."""
    part = slice(int(lanes.first[lane]), int(lanes.first[lane] + lanes.size[lane]))
    s, width, grade = samples.s[part], samples.width[part], samples.grade[part]
    course = (samples.x[part], samples.y[part], samples.z[part], np.unwrap(samples.heading[part]))
    is_along = samples.s_road[part][-1] >= samples.s_road[part][0]
    outward = 1.0 if (lanes.lane_id[lane] > 0) == is_along else -1.0
    at = float(rng.uniform(*STEP))
    while at < s[-1]:
        size = SIZES[int(rng.integers(len(SIZES)))]
        rgb = PALETTE[int(rng.choice(len(PALETTE), p=PAINT_SHARES))]
        to_kerb, is_taken = float(rng.uniform(*TO_KERB)), bool(rng.random() < share)
        under = (s >= at - 1.0) & (s <= at + size[0] + 1.0)
        narrowest = float(width[under].min())
        middle = at + 0.5 * size[0]
        at += float(rng.uniform(*STEP))
        if (
            middle + 0.5 * size[0] < s[-1]
            and narrowest >= LEAST_WIDTH
            and np.abs(grade[under]).max() < STEEPEST
        ):
            x, y, z, along = (float(np.interp(middle, s, v)) for v in course)
            border = 0.5 * float(np.interp(middle, s, width))
            aside = border - 0.5 * size[1] - min(to_kerb, narrowest - size[1] - TO_TRAFFIC)
            place = Place(x, y, along).move(0.0, outward * aside)
            car = things.make_parked_car(place, round(z, 3), size, rgb)
            yield car if is_taken else replace(car, boxes=())


def park(
    places: Sequence[Thing],
    others: Sequence[Thing],
    samples: LaneSamples,
    lanes: LaneTable,
    signals: SignalTable,
    roadside: Roadside,
) -> list[Thing]:
    """Returns the cars whose place is free, in their order; of two places BETWEEN m apart, the first counts.

    Free is: TO_TRAFFIC m from lanes that are driven, off sidewalks and cycle lanes, CORNER m from lanes in
    junctions, crossings, signals and bus stops, OWN m from what the map names and from other things, and
    outside every sight triangle.
    """
    if not places:
        return []
    outside = lanes.junction < 0
    walks = np.isin(lanes.kind, (LaneKind.SIDEWALK, LaneKind.BIKING))
    taken = outlines_of(others)
    stops = taken[[t.name == "bus stop" for t in others]]
    zebras = [shapely.MultiPoint(p[:, :2]).convex_hull for p in roadside.crosswalks]
    rules = (
        (lane_polygons(samples, lanes, outside & np.isin(lanes.kind, DRIVEN), EXACT), TO_TRAFFIC),
        (lane_polygons(samples, lanes, outside & walks, EXACT), 0.0),
        (lane_polygons(samples, lanes, ~outside), CORNER),
        ([*zebras, *stops, *shapely.points(signals.x, signals.y)], CORNER),
        ([*find_named_objects(roadside), *taken], OWN),
        (sight_triangles(samples, lanes), 0.0),
    )
    outlines = outlines_of(places)
    free = np.ones(len(places), dtype=np.bool_)
    for shapes, distance in rules:
        rows, _ = shapely.STRtree(shapes).query(outlines, predicate="dwithin", distance=distance)
        free[rows] = False
    kept = np.flatnonzero(free)
    kept = kept[stand_apart(outlines[kept], BETWEEN)]
    return [places[i] for i in kept.tolist() if places[i].boxes]
