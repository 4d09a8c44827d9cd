"""Patches of road with friction of their own, felt wheel by wheel (decision L-1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.geometry import Pose
from skidpad.core.setup import FrictionPatch
from skidpad.core.states import ActorStates
from skidpad.core.weather import Weather
from skidpad.physics.grip import GripParams, mu_at, physical_params, road_surface
from skidpad.physics.types import VehicleType
from skidpad.roads.queries import LanePoint, RoadMap

SIDES = ("both", "left", "right")
REACH = 12.0  # m from a vehicle's origin to its farthest wheel, and half a lane
SPACING = 1.0  # m, the largest distance of two lane samples
LISTED = 20  # roads that a message names


class Patches:
    """Resolves patches to friction at each wheel; fitted to the vehicles of a run."""

    def __init__(
        self, map: RoadMap, patches: Sequence[FrictionPatch], weather: Weather, grip: GripParams
    ) -> None:
        """weather, grip: of the road without patches.

        Raises:
            ConfigError: a patch lies on no road of the map, or says nothing or two things.
        """
        self.map, self.patches = map, tuple(patches)
        self.wheels: list[list[tuple[float, float]]] = []
        for k, patch in enumerate(self.patches):
            _check(k, patch, map)
        self.covered = [_surface_grip(p, weather, grip) for p in self.patches]
        self.bounds = np.array([_bounds(p, map) for p in self.patches])
        self.grip = grip

    def fit(self, types: Sequence[VehicleType]) -> None:
        """These are the vehicles from now on."""
        self.wheels = [
            [(x, y) for x in (t.x_front_axle, t.x_rear_axle) for y in (t.track / 2, -t.track / 2)]
            for t in types
        ]

    def fill(self, states: ActorStates, share: NDArray[np.float64]) -> None:
        """Set share (w, 4) at FL, FR, RL, RR to the friction under each wheel over that without patches."""
        count = len(self.wheels)
        x, y = states.x[:count, None], states.y[:count, None]
        low_x, low_y, high_x, high_y = self.bounds.T
        near = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
        for i in np.flatnonzero(near.any(axis=1) & states.present[:count]):
            c, s = cos(states.yaw[i]), sin(states.yaw[i])
            v = float(np.hypot(states.vx[i], states.vy[i]))
            for w, (forward, left) in enumerate(self.wheels[i]):
                at = (states.x[i] + forward * c - left * s, states.y[i] + forward * s + left * c)
                share[i, w] = self.ratio_at(float(at[0]), float(at[1]), float(states.z[i]), v)

    def ratio_at(self, x: float, y: float, z: float, v: float = 0.0) -> float:
        """Return the friction at a point of the road at a speed in m/s over that without patches.

        Where patches overlap the slippery one counts.
        """
        place = self.map.project(x, y, z)
        ratios = [
            self._ratio(k, v) for k, p in enumerate(self.patches) if self._covers(p, x, y, place)
        ]
        return min(ratios, default=1.0)

    def _ratio(self, k: int, v: float) -> float:
        ratio, covered = self.patches[k].mu_ratio, self.covered[k]
        if covered is None:
            return 1.0 if ratio is None else ratio
        return float(mu_at(covered, v) / mu_at(self.grip, v))

    def _covers(self, patch: FrictionPatch, x: float, y: float, place: LanePoint | None) -> bool:
        if patch.circle is not None:
            middle_x, middle_y, radius = patch.circle
            return hypot(x - middle_x, y - middle_y) <= radius
        if patch.polygon:
            return _inside(patch.polygon, x, y)
        if place is None or place.road != patch.road or patch.lane not in (None, place.lane_id):
            return False
        if abs(place.offset) > place.width / 2.0:
            return False
        on_side = patch.side == "both" or (place.offset > 0.0) == (patch.side == "left")
        return on_side and patch.s_from <= self.map.s_road(place) <= patch.s_to


def _surface_grip(patch: FrictionPatch, weather: Weather, grip: GripParams) -> GripParams | None:
    """Return the grip on what lies in a patch, at least as deep as the weather's; None: a plain ratio.

    Always by the physical model, which alone knows films and snow.
    """
    if patch.mu_ratio is not None:
        return None
    road = road_surface(weather)
    return physical_params(
        replace(
            road,
            film_mm=max(road.film_mm, patch.water_mm),
            ice_mm=max(road.ice_mm, patch.ice_mm),
            snow_mm=max(road.snow_mm, patch.snow_mm),
        ),
        grip.mu_ref,
    )


def _bounds(patch: FrictionPatch, map: RoadMap) -> tuple[float, float, float, float]:
    """Return the least and largest x and y at which a vehicle may touch a patch, m."""
    if patch.circle is not None:
        x, y, radius = patch.circle
        xs, ys = np.array([x - radius, x + radius]), np.array([y - radius, y + radius])
    elif patch.polygon:
        xs, ys = np.array(patch.polygon).T
    else:
        samples = _samples(patch, map)
        xs, ys = map.samples.x[samples], map.samples.y[samples]
    return (
        float(xs.min()) - REACH, float(ys.min()) - REACH,
        float(xs.max()) + REACH, float(ys.max()) + REACH,
    )  # fmt: skip


def _samples(patch: FrictionPatch, map: RoadMap) -> NDArray[np.bool_]:
    """Return which lane samples a stretch of road covers, (N,)."""
    lanes, samples = map.lanes, map.samples
    chosen = lanes.road[samples.lane] == patch.road
    if patch.lane is not None:
        chosen &= lanes.lane_id[samples.lane] == patch.lane
    covered: NDArray[np.bool_] = chosen & (samples.s_road >= patch.s_from - SPACING)
    return covered & (samples.s_road <= patch.s_to + SPACING)


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


def _check(k: int, patch: FrictionPatch, map: RoadMap) -> None:
    where = f"patches[{k}]{f' ({patch.name})' if patch.name else ''}"
    if patch.mu_ratio is not None:
        require_range(f"{where}.mu_ratio", patch.mu_ratio, 0.0, 2.0)
    require_choice(f"{where}.side", patch.side, SIDES)
    if sum((patch.circle is not None, bool(patch.polygon), patch.road is not None)) != 1:
        raise ConfigError(f"{where} needs a circle, a polygon or a road")
    if patch.road is None:
        return
    roads = sorted({int(road) for road in map.lanes.road})
    if patch.road not in roads:
        known = ", ".join(str(road) for road in roads[:LISTED])
        more = ", ..." if len(roads) > LISTED else ""
        raise ConfigError(f"{where}: map {map.name} has no road {patch.road}; it has {known}{more}")
    if not _samples(patch, map).any():
        on = map.samples.s_road[map.lanes.road[map.samples.lane] == patch.road]
        lanes = sorted({int(i) for i in map.lanes.lane_id[map.lanes.road == patch.road]})
        raise ConfigError(
            f"{where}: road {patch.road} has lanes {', '.join(f'{i}' for i in lanes)} and runs from "
            f"{on.min():.1f} to {on.max():.1f} m; the patch asks for lane {patch.lane} from "
            f"{patch.s_from:g} to {patch.s_to:g} m"
        )


def _inside(polygon: Sequence[tuple[float, float]], x: float, y: float) -> bool:
    """Even-odd rule."""
    inside = False
    x0, y0 = polygon[-1]
    for x1, y1 in polygon:
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) * (x1 - x0) / (y1 - y0):
            inside = not inside
        x0, y0 = x1, y1
    return inside
