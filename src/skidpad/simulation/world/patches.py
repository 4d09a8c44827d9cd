"""Patches of road with friction of their own, felt wheel by wheel (decision L-1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.geometry import Pose
from skidpad.core.setup import FrictionPatch
from skidpad.core.states import ActorStates
from skidpad.physics.types import VehicleType
from skidpad.roads.queries import LanePoint, RoadMap

SIDES = ("both", "left", "right")


class Patches:
    """Resolves patches to friction at each wheel; fitted to the vehicles of a run."""

    def __init__(self, map: RoadMap, patches: Sequence[FrictionPatch]) -> None:
        self.map, self.patches = map, tuple(patches)
        self.wheels: list[list[tuple[float, float]]] = []
        for k, patch in enumerate(self.patches):
            _check(k, patch)

    def fit(self, types: Sequence[VehicleType]) -> None:
        """These are the vehicles from now on."""
        self.wheels = [
            [(x, y) for x in (t.x_front_axle, t.x_rear_axle) for y in (t.track / 2, -t.track / 2)]
            for t in types
        ]

    def fill(self, states: ActorStates, share: NDArray[np.float64]) -> None:
        """Set share (w, 4) at FL, FR, RL, RR to the ratio of the patch under each wheel."""
        for i, wheels in enumerate(self.wheels):
            if not states.present[i]:
                continue
            c, s = cos(states.yaw[i]), sin(states.yaw[i])
            for w, (forward, left) in enumerate(wheels):
                x = float(states.x[i] + forward * c - left * s)
                y = float(states.y[i] + forward * s + left * c)
                share[i, w] = self.ratio_at(x, y, float(states.z[i]))

    def ratio_at(self, x: float, y: float, z: float) -> float:
        """Ratio at a point of the road; where patches overlap the slippery one counts."""
        place = self.map.project(x, y, z)
        ratio = [p.mu_ratio for p in self.patches if self._covers(p, x, y, place)]
        return min(ratio, default=1.0)

    def _covers(self, patch: FrictionPatch, x: float, y: float, place: LanePoint | None) -> bool:
        if patch.polygon:
            return _inside(patch.polygon, x, y)
        if place is None or place.road != patch.road or patch.lane not in (None, place.lane_id):
            return False
        if abs(place.offset) > place.width / 2.0:
            return False
        on_side = patch.side == "both" or (place.offset > 0.0) == (patch.side == "left")
        return on_side and patch.s_from <= self.map.s_road(place) <= patch.s_to


@dataclass(frozen=True, slots=True)
class FrictionZone:
    """An upright box in which every tyre has this tire_friction."""

    pose: Pose  # of its middle
    half: tuple[float, float, float]  # m
    tire_friction: float


def in_zone(zone: FrictionZone, s: ActorStates) -> NDArray[np.bool_]:
    """(n,) whose position is inside; feet up to 1 m below or above the box count."""
    c, sn = cos(zone.pose.yaw), sin(zone.pose.yaw)
    dx, dy = s.x - zone.pose.x, s.y - zone.pose.y
    inside: NDArray[np.bool_] = (
        (np.abs(dx * c + dy * sn) <= zone.half[0])
        & (np.abs(dy * c - dx * sn) <= zone.half[1])
        & (np.abs(s.z - zone.pose.z) <= zone.half[2] + 1.0)
    )
    return inside


def _check(k: int, patch: FrictionPatch) -> None:
    require_range(f"patches[{k}].mu_ratio", patch.mu_ratio, 0.0, 2.0)
    require_choice(f"patches[{k}].side", patch.side, SIDES)
    if bool(patch.polygon) == (patch.road is not None):
        raise ConfigError(f"patches[{k}] needs either a polygon or a road")


def _inside(polygon: Sequence[tuple[float, float]], x: float, y: float) -> bool:
    """Even-odd rule."""
    inside = False
    x0, y0 = polygon[-1]
    for x1, y1 in polygon:
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
        x0, y0 = x1, y1
    return inside
