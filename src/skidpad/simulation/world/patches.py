"""Patches of road with friction of their own, felt wheel by wheel (decision L-1)."""

from __future__ import annotations

from collections.abc import Sequence, Sized
from dataclasses import dataclass, replace
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.environment.surface import (
    PATH_OFFSET,
    PatchError,
    SurfacePatch,
    place_in_file,
    present_patches,
)
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import hold
from skidpad.core.states import ActorStates
from skidpad.physics.drying import dried_film
from skidpad.physics.grip import GripParams, Road, road_surface
from skidpad.physics.slush import slush_grip
from skidpad.physics.types import VehicleType
from skidpad.roads.bridges import spread_over_bridges
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.patch_kernel import (
    ANY,
    BESIDE,
    BOTH,
    LEFT,
    NO_PATCH,
    PATHS,
    RIGHT,
    PatchArrays,
    WheelPlaces,
    fill_patches,
)
from skidpad.simulation.world.placed import Places, places_for
from skidpad.simulation.world.sheet_flow import SheetFlow

__all__ = ["NO_PATCH", "FrictionZone", "LaneFrictions", "Patches", "zoned_tyres"]

# by road and lane: from and to along the road in m, and the share of the friction there
LaneFrictions = dict[tuple[int, int], list[tuple[float, float, float]]]

REACH = 12.0  # m from a vehicle's origin to its farthest wheel, and half a lane
SPACING = 1.0  # m, the largest distance of two lane samples
USUAL_SPEED = 14.0  # m/s, where the map gives no limit
LISTED = 20  # roads that a message names
SIDES = {
    "both": BOTH,
    "left": LEFT,
    "right": RIGHT,
    "wheel_paths": PATHS,
    "beside_wheel_paths": BESIDE,
}


class Patches:
    """Resolves patches to friction at each wheel; fitted to the vehicles of a run."""

    UNSAVED = ("_held", "_held_arrays")  # made of `_arrays`
    _held_arrays: PatchArrays | None = None

    def __init__(
        self,
        map: RoadMap,
        patches: Sequence[SurfacePatch],
        road: Road,
        lanes: LaneFrictions | None = None,
        sheet_flow: SheetFlow | None = None,
    ) -> None:
        """road: without patches. lanes: shares of its friction that materials make, under them.

        sheet_flow: what rain adds to the patches; None: nothing.

        Raises:
            PatchError: a patch lies on no road of the map, none of its lanes has such a stretch, or it
                asks for bridges where the map names none.
        """
        self.map, self.lanes, self.sheet_flow = map, lanes or {}, sheet_flow
        self.patches = fit_patches(map, patches)
        self._place, self._tyres = np.zeros((0, 4, 2)), list[str]()
        self.lay(road)

    def lay(self, road: Road) -> None:
        """The road without patches is this from now on."""
        self.road = road
        self._here = present_patches(self.patches, road.weather.air_temperature_c)
        if self.sheet_flow is not None:
            self._here += self.sheet_flow.patches(road.weather)
        self._pack()

    def set_vehicles(self, types: Sequence[VehicleType]) -> None:
        """These are the vehicles from now on."""
        self._place = wheel_places(types)
        self._tyres = [t.tyres for t in types]
        self._pack()

    def _pack(self) -> None:
        """Everything as the kernels read it: patches, and what every kind of tyre here makes of them."""
        own = [name or self.road.tyres for name in self._tyres]
        self.kinds = sorted({self.road.tyres, *own})
        self._wheels = WheelPlaces(
            self._place, np.array([self.kinds.index(n) for n in own], np.int64)
        )
        self._arrays = _arrays(self.map, self._here, self.lanes, self.road, self.kinds)

    def _hold(self) -> None:
        """Hands the patches to the kernels, after a change or from a checkpoint."""
        self._held_arrays, self._held = self._arrays, hold(self._arrays)

    def fill(
        self, states: ActorStates, placed: Places, share: Floats, stiffness: Floats, film: Floats
    ) -> None:
        """Set what patches do to the wheels, (w, 4) at FL, FR, RL, RR.

        placed: where the vehicles stood last. share: of the friction without patches. stiffness: over
        the dry one. film: of water, m.
        """
        if self._held_arrays is not self._arrays:
            self._hold()
        fill_patches(
            self.map.held, self._held, self._wheels, states, placed, share, stiffness, film
        )

    def lane_shares(self) -> Floats:
        """Returns the friction at the middle of each lane over that without patches, (N,) at its samples.

        At the speed limit there, by the more slippery of the two wheel paths; the tyres are those of the run.
        """
        samples, n = self.map.samples, len(self.map.samples.x)
        states = ActorStates.empty(n)
        states.x[:], states.y[:], states.z[:] = samples.x, samples.y, samples.z
        states.yaw[:], states.present[:] = samples.heading, True
        states.vx[:] = np.where(np.isnan(samples.limit), USUAL_SPEED, samples.limit)
        sides = np.array([(0.0, left) for left in (PATH_OFFSET, -PATH_OFFSET) * 2])
        placed = places_for(np.zeros(n), np.zeros(n))
        placed["lane"], placed["sample"] = samples.lane, np.arange(n)
        shares = self._share_of_places(np.tile(sides, (n, 1, 1)), states, placed)
        return np.asarray(shares.min(axis=1))

    def ratio_at(self, x: float, y: float, z: float, v: float = 0.0) -> float:
        """Return the friction at a point of the road at a speed in m/s over that without patches.

        Where patches overlap the slippery one counts. The tyres are those of the run.
        """
        states, at = ActorStates.empty(1), np.zeros((1, 4, 2))
        states.x[0], states.y[0], states.z[0], states.vx[0] = x, y, z, v
        states.present[0] = True
        return float(self._share_of_places(at, states, places_for(np.zeros(1), np.zeros(1)))[0, 0])

    def _share_of_places(self, wheels: Floats, states: ActorStates, placed: Places) -> Floats:
        """Returns the friction at wheels (n, 4, 2) of the run's tyres over that without patches, (n, 4)."""
        n = len(wheels)
        tyres = np.full(n, self.kinds.index(self.road.tyres), np.int64)
        if self._held_arrays is not self._arrays:
            self._hold()
        share, stiffness, film = (np.zeros((n, 4)) for _ in range(3))
        fill_patches(
            self.map.held, self._held, WheelPlaces(wheels, tyres), states, placed,
            share, stiffness, film,
        )  # fmt: skip
        return share


def wheel_places(types: Sequence[VehicleType]) -> Floats:
    """Returns how far forward and left of its vehicle's origin each wheel is, m, (w, 4, 2)."""
    places = [
        [(x, y) for x in (t.x_front_axle, t.x_rear_axle) for y in (t.track / 2, -t.track / 2)]
        for t in types
    ]
    return np.array(places, dtype=np.float64).reshape(-1, 4, 2)


def _arrays(
    map: RoadMap,
    patches: Sequence[SurfacePatch],
    lanes: LaneFrictions,
    road: Road,
    kinds: Sequence[str],
) -> PatchArrays:
    """Returns the patches as arrays for the kernels, with the grip of each kind of tyre on them."""
    corners = [np.array(p.polygon, dtype=np.float64).reshape(-1, 2) for p in patches]
    materials = [lanes.get(key, []) for key in _lane_names(map)]
    return PatchArrays(
        bounds=np.array([_bounds(p, map) for p in patches]).reshape(-1, 4),
        circle=np.array([p.circle or (0.0, 0.0, -1.0) for p in patches]).reshape(-1, 3),
        corner_start=_starts(corners),
        corner=np.concatenate([np.zeros((0, 2)), *corners]),
        stretch=np.array([_stretch_key(p) for p in patches], dtype=np.int64).reshape(-1, 3),
        s=np.array([p.stretch for p in patches], dtype=np.float64).reshape(-1, 2),
        ratio=np.array([np.nan if p.friction is None else p.friction for p in patches]),
        outside=np.array([road.params(kind) for kind in kinds]),
        covered=np.array(
            [[_surface_grip(p, road, kind) for p in patches] for kind in kinds], dtype=np.float64
        ).reshape(len(kinds), len(patches), len(GripParams._fields)),
        material_start=_starts(materials),
        material=np.array([m for of in materials for m in of], dtype=np.float64).reshape(-1, 3),
        near=np.zeros(len(patches), np.int64),
    )


def _lane_names(map: RoadMap) -> list[tuple[int, int]]:
    """Returns (road id, lane id) of every lane of the map."""
    return list(zip(map.lanes.road.tolist(), map.lanes.lane_id.tolist(), strict=True))


def _starts(parts: Sequence[Sized]) -> NDArray[np.int64]:
    """Return where each part begins when all stand one behind the other, and where the last one ends."""
    return np.cumsum([0, *(len(part) for part in parts)], dtype=np.int64)


def _stretch_key(patch: SurfacePatch) -> tuple[int, int, int]:
    """Returns (road, lane, side) as codes; ANY and BOTH where the patch does not restrict them."""
    if patch.road is None:
        return ANY, ANY, BOTH
    return patch.road, ANY if patch.lane is None else patch.lane, SIDES[patch.side]


def _surface_grip(patch: SurfacePatch, road: Road, tyres: str) -> GripParams:
    """Return the grip on what lies in a patch, at least as deep as the weather's.

    Always by the physical model, which alone knows films and snow.
    """
    outside = road_surface(road.weather)
    in_paths = patch.side == "wheel_paths"
    filled = 0.01 * road.weather.precipitation_deposits if patch.by_deposits else 1.0
    water_mm = dried_film(filled * patch.water_mm, patch.dried_min, road.weather, traffic=in_paths)
    surface = replace(
        outside,
        film_mm=max(outside.film_mm, water_mm),
        ice_mm=max(outside.ice_mm, patch.ice_mm),
        snow_mm=max(outside.snow_mm, patch.snow_mm),
    )
    if patch.slush_mm > 0.0:
        return slush_grip(road, surface, patch.slush_mm, tyres)
    return road.params(tyres, surface)


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
    """An upright box in which a tyre has this tire_friction."""

    pose: Pose  # of its middle
    half: tuple[float, float, float]  # m
    tire_friction: float


def zoned_tyres(
    zones: Sequence[FrictionZone], own: Floats, wheels: Floats, s: ActorStates
) -> Floats:
    """Returns tire_friction at each wheel, (w, 4): `own`, or that of the slipperiest zone that it is in.

    wheels: their places on their vehicles. Feet up to 1 m below or above a box count.
    """
    least = np.full_like(own, np.inf)
    c, sn = np.cos(s.yaw)[:, None], np.sin(s.yaw)[:, None]
    x = s.x[:, None] + wheels[:, :, 0] * c - wheels[:, :, 1] * sn
    y = s.y[:, None] + wheels[:, :, 0] * sn + wheels[:, :, 1] * c
    for zone in zones:
        c0, s0 = cos(zone.pose.yaw), sin(zone.pose.yaw)
        dx, dy = x - zone.pose.x, y - zone.pose.y
        inside = (
            (np.abs(dx * c0 + dy * s0) <= zone.half[0])
            & (np.abs(dy * c0 - dx * s0) <= zone.half[1])
            & (np.abs(s.z - zone.pose.z) <= zone.half[2] + 1.0)[:, None]
        )
        least[inside] = np.minimum(least[inside], zone.tire_friction)
    return np.where(np.isfinite(least), least, own)


def fit_patches(map: RoadMap, patches: Sequence[SurfacePatch]) -> tuple[SurfacePatch, ...]:
    """Returns the patches as they lie on a map, those of its bridges one by one.

    Raises PatchError where a patch lies on no road of the map, none of its lanes has such a stretch, or it
    asks for bridges where the map names none.
    """
    for k, patch in enumerate(patches):
        _check(k, patch, map)
    return spread_over_bridges(map, patches)


def _check(k: int, patch: SurfacePatch, map: RoadMap) -> None:
    """Raises PatchError where the patch's road is unknown or its stretch covers nothing of the lane."""
    where = place_in_file(k, patch)
    if patch.road is None:
        return
    roads = sorted({int(road) for road in map.lanes.road})
    if patch.road not in roads:
        known = ", ".join(str(road) for road in roads[:LISTED])
        more = ", ..." if len(roads) > LISTED else ""
        raise PatchError(f"{where}: map {map.name} has no road {patch.road}; it has {known}{more}")
    if not _samples(patch, map).any():
        on = map.samples.s_road[map.lanes.road[map.samples.lane] == patch.road]
        lanes = sorted({int(i) for i in map.lanes.lane_id[map.lanes.road == patch.road]})
        raise PatchError(
            f"{where}: road {patch.road} has lanes {', '.join(f'{i}' for i in lanes)} and runs from "
            f"{on.min():.1f} to {on.max():.1f} m; the patch asks for lane {patch.lane} from "
            f"{patch.stretch[0]:g} to {patch.stretch[1]:g} m"
        )
