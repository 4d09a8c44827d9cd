"""The road of a map as ASAM OSI: lanes, their boundaries with road marks, signs; and how it tilts.

Lanes are those of the baked map, one for each lane of a lane section. A boundary that two lanes have
in common is one message.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise, product
from math import atan, cos, isfinite, pi, sin, tan
from typing import TYPE_CHECKING, Any

import numpy as np

from skidpad.core.geometry import kmh_from_mps, wrap_angle
from skidpad.recording.formats.osi import library
from skidpad.roads.lanes import LaneKind, Marking, SignalKind
from skidpad.roads.queries import RoadMap

if TYPE_CHECKING:
    from osi3.osi_groundtruth_pb2 import GroundTruth

FIRST_LANE, FIRST_BOUNDARY, FIRST_SIGN = 1_000_000, 2_000_000, 3_000_000  # ids
STEP = 4  # of the map's samples, 1 m apart at most, every so many are written, and the last one
SIGN = 0.6  # m, width and height of a sign (assumption)
KINDS = {  # Lane.Classification: type, subtype
    LaneKind.DRIVING: ("DRIVING", "NORMAL"),
    LaneKind.SHOULDER: ("NONDRIVING", "SHOULDER"),
    LaneKind.SIDEWALK: ("NONDRIVING", "SIDEWALK"),
    LaneKind.BIKING: ("NONDRIVING", "BIKING"),
    LaneKind.PARKING: ("NONDRIVING", "PARKING"),
    LaneKind.BORDER: ("NONDRIVING", "BORDER"),
    LaneKind.MEDIAN: ("NONDRIVING", "RESTRICTED"),
    LaneKind.RAMP: ("DRIVING", "CONNECTINGRAMP"),
    LaneKind.OTHER: ("NONDRIVING", "OTHER"),
}
MARKS = {  # LaneBoundary.Classification: type; of two lines the nearer one counts
    Marking.NONE: "NO_LINE",
    Marking.BROKEN: "DASHED_LINE",
    Marking.SOLID: "SOLID_LINE",
    Marking.SOLID_SOLID: "SOLID_LINE",
    Marking.SOLID_BROKEN: "SOLID_LINE",
    Marking.BROKEN_SOLID: "DASHED_LINE",
    Marking.OTHER: "OTHER",
    Marking.CURB: "CURB",
}
SIGNS = {
    SignalKind.STOP: "STOP",
    SignalKind.YIELD: "GIVE_WAY",
    SignalKind.SPEED_LIMIT: "SPEED_LIMIT_BEGIN",
}


@dataclass
class _Road:
    """Lanes and boundaries as they are written; the boundaries of each lane by their ids."""

    map: RoadMap
    truth: GroundTruth
    sides: dict[tuple[int, bool], list[int]] = field(default_factory=dict)  # of lane, on its left

    def boundaries(self, lane: int, left: bool) -> list[int]:
        """Returns the ids of a side's boundaries, from the lane's begin on; a neighbour's are shared."""
        if (lane, left) not in self.sides:
            lanes = self.map.lanes
            across, same = (
                int(lanes.opposite[lane]),
                int((lanes.left if left else lanes.right)[lane]),
            )
            if left and across >= 0 and (across, True) in self.sides:
                found = self.sides[across, True][::-1]
            elif same >= 0 and (same, not left) in self.sides:
                found = self.sides[same, not left]
            else:
                found = [self._write(left, a, b) for a, b in self._runs(lane, left)]
            self.sides[lane, left] = found
        return self.sides[lane, left]

    def _runs(self, lane: int, left: bool) -> Iterator[tuple[int, int]]:
        """Yields the stretches of one marking, as numbers of the first and last sample of the map."""
        first, size = int(self.map.lanes.first[lane]), int(self.map.lanes.size[lane])
        samples = self.map.samples
        marks = (samples.marking_left if left else samples.marking_right)[first : first + size]
        cuts = np.flatnonzero(np.diff(marks.astype(np.int64))) + 1
        ends = [0, *(int(c) for c in cuts if 0 < c < size - 1), size - 1]
        yield from ((first + a, first + b) for a, b in pairwise(ends))

    def _write(self, left: bool, a: int, b: int) -> int:
        """Writes the lane boundary on one side of map samples a..b (both included) and returns its OSI id."""
        samples, boundary = self.map.samples, self.truth.lane_boundary.add()
        boundary.id.value = FIRST_BOUNDARY + len(self.truth.lane_boundary) - 1
        side = 0.5 if left else -0.5
        for k in _pick_samples(a, b):
            aside, yaw = side * float(samples.width[k]), float(samples.heading[k])
            point = boundary.boundary_line.add()
            point.position.x = float(samples.x[k]) - aside * sin(yaw)
            point.position.y = float(samples.y[k]) + aside * cos(yaw)
            point.position.z = float(samples.z[k]) + aside * tan(float(samples.bank[k]))
            point.width = point.height = 0.0
        mark = Marking(int((samples.marking_left if left else samples.marking_right)[a]))
        kind = boundary.classification
        kind.type = kind.Type.Value(f"TYPE_{MARKS[mark]}")
        kind.color = kind.COLOR_NONE if mark is Marking.NONE else kind.COLOR_WHITE
        return int(boundary.id.value)


def _pick_samples(first: int, last: int) -> list[int]:
    """Returns the sample indices first, first + STEP, ... and always the last one."""
    return [*range(first, last, STEP), last]


def road_truth(map: RoadMap) -> GroundTruth:
    """Returns what of a GroundTruth message the road is: lanes, boundaries and signs.

    MissingExtra without the extra `osi`.
    """
    truth: GroundTruth = library().osi_groundtruth_pb2.GroundTruth()
    road = _Road(map, truth)
    for lane in range(len(map.lanes.road)):
        _write_lane(road, lane)
    _write_signs(map, truth)
    return truth


def _write_lane(road: _Road, lane: int) -> None:
    """Writes a lane: kind, centreline, neighbours, boundaries and pairs of predecessor and successor."""
    map, lanes, samples = road.map, road.map.lanes, road.map.samples
    message = road.truth.lane.add()
    message.id.value = FIRST_LANE + lane
    kind = message.classification
    type, subtype = KINDS[LaneKind(int(lanes.kind[lane]))]
    kind.type = kind.Type.Value(f"TYPE_{type}")
    kind.subtype = kind.Subtype.Value(f"SUBTYPE_{subtype}")
    kind.centerline_is_driving_direction = True
    first = int(lanes.first[lane])
    for k in _pick_samples(first, first + int(lanes.size[lane]) - 1):
        point = kind.centerline.add()
        point.x, point.y, point.z = float(samples.x[k]), float(samples.y[k]), float(samples.z[k])
    for neighbour, ids in ((lanes.left, kind.left_adjacent_lane_id),
                           (lanes.right, kind.right_adjacent_lane_id)):  # fmt: skip
        if neighbour[lane] >= 0:
            ids.add().value = FIRST_LANE + int(neighbour[lane])
    for left, ids in ((True, kind.left_lane_boundary_id), (False, kind.right_lane_boundary_id)):
        for boundary in road.boundaries(lane, left):
            ids.add().value = boundary
    before: list[int | None] = [*map.predecessors(lane)] or [None]
    after: list[int | None] = [*map.successors(lane)] or [None]
    for one, other in product(before, after):
        if one is None and other is None:
            continue
        pair = kind.lane_pairing.add()
        if one is not None:
            pair.antecessor_lane_id.value = FIRST_LANE + one
        if other is not None:
            pair.successor_lane_id.value = FIRST_LANE + other
    _refer(message, f"road_id:{lanes.road[lane]}", f"lane_id:{lanes.lane_id[lane]}")


def _write_signs(map: RoadMap, truth: GroundTruth) -> None:
    """Writes the signs, one message for each with the lanes that it is valid for."""
    table = map.signals
    written: dict[int, Any] = {}
    for row in range(len(table.id)):
        name = SIGNS.get(SignalKind(int(table.kind[row])))
        if name is None:
            continue
        id = int(table.id[row])
        if id not in written:
            written[id] = sign = truth.traffic_sign.add()
            sign.id.value = FIRST_SIGN + len(truth.traffic_sign) - 1
            base, kind = sign.main_sign.base, sign.main_sign.classification
            base.position.x, base.position.y = float(table.x[row]), float(table.y[row])
            base.position.z = float(table.z[row])
            base.orientation.yaw = wrap_angle(float(table.heading[row]) + pi)
            base.dimension.width = base.dimension.height = SIGN
            kind.type = kind.Type.Value(f"TYPE_{name}")
            kind.variability = sign.VARIABILITY_FIXED
            kind.direction_scope = kind.DIRECTION_SCOPE_NO_DIRECTION
            if isfinite(float(table.value[row])):
                kind.value.value = kmh_from_mps(float(table.value[row]))
                kind.value.value_unit = kind.value.UNIT_KILOMETER_PER_HOUR
                kind.value.text = f"{kind.value.value:g}"
            _refer(sign, f"signal_id:{id}")
        lane = written[id].main_sign.classification.assigned_lane_id.add()
        lane.value = FIRST_LANE + int(table.lane[row])


def _refer(message: Any, *identifiers: str) -> None:
    """Names the part of the OpenDRIVE file that a message is of, in the message."""
    reference = message.source_reference.add()
    reference.type = "net.asam.opendrive"
    reference.identifier.extend(identifiers)


@dataclass(frozen=True, slots=True)
class Tilt:
    """Tells roll and pitch of a body by the road under it."""

    map: RoadMap

    def at(self, x: float, y: float, z: float, yaw: float) -> tuple[float, float]:
        """Returns roll and pitch, rad: left side up and nose down are positive; 0 beside the road."""
        point = self.map.project(x, y, z, driving=False)
        if point is None:
            return 0.0, 0.0
        lanes, samples = self.map.lanes, self.map.samples
        first, size = int(lanes.first[point.lane]), int(lanes.size[point.lane])
        k = first + int(np.abs(samples.s[first : first + size] - point.s).argmin())
        along, aside = float(samples.grade[k]), tan(float(samples.bank[k]))
        c, s = cos(yaw - point.heading), sin(yaw - point.heading)
        return atan(aside * c - along * s), -atan(along * c + aside * s)
