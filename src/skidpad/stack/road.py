"""What our stack reads from the map in a tick, as a kernel: its lane, where to steer, the next light."""

from __future__ import annotations

from math import nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, kernel
from skidpad.core.run import Function
from skidpad.core.settings.stack import BranchChoice, StackSettings
from skidpad.roads.kernels import LaneArrays, sample_kernel
from skidpad.roads.queries import RoadMap
from skidpad.stack.configurations import Functions
from skidpad.stack.control.steering import (
    SteeringRules,
    angle_to,
    look_distance,
    smooth,
    steer_towards,
    steering_rules,
)
from skidpad.stack.memory import KMH, Memory
from skidpad.stack.perception.lane_view import WAYS, follow_lane, view_lane
from skidpad.stack.perception.lights import LightScan, StopLines, Way, find_light, find_trigger


class RoadRules(NamedTuple):
    """How a stack uses the map."""

    first_branch: bool  # the map's first branch is taken, and no highway looked for (D-058)
    seeks_lights: bool
    steering: SteeringRules


def road_rules(functions: Functions, settings: StackSettings, dt: float) -> RoadRules:
    """Returns how a set of functions uses the map; dt: s, one tick."""
    return RoadRules(
        first_branch=settings.route is not BranchChoice.HIGHWAY,
        seeks_lights=Function.TLA in functions,
        steering=steering_rules(functions, settings, dt),
    )


class RoadParts(NamedTuple):
    """What a stack reads: behind one pointer, as each costs a kernel's call 0.3 us."""

    rules: RoadRules
    lanes: LaneArrays
    lines: StopLines


@kernel
def hold_parts(rules: RoadRules, map: Held[LaneArrays], lines: StopLines) -> Held[RoadParts]:
    """Returns rules, map and stop lines behind one pointer."""
    return Held(RoadParts(rules, map.value, lines))


@kernel
def read_road(
    memory: Memory, parts: Held[RoadParts], on_highway: NDArray[np.bool_], ways: Floats,
    x: float, y: float, z: float, yaw: float, v: float, drives: bool,
) -> Way:  # fmt: skip
    """Notes where the ego is, and returns what the stack makes of the map there.

    That is lane and offset from it, yaw error and curvature ahead (NaN: off every lane), steer, the line
    in whose trigger volume it stands, and the line ahead with the m to it; -1: none. drives: no
    supervisor does, so that the steer is smoothed.
    """
    m, r, a, lines = memory[0], parts.value.rules, parts.value.lanes, parts.value.lines
    view = view_lane(a, on_highway, r.first_branch, ways, x, y, z, yaw)
    m.lane, m.s, m.yaw_error = view.lane, view.s, view.yaw_error
    m.kappa = view.kappa
    m.bend, m.reference, m.reference_s = view.bend, view.reference, view.reference_s
    steer, trigger, line, distance = 0.0, -1, -1, nan
    if drives:
        angle = nan
        if view.reference >= 0:
            ahead, at = follow_lane(
                a, r.first_branch, ways, view.reference, view.reference_s,
                look_distance(r.steering, v * KMH), yaw,
            )  # fmt: skip
            if ahead >= 0:
                target = sample_kernel(a, ahead, at)
                angle = angle_to(x, y, yaw, target[0], target[1])
        steer = smooth(m, r.steering, steer_towards(r.steering, angle, v * KMH))
    if view.lane < 0:
        return -1, nan, nan, nan, steer, trigger, line, distance
    if r.seeks_lights:
        trigger = find_trigger(lines, view.lane, view.s)
        line, distance = find_light(a, lines, view.lane, view.s, x, y, yaw, v)
    return (
        view.lane, view.offset, view.yaw_error, view.curvature, steer, trigger, line, distance,
    )  # fmt: skip


@kernel
def read_curvature(
    memory: Memory, parts: Held[RoadParts], ways: Floats, distance: float, heading: float
) -> float:  # fmt: skip
    """Returns the 1/m of the lane that is followed, `distance` m on; 0 without one. heading: as it turns."""
    m, a = memory[0], parts.value.lanes
    if m.reference < 0:
        return 0.0
    lane, s = follow_lane(
        a, parts.value.rules.first_branch, ways, m.reference, m.reference_s, distance, heading
    )
    return float(sample_kernel(a, lane, s)[4]) if lane >= 0 else 0.0


class Road:
    """A map as one stack reads it.

    Attributes:
        map: The map.
        memory: The stack's.
        on_highway: By lane.
        ways: Room for branches of the lane ahead.
    """

    UNSAVED = ("ways",)

    def __init__(self, map: RoadMap, memory: Memory, rules: RoadRules) -> None:
        self.map, self.memory, self.scan = map, memory, LightScan(map)
        self.ways = np.empty((WAYS, 4))
        self.on_highway = np.zeros(len(map.lanes.road), dtype=np.bool_)
        self.is_traced = False
        self.follow_rules(rules)

    def follow_rules(self, rules: RoadRules) -> None:
        """Reads the map by these rules from now on."""
        self.parts = hold_parts(rules, self.map.held, self.scan.lines)

    def read(self, pose: Pose, v: float, drives: bool) -> Way:
        """Returns what `read_road` does; the first pose on a lane traces the highway (A-212)."""
        if not self.is_traced:
            point = self.map.project(pose.x, pose.y, pose.z)
            if point is not None:
                self.on_highway = np.isin(self.map.lanes.road, list(self.map.traced_roads(point)))
                self.is_traced = True
        return read_road(
            self.memory, self.parts, self.on_highway, self.ways,
            pose.x, pose.y, pose.z, pose.yaw, v, drives,
        )  # fmt: skip

    def curvature(self, distance: float, heading: float) -> float:
        """Returns the 1/m of the lane that is followed, so many m on; 0 without one."""
        return read_curvature(self.memory, self.parts, self.ways, distance, heading)
