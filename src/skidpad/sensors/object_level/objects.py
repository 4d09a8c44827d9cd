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
from skidpad.sensors.object_level.boxes import (
    Boxes,
    Mount,
    Walls,
    boxes_in_view,
    mount_of,
    placed,
    posts_of,
    walls_of,
)
from skidpad.sensors.object_level.object_radar import Antenna, antenna_of, cast_radar, road_slope

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


class Axis(NamedTuple):
    """A unit vector in the world."""

    x: float
    y: float
    z: float


class Camera(NamedTuple):
    """A camera placed in the world. Numbers alone: to hand arrays on costs as much as to use them."""

    x: float
    y: float
    z: float
    forward: Axis
    left: Axis
    up: Axis
    focal: float
    width: int
    height: int
    runs: int  # vertical runs per strip


class Block(NamedTuple):
    """One box: its foot, the cosine and sine of its yaw, and half its length and width."""

    x: float
    y: float
    z: float
    cos: float
    sin: float
    half_length: float
    half_width: float
    height: float


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
        rows = (4 * len(table.kind) + 4) * MAX_STRIPS * MAX_RUNS  # all faces of one, two of others
        self._runs = np.empty((rows, 5), np.float32), np.empty(rows, np.uint8)
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
            rows, labels = _segments(
                around, mount, spec.focal, spec.width, spec.height, self.limit, *self._runs
            )
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
    around: Held[Surroundings],
    mount: Mount,
    focal: float,
    width: int,
    height: int,
    limit: float,
    out: NDArray[np.float32],
    classes: NDArray[np.uint8],
) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """(m, 5) u, width, top, bottom, depth and (m,) label of what a camera on box 0 sees.

    out, classes: arrays of the same columns, large enough for any tick, in which to work.
    """
    states, boxes, labels = around.value.states, around.value.boxes, around.value.labels
    camera = _camera(placed(mount, states), focal, width, height)
    order = _near_to_far(camera, boxes, states.present, limit)
    covered = np.full(width // BIN + 1, float(height))
    n = 0
    for i in order:
        block = Block(
            boxes.x[i], boxes.y[i], boxes.z[i], np.cos(boxes.yaw[i]), np.sin(boxes.yaw[i]),
            boxes.length[i] / 2.0, boxes.width[i] / 2.0, boxes.height[i],
        )  # fmt: skip
        first = n
        n = _box_runs(camera, block, False, covered, out, n)
        for k in range(first, n):
            classes[k] = labels[i]
        # Only now does this box hide others: its own faces do not hide each other. Seen from above,
        # its roof hides up to the far edge, which is where the back faces end.
        last = n
        if camera.z > block.z + block.height:
            last = _box_runs(camera, block, True, covered, out, n)
        for k in range(first, last):
            left = max(int((out[k, 0] - out[k, 1] / 2.0) / BIN), 0)
            right = min(int((out[k, 0] + out[k, 1] / 2.0) / BIN), covered.size - 1)
            for column in range(left, right + 1):
                covered[column] = min(covered[column], out[k, 2])
    return out[:n].copy(), classes[:n].copy()


@inner_kernel
def _camera(seat: Mount, focal: float, width: int, height: int) -> Camera:
    o, r = seat.origin, seat.rotation
    forward, left = Axis(r[0, 0], r[1, 0], r[2, 0]), Axis(r[0, 1], r[1, 1], r[2, 1])
    up = Axis(r[0, 2], r[1, 2], r[2, 2])
    # A camera that looks level sees an upright face at one depth; a pitched one at several.
    runs = min(1 + int(12.0 * abs(forward.z)), MAX_RUNS)
    return Camera(o[0], o[1], o[2], forward, left, up, focal, width, height, runs)


@inner_kernel
def _near_to_far(
    camera: Camera, boxes: Boxes, present: NDArray[np.bool_], limit: float
) -> NDArray[np.int64]:
    origin, n = np.array((camera.x, camera.y, camera.z)), boxes.x.size
    distance = np.full(n, np.inf)
    yaw = np.arctan2(camera.forward.y, camera.forward.x)
    slope = WIDEN * camera.width / (2.0 * camera.focal)
    for i in boxes_in_view(origin, yaw, slope, boxes, limit):
        if i == 0 or not present[i]:
            continue
        d = np.hypot(boxes.x[i] - camera.x, boxes.y[i] - camera.y)
        reach = d - 0.5 * boxes.length[i]
        if reach < limit and abs(boxes.z[i] - boxes.z[0]) < LEVEL_GAP + LEVEL_GRADE * d:
            distance[i] = d
    order = np.argsort(distance)
    return order[: np.sum(np.isfinite(distance))]


@inner_kernel
def _box_runs(
    camera: Camera, box: Block, back: bool, covered: Floats, out: NDArray[np.float32], n: int
) -> int:
    """Append runs of a box to `out` from row n on: of its faces in sight, or of those at the back."""
    dx, dy = camera.x - box.x, camera.y - box.y
    along, across = (
        box.cos * dx + box.sin * dy,
        -box.sin * dx + box.cos * dy,
    )  # the camera from the box
    hl, hw = box.half_length, box.half_width
    inside = abs(along) < hl and abs(across) < hw and 0.0 < camera.z - box.z < box.height
    if inside or (along > hl) != back:
        n = _face_runs(camera, box, hl, -hw, hl, hw, covered, out, n)
    if inside or (along < -hl) != back:
        n = _face_runs(camera, box, -hl, -hw, -hl, hw, covered, out, n)
    if inside or (across > hw) != back:
        n = _face_runs(camera, box, -hl, hw, hl, hw, covered, out, n)
    if inside or (across < -hw) != back:
        n = _face_runs(camera, box, -hl, -hw, hl, -hw, covered, out, n)
    return n


@inner_kernel
def _face_runs(
    camera: Camera,
    box: Block,
    x0: float,
    y0: float,
    x1: float,
    y1: float,
    covered: Floats,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Runs of the vertical face over the box-frame segment (x0, y0)-(x1, y1)."""
    span = np.hypot(x1 - x0, y1 - y0)
    strips = min(max(int(np.ceil(span / STRIP)), MIN_STRIPS), MAX_STRIPS)
    # Strip edges and centre at mid-height give the columns; a strip begins where the last one ended.
    _, _, end = _column(camera, box, x0, y0)
    for k in range(strips):
        begin = end
        f = (k + 0.5) / strips
        cx, cy, centre = _column(camera, box, x0 + f * (x1 - x0), y0 + f * (y1 - y0))
        f = (k + 1.0) / strips
        _, _, end = _column(camera, box, x0 + f * (x1 - x0), y0 + f * (y1 - y0))
        if np.isnan(begin) or np.isnan(centre) or np.isnan(end):
            continue
        lo, hi = max(min(begin, end), 0.0), min(max(begin, end), float(camera.width))
        if hi <= lo:
            continue
        middle = 0.5 * (lo + hi)
        n = _strip_runs(camera, box, cx, cy, middle, hi - lo, covered[int(middle / BIN)], out, n)
    return n


@inner_kernel
def _column(camera: Camera, box: Block, bx: float, by: float) -> tuple[float, float, float]:
    """Place seen from the camera, m, and column, px, of a point of a box; NaN: nearer than `NEAR`."""
    px = box.x + box.cos * bx - box.sin * by - camera.x
    py = box.y + box.sin * bx + box.cos * by - camera.y
    pz = box.z + 0.5 * box.height - camera.z
    ahead, left = camera.forward, camera.left
    forward = ahead.x * px + ahead.y * py + ahead.z * pz
    if forward < NEAR:
        return px, py, np.nan
    aside = left.x * px + left.y * py + left.z * pz
    return px, py, camera.width / 2.0 - camera.focal * aside / forward


@inner_kernel
def _strip_runs(
    camera: Camera,
    box: Block,
    px: float,
    py: float,
    u: float,
    width: float,
    hidden: float,
    out: NDArray[np.float32],
    n: int,
) -> int:
    """Cut the vertical line over (px, py), relative to the camera, into runs of rows."""
    upper, f_upper = _row(camera, px, py, box.z + box.height * 0 / camera.runs - camera.z)
    for j in range(camera.runs):
        lower, f_lower = upper, f_upper
        upper, f_upper = _row(camera, px, py, box.z + box.height * (j + 1) / camera.runs - camera.z)
        if np.isnan(lower) or np.isnan(upper):
            continue
        top, bottom = max(upper, 0.0), min(lower, hidden)
        if bottom > top:
            out[n, 0], out[n, 1], out[n, 2], out[n, 3] = u, width, top, bottom
            out[n, 4] = 0.5 * f_lower + 0.5 * f_upper
            n += 1
    return n


@inner_kernel
def _row(camera: Camera, px: float, py: float, pz: float) -> tuple[float, float]:
    """Row, px, and depth, m, of a point seen from the camera; the row is NaN nearer than `NEAR`."""
    ahead, up = camera.forward, camera.up
    forward = ahead.x * px + ahead.y * py + ahead.z * pz
    if forward < NEAR:
        return np.nan, forward
    above = up.x * px + up.y * py + up.z * pz
    return camera.height / 2.0 - camera.focal * above / forward, forward
