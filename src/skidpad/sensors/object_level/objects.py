"""The object level: what cameras and radar would report, computed from boxes (decision M-3).

For campaigns of thousands of runs. Each vehicle is its box; visible vertical faces are cut into
strips and the strips into runs of pixels, nearer vehicles hide farther ones column by column. The
radar casts the very rays of the pixel level against boxes, barriers and the road's plane.

Not modelled here: roofs of vehicles, glass and wheels, crests of hills. A vehicle on another
level of an overpass counts as hidden by deck and parapet.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints, Segments
from skidpad.core.inputs import Beam
from skidpad.core.kernels.jit import Held, hold, kernel
from skidpad.core.specs import CameraSpec, Modality, RadarSpec, SensorSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind
from skidpad.core.weather import Weather
from skidpad.physics.optics import label_range
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.roadside import Roadside
from skidpad.sensors.object_level.boxes import (
    Boxes,
    Walls,
    empty_mount,
    mount_of,
    posts_of,
    walls_of,
)
from skidpad.sensors.object_level.object_camera import (
    BIN,
    MAX_RUNS,
    MAX_STRIPS,
    CameraScratch,
    Eye,
    see_boxes,
)
from skidpad.sensors.object_level.object_radar import (
    Antenna,
    RadarScratch,
    antenna_of,
    cast_radar,
    find_slope,
    make_scratch,
)

SIGHT = 150.0  # m, boxes farther away are ignored: 80 m is the last range that any tier reads


EMPTY = np.empty(0, np.float32)
NOTHING = Segments(EMPTY, EMPTY, EMPTY, EMPTY, EMPTY, np.empty(0, np.uint8))


class Surroundings(NamedTuple):
    """Everything that sensors can meet: actors and what stands beside the road; and room to work."""

    states: ActorStates
    boxes: Boxes  # of the actors
    labels: NDArray[np.uint8]  # (n,) SemanticClass of the actors
    walls: Walls
    posts: Boxes
    camera: CameraScratch
    radar: RadarScratch


class Common(NamedTuple):
    """Surroundings, and the sensors that nearly every vehicle has."""

    around: Surroundings
    one: Eye
    other: Eye
    radar: Antenna
    limit: float  # m, of the cameras


class ObjectSuite:
    """Segments of every depth camera and points of every radar, tick by tick.

    weather: limits the ranges of cameras and radar; None: it does not.
    lanes: for the slope of the road that the radar meets; None: level ground.
    """

    # what kernels hold of attributes that may be others after a change or from a checkpoint
    UNSAVED = ("_common", "_parts", "_antenna", "_listening")
    _parts: Common | None = None
    _listening: Antenna | None = None

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
        self.camera_ids = tuple(spec.id for spec, _ in self.cameras)
        self._specs, self._seed, self._dt = specs, seed, dt
        self.see_through(weather, None)
        self.labels = np.array([LABEL_OF_KIND[ActorKind(k)] for k in table.kind], dtype=np.uint8)
        self.lanes = lanes
        self.walls = walls_of(roadside)
        self.posts = posts_of(roadside)
        n = len(table.kind)
        rows = (4 * n + 4) * MAX_STRIPS * MAX_RUNS  # all faces of one, two of others
        self._eyes = [
            Eye(mount, s.focal, s.width, s.height, np.empty((5, rows), np.float32),
                np.empty(rows, np.uint8))
            for s, mount in self.cameras
        ]  # fmt: skip
        self._held_eyes = [hold(eye) for eye in self._eyes]
        columns = max((s.width // BIN + 1 for s, _ in self.cameras), default=0)
        self._camera = CameraScratch(
            empty_mount(), np.empty(n, np.int64), np.empty(n), np.empty(columns)
        )
        rays = max((a.beam.rays for a in self.antennas), default=0)
        self._radar = make_scratch(rays, self.walls, len(self.posts.x), n)
        self._states: ActorStates | None = None

    def see_through(self, weather: Weather | None, beam: Beam | None) -> None:
        """Sets the weather that limits the ranges from now on; None: it does not.

        beam: of the ego's headlights; None: low beam (A-218).
        """
        self.antennas = [
            antenna_of(s, self._seed, self._dt, weather)
            for s in self._specs
            if isinstance(s, RadarSpec)
        ]
        lit = Beam.LOW if beam is None else beam
        self.limit = SIGHT if weather is None else min(label_range(weather, lit), SIGHT)

    def segments(self, states: ActorStates) -> dict[str, Segments]:
        """Returns what each depth camera sees of vehicles, by camera id; `NOTHING` where it sees none."""
        around = self._around(states)
        runs = (look(around, held, self.limit) for held in self._held_eyes)
        return dict(zip(self.camera_ids, map(copy_runs, self._eyes, runs), strict=True))

    def read(self, tick: int, states: ActorStates) -> tuple[dict[str, Segments], RadarPoints]:
        """Returns what `segments` and `radar` do, in one call of a kernel for the common sensors."""
        common = self.hold_common(states)
        if common is None or self.lanes is None:
            return self.segments(states), self.radar(tick, states)
        *runs, m = sense(common, self.lanes, tick)
        seen = dict(zip(self.camera_ids, map(copy_runs, self._eyes, runs), strict=True))
        return seen, RadarPoints(*self._radar.echoes[:, :m].copy())

    @property
    def most_runs(self) -> int:
        """How many runs of pixels a camera can see."""
        return max((eye.runs.shape[1] for eye in self._eyes), default=0)

    @property
    def most_points(self) -> int:
        """How many points the radar can see."""
        return int(self._radar.echoes.shape[1])

    def sample_arrays(self) -> tuple[tuple[NDArray[Any], ...], tuple[NDArray[np.float32], ...]]:
        """Returns empty arrays of the types in which a camera and the radar tell what they see."""
        eye, echoes = self._eyes[0], self._radar.echoes
        return (*(row[:0] for row in eye.runs), eye.classes[:0]), tuple(row[:0] for row in echoes)

    def hold_common(self, states: ActorStates) -> Held[Common] | None:
        """Returns surroundings and the common sensors, held; None where there are others."""
        if len(self._eyes) != 2 or len(self.antennas) != 1 or self.lanes is None:
            return None
        self._around(states)
        around, radar, known = self._surroundings, self.antennas[0], self._parts
        if (
            known is None
            or known.around is not around
            or known.radar is not radar
            or known.limit != self.limit
        ):
            one, other = self._eyes
            self._parts = Common(around, one, other, radar, self.limit)
            self._common = hold(self._parts)
        return self._common

    def radar(self, tick: int, states: ActorStates) -> RadarPoints:
        """Returns the points of the first radar; none when the suite has no radar."""
        if not self.antennas:
            return RadarPoints.none()
        around = self._around(states)
        self._find_slope(states)
        if self.antennas[0] is not self._listening:
            self._listening, self._antenna = self.antennas[0], hold(self.antennas[0])
        m = listen(around, self._antenna, tick)
        return RadarPoints(*self._radar.echoes[:, :m].copy())

    def _find_slope(self, states: ActorStates) -> None:
        """Writes the slope of the road under the ego where the radar reads it; level without a map."""
        if self.lanes is not None:
            feel_slope(self.lanes, self._around(states))

    def _around(self, states: ActorStates) -> Held[Surroundings]:
        """Returns the surroundings, held; they are made anew when `states` is another object."""
        if states is not self._states:
            t = self.table
            boxes = Boxes(states.x, states.y, states.z, states.yaw, t.length, t.width, t.height)
            self._states = states
            self._surroundings = Surroundings(
                states, boxes, self.labels, self.walls, self.posts, self._camera, self._radar
            )
            self._held = hold(self._surroundings)
        return self._held


def copy_runs(eye: Eye, m: int) -> Segments:
    """Returns the m runs that a camera has seen."""
    if m == 0:
        return NOTHING
    u, width, top, bottom, depth = eye.runs[:, :m].copy()
    return Segments(u, width, top, bottom, depth, eye.classes[:m].copy())


@kernel
def sense(common: Held[Common], map: Held[LaneArrays], tick: int) -> tuple[int, int, int]:
    """Returns what `look` does for two cameras, and `listen` on the road's slope."""
    c = common.value
    a, s = c.around, c.around.states
    find_slope(map.value, s.x[0], s.y[0], s.z[0], a.radar.slope)
    return (
        see_boxes(c.one, a.states, a.boxes, a.labels, c.limit, a.camera),
        see_boxes(c.other, a.states, a.boxes, a.labels, c.limit, a.camera),
        cast_radar(c.radar, tick, a.boxes, a.states, a.walls, a.posts, a.radar),
    )


@kernel
def listen(around: Held[Surroundings], radar: Held[Antenna], tick: int) -> int:
    """Writes the echoes of a radar in this tick into the surroundings' array; returns how many."""
    a = around.value
    return cast_radar(radar.value, tick, a.boxes, a.states, a.walls, a.posts, a.radar)


@kernel
def feel_slope(map: Held[LaneArrays], around: Held[Surroundings]) -> None:
    """Writes the slope of the road under the ego, dz/dx and dz/dy, where the radar reads it."""
    s = around.value.states
    find_slope(map.value, s.x[0], s.y[0], s.z[0], around.value.radar.slope)


@kernel
def look(around: Held[Surroundings], eye: Held[Eye], limit: float) -> int:
    """Writes what a camera sees up to `limit` m into the arrays of `eye`; returns how many runs."""
    a = around.value
    return see_boxes(eye.value, a.states, a.boxes, a.labels, limit, a.camera)
