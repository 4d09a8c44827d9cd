"""A channel's own eyes at object level: what it perceives, how wrongly, and how late (C-026, C-1).

Every effect has its own stream, named channel/sensor/effect, and draws the same numbers whatever
the world does: so nothing outside the visible set can act on a view, not even through the noise.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelView
from skidpad.core.errors import require_range
from skidpad.core.maths.randomness import stream
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import LABEL_OF_KIND, ActorKind, LightState, SemanticClass
from skidpad.core.weather import Weather
from skidpad.physics.optics import daylight, label_range
from skidpad.roads.roadside import Roadside
from skidpad.sensors.channels.ghosts import Ghosts, GhostSettings
from skidpad.sensors.channels.localisation import Localisation, LocalisationError, gauss_markov
from skidpad.sensors.object_level.boxes import Boxes, posts_of
from skidpad.sensors.object_level.sight import empty_sight, look, sees_point

CYCLE = 0.1  # s (C-022)
DARK_LUX = 10.0  # civil twilight ends near 3 lux; street lights are switched on at 10 to 40
EYE_HEIGHT = 1.6  # m, roof-mounted cameras of small cars
ODOMETRY_RATIO = 0.005  # of the speed, wheel speed sensors (assumed)
GYRO_SIGMA = 0.0017  # rad/s, 0.1 deg/s of a MEMS gyroscope (assumed)
OCCLUDER_AREA = 4.0  # m^2 of ground; poles and signs hide nothing in 2-D
LIGHT_HALF_ANGLE = pi / 3.0  # rad, a head is read from in front of it
CONFUSIONS = {  # what a class is taken for
    SemanticClass.CAR: SemanticClass.TRUCK,
    SemanticClass.TRUCK: SemanticClass.BUS,
    SemanticClass.BUS: SemanticClass.TRUCK,
    SemanticClass.MOTORCYCLE: SemanticClass.BICYCLE,
    SemanticClass.BICYCLE: SemanticClass.PEDESTRIAN,
    SemanticClass.PEDESTRIAN: SemanticClass.BICYCLE,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSensing:
    """How one channel perceives. Sources of the shipped values: `presets.py`."""

    half_angle: float  # rad to both sides of straight ahead; pi: all round
    range_vehicle: float  # m
    range_person: float  # m, pedestrians and cyclists
    position_sigma: float  # m per axis, white
    bias_sigma: float  # m per axis, of one object, Gauss-Markov
    bias_time: float  # s
    range_growth: float  # of both per 100 m of distance
    heading_sigma: float  # rad
    size_ratio: float  # standard deviation of length and width over their size
    miss: float  # share of cycles in which a plainly visible object is missed
    miss_far: float  # the same at the end of the range
    miss_time: float  # s, correlation time of misses
    share_seen: float  # of an object's bearings that must be free
    confusion: float  # share of objects whose class is mistaken
    ghosts: GhostSettings
    latency_cycles: int
    lights: bool  # reads traffic lights
    light_range: float  # m
    localisation: LocalisationError

    def __post_init__(self) -> None:
        require_range("channel.half_angle", self.half_angle, 0.0, pi)
        require_range("channel.latency_cycles", self.latency_cycles, 0, 10)
        for name in ("miss", "miss_far", "share_seen", "confusion"):
            require_range(f"channel.{name}", getattr(self, name), 0.0, 1.0)

    def scale(self, factor: float) -> ChannelSensing:
        """Returns all noise, misses, ghosts and confusions times `factor`: the sweep of decision C-2.

        The localisation is scaled when it is built, since darkness comes in there.
        """
        return replace(
            self,
            position_sigma=factor * self.position_sigma,
            bias_sigma=factor * self.bias_sigma,
            heading_sigma=factor * self.heading_sigma,
            size_ratio=factor * self.size_ratio,
            miss=min(factor * self.miss, 1.0),
            miss_far=min(factor * self.miss_far, 1.0),
            confusion=min(factor * self.confusion, 1.0),
            ghosts=self.ghosts.scale(factor),
        )


@dataclass(frozen=True, slots=True)
class _Seen:
    """A measurement on its way through the latency."""

    t: float
    objects: Floats
    classes: NDArray[np.int64]


class ChannelSuite:
    """The sensors of one channel during one run; call `observe` once per cycle."""

    def __init__(
        self,
        name: str,
        sensing: ChannelSensing,
        roadside: Roadside,
        table: ActorTable,
        weather: Weather,
        seed: int,
        *,
        noise: float = 1.0,
    ) -> None:
        """noise: factor of the sweep."""
        self.name, self.sensing, self.table = name, sensing.scale(noise), table
        self._labels = np.array([LABEL_OF_KIND[ActorKind(k)] for k in table.kind], dtype=np.int64)
        self._reach = _reach(self.sensing, table, weather)
        self._light_range = sensing.light_range if sensing.lights else 0.0
        self._heads = roadside.heads
        self._fixed = _occluders(roadside)
        self._heights = np.concatenate([table.height, self._fixed.height])
        is_dark = daylight(weather) < DARK_LUX
        self.localisation = Localisation(
            sensing.localisation.scale(noise, is_dark), name, seed, CYCLE
        )
        self.ghosts = Ghosts(self.sensing.ghosts, name, seed, CYCLE)
        n = len(table)
        self._streams = {
            effect: stream(seed, f"{name}/objects/{effect}")
            for effect in ("position", "bias", "heading", "size", "miss", "class")
        }
        self._odometry = stream(seed, f"{name}/odometry/noise")
        self._bias: Floats = self._streams["bias"].standard_normal((n, 2))
        self._miss: Floats = self._streams["miss"].standard_normal(n)
        self._size = 1.0 + self.sensing.size_ratio * self._streams["size"].standard_normal((n, 2))
        self._confused = self._streams["class"].random(n) < self.sensing.confusion
        self._sight = empty_sight(n)
        self._queue: deque[_Seen] = deque(maxlen=self.sensing.latency_cycles + 1)

    def observe(
        self, t: float, states: ActorStates, lights: Mapping[int, LightState]
    ) -> ChannelView:
        """Returns this channel's view of the true world at time t s; row 0 is the ego.

        To be called once per cycle: noise and latency have a state. Objects are those of `latency_cycles`
        before.
        """
        s = states
        pose = (float(s.x[0]), float(s.y[0]), float(s.yaw[0]))
        self._look(s)
        objects, classes = self._detect(s, pose)
        self._queue.append(_Seen(t, objects, classes))
        dx, dy, turn = self.localisation.update()
        noise = self._odometry.standard_normal(2).tolist()
        speed = float(s.vx[0]) * cos(pose[2]) + float(s.vy[0]) * sin(pose[2])
        ego = np.array(
            [
                pose[0] + dx,
                pose[1] + dy,
                (pose[2] + turn + pi) % (2.0 * pi) - pi,
                speed * (1.0 + ODOMETRY_RATIO * noise[0]),
                float(s.yaw_rate[0]) + GYRO_SIGMA * noise[1],
            ]
        )
        seen = self._queue[0]
        return ChannelView(t, ego, seen.t, seen.objects, seen.classes, self._lights(pose, lights))

    @property
    def visible(self) -> NDArray[np.bool_]:
        """Returns (n,) the visible set of the last call: actors of which any bearing was free."""
        mask: NDArray[np.bool_] = self._sight.share > 0.0
        return mask

    def _look(self, s: ActorStates) -> None:
        """Computes from the ego's eye which actors are in sight, around occluders and within range."""
        t = self.table
        self._eye = np.array([s.x[0], s.y[0], s.z[0], s.yaw[0]])
        look(
            self._eye,
            self.sensing.half_angle,
            Boxes(s.x, s.y, s.z, s.yaw, t.length, t.width, t.height),
            s.present,
            self._reach,
            self._fixed,
            self.sensing.range_vehicle,
            self._sight,
        )

    def _detect(
        self, s: ActorStates, pose: tuple[float, float, float]
    ) -> tuple[Floats, NDArray[np.int64]]:
        """Returns objects in the ego's frame with their errors, and ghosts; draws are made for all actors."""
        cfg, n, rng = self.sensing, len(self.table), self._streams
        self._bias = gauss_markov(
            self._bias, rng["bias"].standard_normal((n, 2)), CYCLE / cfg.bias_time
        )
        self._miss = gauss_markov(self._miss, rng["miss"].standard_normal(n), CYCLE / cfg.miss_time)
        white = rng["position"].standard_normal((n, 2))
        turn = cfg.heading_sigma * rng["heading"].standard_normal(n)
        rows = np.flatnonzero(self._sight.share >= max(cfg.share_seen, 1e-9))
        rows = rows[~self._draw_misses(rows, np.hypot(s.x[rows] - pose[0], s.y[rows] - pose[1]))]
        dx, dy = s.x[rows] - pose[0], s.y[rows] - pose[1]
        c, sn = cos(pose[2]), sin(pose[2])
        distance = np.hypot(dx, dy)
        grow = (1.0 + cfg.range_growth * distance / 100.0)[:, None]
        error = grow * (cfg.position_sigma * white[rows] + cfg.bias_sigma * self._bias[rows])
        objects = np.column_stack(
            [
                c * dx + sn * dy + error[:, 0],
                -sn * dx + c * dy + error[:, 1],
                (s.yaw[rows] - pose[2] + turn[rows] + pi) % (2.0 * pi) - pi,
                self.table.length[rows] * np.maximum(self._size[rows, 0], 0.5),
                self.table.width[rows] * np.maximum(self._size[rows, 1], 0.5),
            ]
        )
        classes = self._labels[rows]
        for k in np.flatnonzero(self._confused[rows]):
            true = SemanticClass(int(classes[k]))
            classes[k] = CONFUSIONS.get(true, true)
        ghosts, ghost_classes = self.ghosts.update(pose)
        return np.concatenate([objects, ghosts]), np.concatenate([classes, ghost_classes])

    def _draw_misses(self, rows: NDArray[np.intp], distance: Floats) -> NDArray[np.bool_]:
        """Returns (k,) which visible actors are missed: a slow latent draw below what distance allows."""
        cfg = self.sensing
        far = np.minimum(distance / np.maximum(self._reach[rows], 1e-9), 1.0) ** 2
        chance = cfg.miss + (cfg.miss_far - cfg.miss) * far
        missed: NDArray[np.bool_] = _normal_cdf(self._miss[rows]) < chance
        return missed

    def _lights(
        self, pose: tuple[float, float, float], lights: Mapping[int, LightState]
    ) -> dict[int, LightState]:
        """Returns the states of the heads in sight, by signal id; none unless this channel reads lights."""
        seen: dict[int, LightState] = {}
        for head in self._heads if self._light_range > 0.0 else ():
            dx, dy = head.x - pose[0], head.y - pose[1]
            d = hypot(dx, dy)
            if d > self._light_range or head.signal not in lights:
                continue
            ahead = cos(pose[2]) * dx + sin(pose[2]) * dy
            faces = cos(pose[2] - head.heading)
            if ahead < d * cos(LIGHT_HALF_ANGLE) or faces < cos(LIGHT_HALF_ANGLE):
                continue
            point = np.array([head.x, head.y, head.z])
            if sees_point(self._eye, EYE_HEIGHT, point, self._heights, self._sight):
                seen[head.signal] = lights[head.signal]
        return seen


def _reach(cfg: ChannelSensing, table: ActorTable, weather: Weather) -> Floats:
    """Returns (n,) m at which each actor can be seen in this weather (`physics.optics`)."""
    person = np.isin(table.kind, (int(ActorKind.PEDESTRIAN), int(ActorKind.BICYCLE)))
    nominal = np.where(person, cfg.range_person, cfg.range_vehicle)
    return np.minimum(nominal, label_range(weather))


def _occluders(roadside: Roadside) -> Boxes:
    """Returns the roadside boxes that are large and tall enough to hide a vehicle."""
    posts = posts_of(roadside)
    keep = (posts.length * posts.width > OCCLUDER_AREA) & (posts.height > EYE_HEIGHT)
    return Boxes(*(a[keep] for a in posts))


def _normal_cdf(x: Floats) -> Floats:
    """Returns a logistic approximation of the normal distribution function (Bowling et al. 2009, 1.4e-4)."""
    out: Floats = 1.0 / (1.0 + np.exp(-(0.07056 * x**3 + 1.5976 * x)))
    return out
