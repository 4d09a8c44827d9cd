"""Patches of road with friction of their own, felt wheel by wheel (decision L-1)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose
from skidpad.core.states import ActorStates
from skidpad.core.surface import SurfacePatch
from skidpad.physics.grip import GripParams, Road, mu_at, road_surface, stiffness_at
from skidpad.physics.types import VehicleType
from skidpad.roads.queries import LanePoint, RoadMap

Floats = NDArray[np.float64]
# by road and lane: from and to along the road in m, and the share of the friction there
LaneFrictions = dict[tuple[int, int], list[tuple[float, float, float]]]

REACH = 12.0  # m from a vehicle's origin to its farthest wheel, and half a lane
SPACING = 1.0  # m, the largest distance of two lane samples
LISTED = 20  # roads that a message names
NO_PATCH = -1.0  # stiffness and film where no patch says them


class Patches:
    """Resolves patches to friction at each wheel; fitted to the vehicles of a run."""

    def __init__(
        self,
        map: RoadMap,
        patches: Sequence[SurfacePatch],
        road: Road,
        lanes: LaneFrictions | None = None,
    ) -> None:
        """road: without patches. lanes: shares of its friction that materials make, under them.

        Raises:
            ConfigError: a patch lies on no road of the map, or none of its lanes has such a stretch.
        """
        self.map, self.patches = map, tuple(patches)
        self.wheels: list[list[tuple[float, float]]] = []
        self.tyres: list[str] = []
        for k, patch in enumerate(self.patches):
            _check(k, patch, map)
        self.lanes = lanes or {}
        everywhere = [(-np.inf, -np.inf, np.inf, np.inf)] if self.lanes else []
        self.bounds = np.array([*everywhere, *(_bounds(p, map) for p in self.patches)])
        self.lay(road)

    def lay(self, road: Road) -> None:
        """The road without patches is this from now on."""
        self.road = road
        self._outside: dict[str, GripParams] = {}
        self._covered: dict[str, list[GripParams | None]] = {}
        self._know(road.tyres)

    def _know(self, tyres: str) -> None:
        """Work out what these tyres hold outside and inside of every patch."""
        if tyres not in self._outside:
            self._outside[tyres] = self.road.params(tyres)
            self._covered[tyres] = [_surface_grip(p, self.road, tyres) for p in self.patches]

    def fit(self, types: Sequence[VehicleType]) -> None:
        """These are the vehicles from now on."""
        self.wheels = [
            [(x, y) for x in (t.x_front_axle, t.x_rear_axle) for y in (t.track / 2, -t.track / 2)]
            for t in types
        ]
        self.tyres = [t.tyres or self.road.tyres for t in types]

    def fill(self, states: ActorStates, share: Floats, stiffness: Floats, film: Floats) -> None:
        """Set what patches do to the wheels, (w, 4) at FL, FR, RL, RR.

        share: of the friction without patches. stiffness: over the dry one. film: of water, m.
        """
        share[:] = 1.0
        stiffness[:] = film[:] = NO_PATCH
        count = len(self.wheels)
        x, y = states.x[:count, None], states.y[:count, None]
        low_x, low_y, high_x, high_y = self.bounds.T
        near = (x >= low_x) & (x <= high_x) & (y >= low_y) & (y <= high_y)
        for i in np.flatnonzero(near.any(axis=1) & states.present[:count]):
            c, s = cos(states.yaw[i]), sin(states.yaw[i])
            v = float(np.hypot(states.vx[i], states.vy[i]))
            self._know(self.tyres[i])
            for k, (forward, left) in enumerate(self.wheels[i]):
                at = (states.x[i] + forward * c - left * s, states.y[i] + forward * s + left * c)
                found = self.effect_at(at[0], at[1], float(states.z[i]), v, self.tyres[i])
                share[i, k], stiffness[i, k], film[i, k] = found

    def ratio_at(self, x: float, y: float, z: float, v: float = 0.0) -> float:
        """Return the friction at a point of the road at a speed in m/s over that without patches.

        Where patches overlap the slippery one counts.
        """
        return self.effect_at(x, y, z, v, self.road.tyres)[0]

    def effect_at(
        self, x: float, y: float, z: float, v: float, tyres: str
    ) -> tuple[float, float, float]:
        """Return share of friction, stiffness and film of the most slippery patch at a point.

        The lane's material multiplies the share, whatever lies on it.
        """
        place = self.map.project(float(x), float(y), z)
        under = [k for k, p in enumerate(self.patches) if self._covers(p, x, y, place)]
        found = [self._effect(k, v, tyres) for k in under]
        share, stiffness, film = min(found, default=(1.0, NO_PATCH, NO_PATCH))
        return share * self._of_lane(place), stiffness, film

    def _of_lane(self, place: LanePoint | None) -> float:
        """Return the share that the material of the lane under a point makes."""
        if not self.lanes or place is None or abs(place.offset) > place.width / 2.0:
            return 1.0
        s = self.map.s_road(place)
        stretches = self.lanes.get((place.road, place.lane_id), ())
        return next((share for low, high, share in stretches if low <= s < high), 1.0)

    def _effect(self, k: int, v: float, tyres: str) -> tuple[float, float, float]:
        ratio, covered = self.patches[k].friction, self._covered[tyres][k]
        if covered is None:
            return (1.0 if ratio is None else ratio), NO_PATCH, NO_PATCH
        share = float(mu_at(covered, v) / mu_at(self._outside[tyres], v))
        return share, float(stiffness_at(covered, v)), covered.film

    def _covers(self, patch: SurfacePatch, x: float, y: float, place: LanePoint | None) -> bool:
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
        low, high = patch.stretch
        return on_side and low <= self.map.s_road(place) <= high


def _surface_grip(patch: SurfacePatch, road: Road, tyres: str) -> GripParams | None:
    """Return the grip on what lies in a patch, at least as deep as the weather's; None: a plain ratio.

    Always by the physical model, which alone knows films and snow.
    """
    if patch.friction is not None:
        return None
    outside = road_surface(road.weather)
    return road.params(
        tyres,
        replace(
            outside,
            film_mm=max(outside.film_mm, patch.water_mm),
            ice_mm=max(outside.ice_mm, patch.ice_mm),
            snow_mm=max(outside.snow_mm, patch.snow_mm),
        ),
    )


def _bounds(patch: SurfacePatch, map: RoadMap) -> tuple[float, float, float, float]:
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


def _samples(patch: SurfacePatch, map: RoadMap) -> NDArray[np.bool_]:
    """Return which lane samples a stretch of road covers, (N,)."""
    lanes, samples = map.lanes, map.samples
    chosen = lanes.road[samples.lane] == patch.road
    if patch.lane is not None:
        chosen &= lanes.lane_id[samples.lane] == patch.lane
    low, high = patch.stretch
    covered: NDArray[np.bool_] = chosen & (samples.s_road >= low - SPACING)
    return covered & (samples.s_road <= high + SPACING)


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


def _check(k: int, patch: SurfacePatch, map: RoadMap) -> None:
    where = f"patches[{k}]{f' ({patch.name})' if patch.name else ''}"
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
            f"{patch.stretch[0]:g} to {patch.stretch[1]:g} m"
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
