"""A map with its scenery: the same roads, and more beside them."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Iterator, Sequence
from copy import copy
from dataclasses import replace
from functools import lru_cache

import numpy as np

from skidpad.core.geometry import footprint
from skidpad.core.maths.randomness import stream, stream_key
from skidpad.core.vocabulary import Scenery, SemanticClass
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, Marking, SignalKind, SignalTable
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import UNPAINTED, Box, Roadside, Shape
from skidpad.roads.terrain import Terrain, terrain_of
from skidpad.scenery.free_ground import FreeGround
from skidpad.scenery.parked import park, parking_places
from skidpad.scenery.rows import backdrop_of, rows_of
from skidpad.scenery.sides import sides_of
from skidpad.scenery.things import STOREY, WALLS, Thing

log = logging.getLogger("skidpad.scenery")
LARGEST = 500_000.0  # m of driving lanes: the triangles of what would stand beside more take 2 GB
PLATE = 0.7  # m, German size 2 is 0.6 m for discs and 0.9 m for others (VwV-StVO, table 2)
LOWER_EDGE = 2.0  # m above the road, VwV-StVO to sections 39 to 43, III 13 a
POST = 0.08  # m
NEAR = 1.5  # m within which the file has a plate of its own
BESIDE = 0.3  # m between a post and the lanes that are driven on, below which it stands on the road
GREY, RED, WHITE = (120, 120, 125), (176, 32, 36), (228, 228, 224)
CORNERS: dict[SignalKind, tuple[int, tuple[int, int, int]]] = {
    SignalKind.STOP: (8, RED),
    SignalKind.YIELD: (3, WHITE),
    SignalKind.SPEED_LIMIT: (16, WHITE),
}
EDITION = 3  # of what is generated; raise it when the same map gets other things
LEAST_FRONT = 4.0  # m of the shorter side of a building that has windows
SUNK = 0.3  # m that things reach into the ground, whose triangles are coarse


def dress_map(map: RoadMap, scenery: Scenery) -> RoadMap:
    """Returns the map with this scenery; the map itself for none, and where it is larger than LARGEST."""
    return map if scenery is Scenery.NONE else _dress_fully(map)


@lru_cache(maxsize=4)
def _dress_fully(map: RoadMap) -> RoadMap:
    """Returns a copy of the map with generated roadside, facades, signs and kerbs; cached for four maps.

    The map itself, with a line in the log, where it is larger than LARGEST.
    """
    driven = float(map.lanes.length[map.lanes.kind == LaneKind.DRIVING].sum())
    if driven > LARGEST:
        log.warning(
            "map %s: no scenery beside %.0f km of driving lanes, at most %.0f km get it",
            map.name, driven / 1000.0, LARGEST / 1000.0,
        )  # fmt: skip
        return map
    dressed = copy(map)
    boxes = boxes_of(things_of(map), terrain_of(map.samples))
    own = (add_facade(box) for box in map.roadside.boxes)
    signs = signs_of(map.samples, map.lanes, map.signals, map.roadside)
    dressed.roadside = replace(map.roadside, boxes=(*own, *signs, *boxes))
    dressed.samples = name_kerbs(map.samples, map.lanes)
    dressed.content_hash = f"{map.content_hash} with scenery {EDITION}"
    return dressed


def things_of(map: RoadMap) -> list[Thing]:
    """Returns the things to put beside the roads, clear of what is there; [] where nothing fits.

    The random seed is the map's content hash: equal maps get equal things.
    """
    seed = int(map.content_hash[:15], 16)
    sides = sides_of(map.samples, map.lanes)
    found: list[Thing] = []
    for rows, name in ((rows_of, "rows"), (backdrop_of, "backdrop")):
        for side in sides:
            found += rows(side, stream(seed, "scenery", name, side.road, int(side.is_left)))
    if not found:
        return []
    signs = signs_of(map.samples, map.lanes, map.signals, map.roadside)
    named = replace(map.roadside, boxes=(*map.roadside.boxes, *signs))
    stand = FreeGround(map.samples, map.lanes, named).place(found)
    places = list(parking_places(map.samples, map.lanes, seed))
    return [*stand, *park(places, stand, map.samples, map.lanes, map.signals, named)]


def boxes_of(things: Sequence[Thing], terrain: Terrain) -> list[Box]:
    """Returns the boxes of the things in the map's axes, z in m up.

    A box that begins at the thing's foot reaches SUNK m below the lowest ground under its outline; others
    count from the ground at the centre. What stands on a road counts from there.
    """
    corners = np.array([[*footprint(*t.outline), t.outline[:2]] for t in things]).reshape(-1, 5, 2)
    ground = terrain.at(corners[..., 0].ravel(), corners[..., 1].ravel()).reshape(-1, 5)
    foot = np.round(ground.min(axis=1), 3) - SUNK
    slope = np.round(ground[:, 4], 3) - foot
    found = []
    for thing, z, rise in zip(things, foot.tolist(), slope.tolist(), strict=True):
        for box in thing.boxes:
            if thing.z is not None:
                found.append(replace(box, z=round(thing.z + box.z, 3)))
                continue
            low = z if box.z == 0.0 else z + rise + box.z
            height = box.height + (rise if box.z == 0.0 else 0.0)
            found.append(replace(box, z=round(low, 3), height=round(height, 3)))
    return found


def add_facade(box: Box) -> Box:
    """Returns a building box as a painted BLOCK with windows, of the same place and size.

    Returned unchanged: what is no building, has no room for a storey, or a side below LEAST_FRONT m.
    """
    storeys = min(int((box.height - 1.5) / STOREY), 15)
    if (
        box.label != SemanticClass.BUILDING
        or storeys < 1
        or min(box.length, box.width) < LEAST_FRONT
    ):
        return box
    seed = stream_key(0, "facade", f"{box.x:.2f}", f"{box.y:.2f}")
    rgb = WALLS[seed % len(WALLS)] if box.rgb == UNPAINTED else box.rgb
    return replace(box, shape=Shape.BLOCK, rgb=rgb, variant=seed % (1 << 16) * 16 + storeys)


def count_things(things: Sequence[Thing]) -> dict[str, int]:
    """Returns how many things there are of each name, in the order of the names."""
    return dict(sorted(Counter(t.name for t in things).items()))


def name_kerbs(samples: LaneSamples, lanes: LaneTable) -> LaneSamples:
    """Returns a copy of the samples in which sidewalks have a kerb as marking on the side of the road.

    Markings of the lane beside a sidewalk stay as they are.
    """
    walks = np.isin(samples.lane, np.flatnonzero(lanes.kind == LaneKind.SIDEWALK))
    ends = lanes.first + lanes.size - 1
    is_along = samples.s_road[ends] >= samples.s_road[lanes.first]
    road_is_left = ((lanes.lane_id < 0) == is_along)[samples.lane]
    left, right = samples.marking_left.copy(), samples.marking_right.copy()
    left[walks & road_is_left] = Marking.CURB
    right[walks & ~road_is_left] = Marking.CURB
    return samples._replace(marking_left=left, marking_right=right)


# Plates of the signs that a file names and draws nothing for: stop, yield and speed limits.


def signs_of(
    samples: LaneSamples, lanes: LaneTable, signals: SignalTable, roadside: Roadside
) -> Iterator[Box]:
    """Yields post and plate for every stop, yield and speed-limit sign beside the road without a plate.

    A sign has a plate when a traffic-sign box stands within NEAR m; a sign nearer than BESIDE m to a
    driving lane gets none.
    """
    driven = np.isin(lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP))[samples.lane]
    plates = np.array(
        [(b.x, b.y) for b in roadside.boxes if b.label == SemanticClass.TRAFFIC_SIGN]
    ).reshape(-1, 2)
    _, rows = np.unique(signals.id, return_index=True)
    for row in rows.tolist():
        kind = SignalKind(int(signals.kind[row]))
        x, y, heading = (float(v[row]) for v in (signals.x, signals.y, signals.heading))
        if kind not in CORNERS or (np.hypot(plates[:, 0] - x, plates[:, 1] - y) < NEAR).any():
            continue
        away = np.hypot(samples.x - x, samples.y - y)
        if (away[driven] - 0.5 * samples.width[driven]).min(initial=np.inf) < BESIDE:
            continue
        corners, rgb = CORNERS[kind]
        z = round(float(samples.z[away.argmin()]), 3)
        place = (round(x, 3), round(y, 3))
        size = (POST, POST, LOWER_EDGE + PLATE)
        yield Box(int(SemanticClass.POLE), *place, z, heading, *size, rgb=GREY, shape=Shape.POST)
        yield Box(
            int(SemanticClass.TRAFFIC_SIGN), *place, z + LOWER_EDGE, round(heading, 5),
            2.0 * POST, PLATE, PLATE, False, rgb, Shape.SIGN, corners,
        )  # fmt: skip
