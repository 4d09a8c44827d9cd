"""A human driver's eyes: who is in line of sight and range, and how their motion is perceived.

Sight lines are drawn in space from the driver's eye to five points of each body; vehicles and what
stands beside the road hide what lies behind and below them. Who is not seen hides nobody: of a body
that shows at most a sliver nothing reaches the driver, not even what it covers. Range is the
weather's (`physics.optics`); at night lit vehicles are seen by their lamps, everything else in the
ego's low beam. Walls, fences and the ground hide nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from math import cos, hypot, pi, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.kernels.jit import kernel
from skidpad.core.setup import Setup
from skidpad.core.specs import EyesSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.traffic.sight import DriverView, RoadLook, SeenActors
from skidpad.core.vocabulary import ActorKind, LightState, RangeModel
from skidpad.core.weather import Weather
from skidpad.physics.optics import label_range, seen_range
from skidpad.roads.roadside import Roadside
from skidpad.sensors.object_level.boxes import Boxes, posts_of
from skidpad.sensors.object_level.sight import ray_box

EGO = 0
FARTHEST = 300.0  # m that a driver attends to at most (ours)
LIGHT_FARTHEST = 200.0  # m likewise for the lamps of traffic lights (ours)
HALF_FIELD = 0.5 * pi + 0.2  # rad to each side: the horizontal field of view spans about 200 deg
LIGHT_HALF_ANGLE = 1.2  # rad between the head's axis and the traffic that can read it
POINT_HEIGHT = 0.85  # of a body's height at which its five points lie: window, roof edge, head
SEEN_POINTS = 2  # of five that must be free
# Rate of the visual angle below which closing is not noticed: Hoffmann and Mortimer (1996), Accident
# Analysis and Prevention 28(4), abstract.
LOOMING = 0.003  # rad/s
FLOODED_PERCENT = 50.0  # of the road under water from which water is seen to stand (ours)


class _Seen(NamedTuple):
    tick: int
    actors: SeenActors
    lights: dict[int, LightState]


class Eyes:
    """The eyes of one driver during one run; `look` in every tick, `view` when the driver acts."""

    def __init__(self, spec: EyesSpec, roadside: Roadside, table: ActorTable, setup: Setup) -> None:
        self.spec, self.table, self.dt = spec, table, setup.dt
        self.road = road_look(setup.weather)
        physical = setup.range_model is RangeModel.PHYSICAL
        self.visibility = min(seen_range(setup.weather), FARTHEST) if physical else FARTHEST
        self._reach = _reach(table, setup.weather) if physical else np.full(len(table), FARTHEST)
        self._heads = roadside.heads
        self._fixed = posts_of(roadside)
        self._free = np.zeros(len(table), dtype=np.bool_)
        self._queue: deque[_Seen] = deque(maxlen=round(spec.reaction / setup.dt) + 1)
        self._states = ActorStates.empty(len(table))

    def look(
        self,
        tick: int,
        states: ActorStates,
        lights: Mapping[int, LightState],
        braking: Flags,
    ) -> None:
        """Sees the world of this tick; row 0 is the ego. braking: (n,) whether brake lamps are on."""
        s, t = states, self.table
        eye = np.array([s.x[EGO], s.y[EGO], s.z[EGO] + self.spec.mount.z, s.yaw[EGO]])
        boxes = Boxes(s.x, s.y, s.z, s.yaw, t.length, t.width, t.height)
        in_sight(eye, boxes, s.present, self._reach, self._fixed, self._free)
        rows = np.flatnonzero(self._free)
        vx, vy = perceived_velocity(s, rows, t.width[rows])
        actors = SeenActors(
            rows, t.kind[rows], s.x[rows], s.y[rows], s.z[rows], s.yaw[rows], vx, vy,
            t.length[rows], t.width[rows], braking[rows],
        )  # fmt: skip
        self._states = states
        self._queue.append(_Seen(tick, actors, self._lights(eye, boxes, lights)))

    def view(self) -> DriverView:
        """Returns what the driver acts on in the tick of the last look: others as of `reaction` s before."""
        s, seen, now = self._states, self._queue[0], self._queue[-1].tick
        c, sn = cos(s.yaw[EGO]), sin(s.yaw[EGO])
        return DriverView(
            tick=now,
            pose=s.pose(EGO),
            speed=float(c * s.vx[EGO] + sn * s.vy[EGO]),
            yaw_rate=float(s.yaw_rate[EGO]),
            age=(now - seen.tick) * self.dt,
            actors=seen.actors,
            lights=seen.lights,
            road=self.road,
            visibility=self.visibility,
        )

    def _lights(
        self, eye: Floats, boxes: Boxes, lights: Mapping[int, LightState]
    ) -> dict[int, LightState]:
        """Returns the states of the heads in sight, by signal id."""
        seen: dict[int, LightState] = {}
        farthest = min(self.visibility, LIGHT_FARTHEST)
        for head in self._heads:
            dx, dy = head.x - eye[0], head.y - eye[1]
            d = hypot(dx, dy)
            if d > farthest or head.signal not in lights:
                continue
            ahead = cos(eye[3]) * dx + sin(eye[3]) * dy > d * cos(HALF_FIELD)
            faces = cos(eye[3] - head.heading) > cos(LIGHT_HALF_ANGLE)
            if ahead and faces and is_free(eye, head.x, head.y, head.z, boxes, self._free, -1):
                seen[head.signal] = lights[head.signal]
        return seen


@kernel
def is_free(
    eye: Floats, x: float, y: float, z: float, boxes: Boxes, solid: Flags, target: int
) -> bool:
    """Returns whether no solid box but `target` stands in the line from the eye (x, y, z, yaw) to a point."""
    dx, dy = x - eye[0], y - eye[1]
    d = np.hypot(dx, dy)
    if d < 1e-6:
        return True
    ux, uy = dx / d, dy / d
    for j in range(boxes.x.size):
        if j == target or not solid[j]:
            continue
        bx, by = boxes.x[j] - eye[0], boxes.y[j] - eye[1]
        radius = 0.5 * np.hypot(boxes.length[j], boxes.width[j])
        along = bx * ux + by * uy
        if along < -radius or along > d + radius or abs(bx * uy - by * ux) > radius:
            continue
        c, s = np.cos(boxes.yaw[j]), np.sin(boxes.yaw[j])
        hit = ray_box(bx, by, c, s, 0.5 * boxes.length[j], 0.5 * boxes.width[j], ux, uy)
        if hit < d - 0.1:
            height = eye[2] + (z - eye[2]) * hit / d
            if boxes.z[j] - 0.5 < height < boxes.z[j] + boxes.height[j]:
                return False
    return True


@kernel
def in_sight(
    eye: Floats, actors: Boxes, present: Flags, reach: Floats, fixed: Boxes, out: Flags
) -> None:
    """Writes which actors are seen from the eye (x, y, z, yaw) into `out`; row 0 is the eye's own car.

    reach: (n,) m beyond which an actor cannot be seen; out: (n,).
    """
    out[:] = False
    all_fixed = np.ones(fixed.x.size, dtype=np.bool_)
    for i in np.argsort(np.hypot(actors.x - eye[0], actors.y - eye[1])):
        dx, dy = actors.x[i] - eye[0], actors.y[i] - eye[1]
        d = np.hypot(dx, dy)
        if i == 0 or not present[i] or not d <= reach[i]:
            continue
        if d * np.cos(HALF_FIELD) > np.cos(eye[3]) * dx + np.sin(eye[3]) * dy:
            continue
        c, s = np.cos(actors.yaw[i]), np.sin(actors.yaw[i])
        z = actors.z[i] + POINT_HEIGHT * actors.height[i]
        seen = 0
        for a, b in ((0.0, 0.0), (0.5, 0.5), (0.5, -0.5), (-0.5, 0.5), (-0.5, -0.5)):
            x = actors.x[i] + c * a * actors.length[i] - s * b * actors.width[i]
            y = actors.y[i] + s * a * actors.length[i] + c * b * actors.width[i]
            if is_free(eye, x, y, z, actors, out, i) and is_free(
                eye, x, y, z, fixed, all_fixed, -1
            ):
                seen += 1
        out[i] = seen >= SEEN_POINTS


def perceived_velocity(
    s: ActorStates, rows: NDArray[np.int64], width: Floats
) -> tuple[Floats, Floats]:
    """Returns (k,) x and y of the velocities as perceived, in the world frame.

    Closing or falling back whose looming stays below the threshold is not noticed: the radial part
    of the relative velocity then reads 0.
    """
    dx, dy = s.x[rows] - s.x[EGO], s.y[rows] - s.y[EGO]
    d = np.maximum(np.hypot(dx, dy), 1.0)
    ux, uy = dx / d, dy / d
    radial = (s.vx[rows] - s.vx[EGO]) * ux + (s.vy[rows] - s.vy[EGO]) * uy
    unnoticed = np.where(width * np.abs(radial) / (d * d) < LOOMING, radial, 0.0)
    return s.vx[rows] - unnoticed * ux, s.vy[rows] - unnoticed * uy


def road_look(weather: Weather) -> RoadLook:
    """Returns what the road looks like in a weather."""
    if weather.ice_thickness > 0.0:
        return RoadLook.ICE
    if weather.snow_depth_mm > 0.0:
        return RoadLook.SNOW
    if weather.precipitation_deposits >= FLOODED_PERCENT:
        return RoadLook.FLOODED
    if max(weather.wetness, weather.precipitation, weather.precipitation_deposits) > 0.0:
        return RoadLook.WET
    return RoadLook.DRY


def _reach(table: ActorTable, weather: Weather) -> Floats:
    """Returns (n,) m at which each actor can be seen."""
    by_outline = label_range(weather)
    by_lamps = seen_range(weather) if weather.is_night else 0.0
    lit = table.kind <= int(ActorKind.MOTORCYCLE)
    reach: Floats = np.minimum(np.where(lit, max(by_outline, by_lamps), by_outline), FARTHEST)
    return reach
