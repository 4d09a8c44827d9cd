"""The object level: what cameras and radar would report, computed from boxes (decision M-3).

For campaigns of thousands of runs. Each vehicle is its box; visible vertical faces are cut into
strips and the strips into runs of pixels, nearer vehicles hide farther ones column by column. The
radar casts the very rays of the pixel level against boxes, barriers and the road's plane.

Not modelled here: roofs of vehicles, glass and wheels, crests of hills. A vehicle on another
level of an overpass counts as hidden by deck and parapet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints, Segments
from skidpad.core.inputs import Beam
from skidpad.core.jit import Held, hold, inner_kernel, kernel
from skidpad.core.specs import CameraSpec, Modality, RadarSpec, SensorSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind
from skidpad.core.weather import Weather
from skidpad.physics.optics import label_range
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.roadside import Roadside
from skidpad.sensors.boxes import (
    Boxes,
    Mount,
    Walls,
    boxes_in_view,
    mount_of,
    placed,
    posts_of,
    walls_of,
)
from skidpad.sensors.object_radar import Antenna, antenna_of, cast_radar, road_slope

Floats = NDArray[np.float64]

SIGHT = 150.0  # m, boxes farther away are ignored: 80 m is the last range that any tier reads
NEAR = 0.1  # m, near clip
STRIP = 0.75  # m of a long face per strip
MIN_STRIPS = 6
MAX_STRIPS = 24
MAX_RUNS = 4  # vertical runs per strip
BIN = 2  # px per occlusion column
WIDEN = 1.3  # of the horizontal view before culling: a pitched camera sees wider at its edges
# A vehicle this far above or below the ego's level is on another road (grades are at most 6 %).
LEVEL_GAP = 1.5  # m
LEVEL_GRADE = 0.065
LEVEL = np.zeros(2)


class Camera(NamedTuple):
    """A camera placed in the world: origin (3,), rotation (3, 3) with columns forward, left, up."""

    origin: Floats
    rotation: Floats
    focal: float
    width: int
    height: int
    runs: int  # vertical runs per strip


class Surroundings(NamedTuple):
    """Everything that sensors can meet: actors and what stands beside the road."""

    states: ActorStates
    boxes: Boxes  # of the actors
    labels: NDArray[np.uint8]  # (n,) SemanticClass of the actors
    walls: Walls
    posts: Boxes


class ObjectSuite:
    """Segments of every depth camera and points of every radar, tick by tick.

    weather: limits the ranges of cameras and radar; None: it does not.
    lanes: for the slope of the road that the radar meets; None: level ground.
    """

    def __init__(
        self,
        roadside: Roadside,
        table: ActorTable,
        specs: Sequence[SensorSpec],
        seed: int,
        dt: float,
        weather: Weather | None = None,
        lanes: Held[LaneArrays] | None = None,
    ) -> None:
        self.table = table
        self.cameras = [
            (s, mount_of(s.mount))
            for s in specs
            if isinstance(s, CameraSpec) and s.modality is Modality.DEPTH
        ]
        self._specs, self._seed, self._dt = specs, seed, dt
        self.see_through(weather, None)
        self.labels = np.array([LABEL_OF_KIND[ActorKind(k)] for k in table.kind], dtype=np.uint8)
        self.lanes = lanes
        self.walls = walls_of(roadside)
        self.posts = posts_of(roadside)
        self._states: ActorStates | None = None

    def see_through(self, weather: Weather | None, beam: Beam | None) -> None:
        """The weather that limits the ranges, None: it does not; beam None: as by night (A-218)."""
        self.antennas = [
            antenna_of(s, self._seed, self._dt, weather)
            for s in self._specs
            if isinstance(s, RadarSpec)
        ]
        lit = Beam.LOW if beam is None else beam
        self.limit = SIGHT if weather is None else min(label_range(weather, lit), SIGHT)

    def segments(self, states: ActorStates) -> dict[str, Segments]:
        """What each depth camera sees of vehicles, by camera id."""
        around = self._around(states)
        seen = {}
        for spec, mount in self.cameras:
            rows, labels = _segments(around, mount, spec.focal, spec.width, spec.height, self.limit)
            u, width, top, bottom, depth = rows.T
            seen[spec.id] = Segments(u, width, top, bottom, depth, labels)
        return seen

    def radar(self, tick: int, states: ActorStates) -> RadarPoints:
        """Returns of the first radar; none when the suite has no radar."""
        if not self.antennas:
            return RadarPoints.none()
        raw = _echoes(self._around(states), self.antennas[0], tick, self._slope(states))
        return RadarPoints(raw[:, 0], raw[:, 1], raw[:, 2], raw[:, 3])

    def _slope(self, states: ActorStates) -> Floats:
        """Slope of the road under the ego; level without a map."""
        if self.lanes is None:
            return LEVEL
        return road_slope(self.lanes, states.x[0], states.y[0], states.z[0])

    def _around(self, states: ActorStates) -> Held[Surroundings]:
        """The surroundings, held as long as the states stay the same arrays."""
        if states is not self._states:
            t = self.table
            boxes = Boxes(states.x, states.y, states.z, states.yaw, t.length, t.width, t.height)
            self._states = states
            self._held = hold(Surroundings(states, boxes, self.labels, self.walls, self.posts))
        return self._held


@kernel
def _echoes(
    around: Held[Surroundings], radar: Antenna, tick: int, slope: Floats
) -> NDArray[np.float32]:
    a = around.value
    return cast_radar(radar, tick, a.boxes, a.states, a.walls, a.posts, slope)


@kernel
def _segments(
    around: Held[Surroundings], mount: Mount, focal: float, width: int, height: int, limit: float
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """(m, 5) u, width, top, bottom, depth and (m,) label of what a camera on box 0 sees."""
    states, boxes, labels = around.value.states, around.value.boxes, around.value.labels
    seat = placed(mount, states)
    # A camera that looks level sees an upright face at one depth; a pitched one at several.
    runs = 1 + int(12.0 * abs(seat.rotation[2, 0]))
    camera = Camera(seat.origin, seat.rotation, focal, width, height, min(runs, MAX_RUNS))
    present = states.present
    order = _near_to_far(camera, boxes, present, limit)
    covered = np.full(camera.width // BIN + 1, float(camera.height))
    out = np.empty((order.size * 4 * MAX_STRIPS * camera.runs, 5), np.float32)
    classes = np.empty(out.shape[0], np.uint8)
    n = 0
    for i in order:
        first = n
        n = _box_runs(camera, boxes, i, False, covered, out, n)
        for k in range(first, n):
            classes[k] = labels[i]
        # Only now does this box hide others: its own faces do not hide each other. Seen from above,
        # its roof hides up to the far edge, which is where the back faces end.
        last = n
        if camera.origin[2] > boxes.z[i] + boxes.height[i]:
            last = _box_runs(camera, boxes, i, True, covered, out, n)
        for k in range(first, last):
            left = max(int((out[k, 0] - out[k, 1] / 2.0) / BIN), 0)
            right = min(int((out[k, 0] + out[k, 1] / 2.0) / BIN), covered.size - 1)
            for column in range(left, right + 1):
                covered[column] = min(covered[column], out[k, 2])
    return out[:n].copy(), classes[:n].copy()


@inner_kernel
def _near_to_far(
    camera: Camera, boxes: Boxes, present: NDArray[np.bool_], limit: float
) -> NDArray[np.int64]:
    origin, n = camera.origin, boxes.x.size
    distance = np.full(n, np.inf)
    yaw = np.arctan2(camera.rotation[1, 0], camera.rotation[0, 0])
    slope = WIDEN * camera.width / (2.0 * camera.focal)
    for i in boxes_in_view(origin, yaw, slope, boxes, limit):
        if i == 0 or not present[i]:
            continue
        d = np.hypot(boxes.x[i] - origin[0], boxes.y[i] - origin[1])
        reach = d - 0.5 * boxes.length[i]
        if reach < limit and abs(boxes.z[i] - boxes.z[0]) < LEVEL_GAP + LEVEL_GRADE * d:
            distance[i] = d
    order = np.argsort(distance)
    return order[: np.sum(np.isfinite(distance))]


@inner_kernel
def _box_runs(
    camera: Camera,
    boxes: Boxes,
    i: int,
    back: bool,
    covered: Floats,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Append runs of box i to `out` from row n on: of its faces in sight, or of those at the back."""
    c, s = np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i])
    dx, dy = camera.origin[0] - boxes.x[i], camera.origin[1] - boxes.y[i]
    along, across = c * dx + s * dy, -s * dx + c * dy  # the camera seen from the box
    hl, hw = boxes.length[i] / 2.0, boxes.width[i] / 2.0
    rise = camera.origin[2] - boxes.z[i]
    inside = abs(along) < hl and abs(across) < hw and 0.0 < rise < boxes.height[i]
    if inside or (along > hl) != back:
        n = _face_runs(camera, boxes, i, hl, -hw, hl, hw, covered, out, n)
    if inside or (along < -hl) != back:
        n = _face_runs(camera, boxes, i, -hl, -hw, -hl, hw, covered, out, n)
    if inside or (across > hw) != back:
        n = _face_runs(camera, boxes, i, -hl, hw, hl, hw, covered, out, n)
    if inside or (across < -hw) != back:
        n = _face_runs(camera, boxes, i, -hl, -hw, hl, -hw, covered, out, n)
    return n


@inner_kernel
def _face_runs(
    camera: Camera,
    boxes: Boxes,
    i: int,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    covered: Floats,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Runs of the vertical face over the box-frame segment (x0, y0)-(x1, y1)."""
    c, s = np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i])
    span = np.hypot(x1 - x0, y1 - y0)
    strips = min(max(int(np.ceil(span / STRIP)), MIN_STRIPS), MAX_STRIPS)
    r = camera.rotation
    for k in range(strips):
        # Strip edges and centre at mid-height give the columns.
        u = np.empty(3)
        valid = True
        for e in range(3):
            f = (k + 0.5 * e) / strips
            bx, by = x0 + f * (x1 - x0), y0 + f * (y1 - y0)
            px = boxes.x[i] + c * bx - s * by - camera.origin[0]
            py = boxes.y[i] + s * bx + c * by - camera.origin[1]
            pz = boxes.z[i] + 0.5 * boxes.height[i] - camera.origin[2]
            forward = r[0, 0] * px + r[1, 0] * py + r[2, 0] * pz
            if forward < NEAR:
                valid = False
                break
            left = r[0, 1] * px + r[1, 1] * py + r[2, 1] * pz
            u[e] = camera.width / 2.0 - camera.focal * left / forward
            if e == 1:
                cx, cy = px, py
        if not valid:
            continue
        lo, hi = max(min(u[0], u[2]), 0.0), min(max(u[0], u[2]), float(camera.width))
        if hi <= lo:
            continue
        middle = 0.5 * (lo + hi)
        hidden = covered[int(middle / BIN)]
        n = _strip_runs(
            camera, cx, cy, boxes.z[i], boxes.height[i], middle, hi - lo, hidden, out, n
        )
    return n


@inner_kernel
def _strip_runs(
    camera: Camera,
    px: float,
    py: float,
    z: float,
    height: float,
    u: float,
    width: float,
    hidden: float,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Cut the vertical line over (px, py), relative to the camera, into runs of rows."""
    r = camera.rotation
    for j in range(camera.runs):
        rows = np.empty(2)
        depth = 0.0
        valid = True
        for e in range(2):
            pz = z + height * (j + e) / camera.runs - camera.origin[2]
            forward = r[0, 0] * px + r[1, 0] * py + r[2, 0] * pz
            if forward < NEAR:
                valid = False
                break
            up = r[0, 2] * px + r[1, 2] * py + r[2, 2] * pz
            rows[e] = camera.height / 2.0 - camera.focal * up / forward
            depth += 0.5 * forward
        if not valid:
            continue
        top = max(rows[1], 0.0)
        bottom = min(rows[0], hidden)
        if bottom > top:
            out[n, 0], out[n, 1], out[n, 2], out[n, 3], out[n, 4] = u, width, top, bottom, depth
            n += 1
    return n
