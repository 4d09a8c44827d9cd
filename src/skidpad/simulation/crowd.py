"""Pedestrians and cyclists: on foot along sidewalks and over zebras, by bicycle along lanes.

They move by `ActorCommand`s, so they exist on every backend. A pedestrian crosses at a zebra while
the cars' light is red, or in a gap; a cyclist rides at the right of its lane and stops for what is
ahead, for red lights and at minor lines. Nobody is sent against the ego.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.maths.randomness import stream
from skidpad.core.setup import ActorCommand, ActorSetup
from skidpad.core.states import WorldTruth
from skidpad.core.vocabulary import Control, LightState
from skidpad.roads.lanes import LaneKind, SignalKind
from skidpad.roads.queries import RoadMap

PERIOD = 0.1  # s between two updates
WALK_MEAN, WALK_SIGMA = 1.34, 0.26  # m/s (Weidmann 1993)
RIDE_MEAN, RIDE_SIGMA = 4.5, 0.7  # m/s in town traffic (Parkin and Rotheram 2010: 4.5 to 6)
STROLL = 15.0  # m from a zebra to which a pedestrian goes before it comes back
CROSS_WITHIN = 18.0  # s of red after which nobody begins to cross: red lasts 32 s
GAP_TIME = 7.0  # s of free road for crossing 7 m at 1.2 m/s and a second to spare
RIDE_RIGHT = 0.8  # m right of the lane's centre
RIDE_STOP = 6.0  # m kept to what stands ahead
RIDE_BRAKE, RIDE_ACCELERATE = 2.0, 0.8  # m/s^2
LANES_AHEAD = 3  # that a cyclist knows, its own first
SIDE = 0.7  # m to both sides of the way in which something is ahead: half a bicycle and a gap
YIELD_TIME = 8.0  # s after which a cyclist at a minor line goes in any gap


@dataclass(slots=True)
class _Walker:
    name: str
    way: Floats  # (k, 2) there and back again
    wait_at: tuple[int, ...]  # points of `way` from which the next stretch is a crossing
    signal: int | None  # of the cars that the crossing stops
    speed: float
    next: int
    x: float
    y: float
    forth: bool = True


@dataclass(slots=True)
class _Rider:
    name: str
    lanes: list[int]
    s: float
    speed: float
    v: float = 0.0
    waited: float = 0.0


class Crowd:
    """All pedestrians and cyclists of a run."""

    def __init__(self, map: RoadMap, pedestrians: int, cyclists: int, seed: int) -> None:
        self.map = map
        self._rng = stream(seed, "crowd", "choices")
        self._red_since: dict[int, float] = {}
        self.walkers = _walkers(map, pedestrians, stream(seed, "crowd", "pedestrians"))
        self.riders = _riders(map, cyclists, stream(seed, "crowd", "cyclists"))

    def actors(self) -> tuple[ActorSetup, ...]:
        """Returns the actors as they begin: pedestrians, then cyclists."""
        walkers = [
            ActorSetup(
                name=w.name, type="pedestrian", place=Pose(w.x, w.y), driver=Control.SCRIPTED
            )
            for w in self.walkers
        ]
        riders = [
            ActorSetup(name=r.name, type="bicycle", place=self._pose(r), driver=Control.SCRIPTED)
            for r in self.riders
        ]
        return (*walkers, *riders)

    def commands(self, t: float, truth: WorldTruth) -> list[ActorCommand]:
        """Moves all on by PERIOD and returns their commands; call it every PERIOD s.

        t: s of the run.
        """
        for signal, state in truth.lights.items():
            if state is not LightState.RED:
                self._red_since.pop(signal, None)
            else:
                self._red_since.setdefault(signal, t)
        words = [self._walk(w, t, truth) for w in self.walkers]
        return words + [self._ride(r, truth) for r in self.riders]

    def _walk(self, w: _Walker, t: float, truth: WorldTruth) -> ActorCommand:
        """Moves a walker for one period along its way, or lets it wait, and returns its command."""
        target = w.way[w.next]
        dx, dy = float(target[0]) - w.x, float(target[1]) - w.y
        left = hypot(dx, dy)
        if left < w.speed * PERIOD:
            here = w.next
            ahead = here + (1 if w.forth else -1)
            if not 0 <= ahead < len(w.way):
                w.forth = not w.forth
                ahead = here + (1 if w.forth else -1)
            crossing = min(here, ahead) in w.wait_at
            if crossing and not self._may_cross(w, here, ahead, t, truth):
                return ActorCommand(w.name, place=Pose(w.x, w.y, yaw=atan2(dy, dx)), speed=0.0)
            w.next = ahead
            target = w.way[ahead]
            dx, dy = float(target[0]) - w.x, float(target[1]) - w.y
            left = max(hypot(dx, dy), 1e-6)
        step = w.speed * PERIOD / left
        w.x, w.y = w.x + step * dx, w.y + step * dy
        return ActorCommand(w.name, place=Pose(w.x, w.y, yaw=atan2(dy, dx)), speed=w.speed)

    def _may_cross(self, w: _Walker, here: int, ahead: int, t: float, truth: WorldTruth) -> bool:
        """Returns whether the cars' light is freshly red, where there is one, and no vehicle comes near.

        here, ahead: points of the walker's way before and behind the crossing.
        """
        if w.signal is not None:
            since = self._red_since.get(w.signal)
            if since is None or t - since > CROSS_WITHIN:
                return False
        middle = 0.5 * (w.way[here] + w.way[ahead])
        s = truth.states
        dx, dy = float(middle[0]) - s.x, float(middle[1]) - s.y
        d = np.hypot(dx, dy)
        closing = (dx * s.vx + dy * s.vy) / np.maximum(d, 1e-6)
        danger = s.present & (closing > 1.0) & (d < 60.0) & (d - 3.0 < closing * GAP_TIME)
        danger[-(len(self.walkers) + len(self.riders)) :] = False
        return not bool(danger.any())

    def _ride(self, r: _Rider, truth: WorldTruth) -> ActorCommand:
        """Moves a cyclist for one period, braking for obstacles and stop lines, and returns its command."""
        gap = min(self._gap_ahead(r, truth), self._line_ahead(r, truth), self._end_ahead(r))
        allowed = np.sqrt(max(2.0 * RIDE_BRAKE * (gap - RIDE_STOP), 0.0)) if gap < 60.0 else r.speed
        target = min(r.speed, float(allowed))
        change = np.clip(target - r.v, -2.0 * RIDE_BRAKE * PERIOD, RIDE_ACCELERATE * PERIOD)
        r.v = max(r.v + float(change), 0.0)
        r.s += r.v * PERIOD
        while r.s > self.map.lanes.length[r.lanes[0]] and len(r.lanes) > 1:
            r.s -= float(self.map.lanes.length[r.lanes[0]])
            r.lanes.pop(0)
            r.waited = 0.0
        _go_on(self.map, r.lanes, self._rng)
        return ActorCommand(r.name, place=self._pose(r), speed=r.v)

    def _pose(self, r: _Rider) -> Pose:
        """Returns the pose of a cyclist, RIDE_RIGHT in m to the right of its lane's centre."""
        pose = self.map.at(r.lanes[0], r.s).pose
        return pose.moved(left=-RIDE_RIGHT)

    def _gap_ahead(self, r: _Rider, truth: WorldTruth) -> float:
        """Returns the m to the nearest actor in the way within 20 m, less what is kept; 1000 for none.

        Counted so that the cyclist stands at RIDE_STOP.
        """
        pose, s = self._pose(r), truth.states
        dx, dy = s.x - pose.x, s.y - pose.y
        c, sn = cos(pose.yaw), sin(pose.yaw)
        along, across = c * dx + sn * dy, -sn * dx + c * dy
        half = 0.5 * truth.table.length
        near = s.present & (along > 0.5) & (along < 20.0)
        near &= np.abs(across) < SIDE + 0.5 * truth.table.width
        gaps = (along - half)[near]
        return float(gaps.min()) - 0.9 + RIDE_STOP - 2.0 if len(gaps) else 1e3

    def _end_ahead(self, r: _Rider) -> float:
        """Returns the m to the dead end of the lanes ahead, in which the cyclist stays; 1000 for none."""
        if len(r.lanes) == LANES_AHEAD:
            return 1e3
        return float(self.map.lanes.length[r.lanes].sum()) - r.s

    def _line_ahead(self, r: _Rider, truth: WorldTruth) -> float:
        """Returns the m to a line on its lane at which this rider has to stop, plus a margin; 1000 for none.

        Counts its waiting at a stop or yield line.
        """
        signals, lane = self.map.signals, r.lanes[0]
        for row in np.flatnonzero(signals.lane == lane):
            gap = float(signals.s[row]) - r.s
            kind = SignalKind(int(signals.kind[row]))
            if not -1.0 < gap < 30.0:
                continue
            if kind is SignalKind.LIGHT:
                if truth.lights.get(int(signals.id[row])) is not LightState.GREEN:
                    return gap + RIDE_STOP - 1.0
            elif kind in (SignalKind.STOP, SignalKind.YIELD):
                if gap < 3.0:
                    r.waited += PERIOD
                if not self._free(r, truth):
                    return gap + RIDE_STOP - 1.0
        return 1e3

    def _free(self, r: _Rider, truth: WorldTruth) -> bool:
        """Returns whether nothing moves near the junction ahead; after YIELD_TIME, nothing in it."""
        end = self.map.at(r.lanes[0], float(self.map.lanes.length[r.lanes[0]])).pose
        x, y = end.x + 15.0 * cos(end.yaw), end.y + 15.0 * sin(end.yaw)
        s = truth.states
        d = np.hypot(s.x - x, s.y - y)
        moving = s.present & (np.hypot(s.vx, s.vy) > 1.0)
        return not bool((moving & (d < (12.0 if r.waited > YIELD_TIME else 30.0))).any())


def _walkers(map: RoadMap, count: int, rng: np.random.Generator) -> list[_Walker]:
    """Returns pedestrians, half of which cross at zebras while others stroll along sidewalks.

    Fewer than `count`, or none, on maps without either.
    """
    zebras, walks = map.roadside.crosswalks, np.flatnonzero(map.lanes.kind == LaneKind.SIDEWALK)
    found = []
    for i in range(count):
        speed = float(np.clip(rng.normal(WALK_MEAN, WALK_SIGMA), 0.7, 2.2))
        pick, along, side = rng.random(3).tolist()
        crosses = bool(len(zebras)) and (i % 2 == 0 or not len(walks))
        if crosses:
            way, signal = _over(map, zebras[int(pick * len(zebras))], side)
            wait_at: tuple[int, ...] = (1,)
        elif len(walks):
            way, signal = _along(map, int(walks[int(pick * len(walks))]), side), None
            wait_at = ()
        else:
            break
        start = way[0] + along * (way[1] - way[0])
        found.append(
            _Walker(f"pedestrian_{i + 1:02d}", way, wait_at, signal, speed, 1, *start.tolist())
        )
    return found


def _over(map: RoadMap, zebra: Floats, side: float) -> tuple[Floats, int | None]:
    """Returns the way (4, 2) over a zebra and on along the street on both sides, and the signal of its cars.

    side: 0 to 1, how far along the street; the signal is None where no light is near.
    """
    corners = zebra[:4, :2]
    edges = np.roll(corners, -1, axis=0) - corners
    lengths = np.hypot(edges[:, 0], edges[:, 1])
    k = int(np.argmax(lengths))  # the longer edges lie across the street
    across = edges[k] / lengths[k]
    middle = corners.mean(axis=0)
    reach = 0.5 * lengths[k] + 1.0
    a, b = middle - reach * across, middle + reach * across
    outward = middle / max(float(np.hypot(*middle)), 1e-6)  # away from the map's middle
    away = outward - across * float(outward @ across)
    away = away / max(float(np.hypot(*away)), 1e-6) * STROLL * (0.5 + side)
    shift = across * 1.0
    lights = np.flatnonzero(map.signals.kind == SignalKind.LIGHT)
    signal = None
    if len(lights):
        stops = [map.at(int(map.signals.lane[r]), float(map.signals.s[r])) for r in lights]
        d = [hypot(p.x - middle[0], p.y - middle[1]) for p in stops]
        if min(d) < 20.0:
            signal = int(map.signals.id[lights[int(np.argmin(d))]])
    return np.array([a - shift + away, a, b, b + shift + away]), signal


def _along(map: RoadMap, lane: int, side: float) -> Floats:
    """Returns the way (n, 2) in m along a sidewalk, at the share `side` (0..1) of its width."""
    first, size = int(map.lanes.first[lane]), int(map.lanes.size[lane])
    step = slice(first, first + size, 5)
    p = map.samples
    offset = (side - 0.5) * 0.6 * p.width[step]
    h = p.heading[step]
    return np.column_stack([p.x[step] - offset * np.sin(h), p.y[step] + offset * np.cos(h)])


def _riders(map: RoadMap, count: int, rng: np.random.Generator) -> list[_Rider]:
    """Returns `count` cyclists on lanes with town limits; [] where the map has none."""
    lanes = _streets(map)
    found: list[_Rider] = []
    for i in range(count if len(lanes) else 0):
        lane = int(lanes[int(rng.integers(len(lanes)))])
        s = float(map.lanes.length[lane]) * float(rng.uniform(0.2, 0.7))
        speed = float(np.clip(rng.normal(RIDE_MEAN, RIDE_SIGMA), 3.0, 6.5))
        onward = [lane]
        _go_on(map, onward, rng)
        found.append(_Rider(f"cyclist_{i + 1:02d}", onward, s, speed))
    return found


def _streets(map: RoadMap) -> NDArray[np.intp]:
    """Returns the lanes outside junctions with a limit of 50 km/h at most that are long enough."""
    limit = np.nan_to_num(map.samples.limit[map.lanes.first], nan=50.0 / 3.6)
    return np.flatnonzero(
        (map.lanes.kind == LaneKind.DRIVING)
        & (map.lanes.junction < 0)
        & (limit < 14.0)
        & (map.lanes.length > 60.0)
    )


def _go_on(map: RoadMap, lanes: list[int], rng: np.random.Generator) -> None:
    """Appends lanes that follow, up to LANES_AHEAD in all, or up to a dead end.

    They are drawn, not onto fast roads where there is a choice.
    """
    while len(lanes) < LANES_AHEAD:
        ways = [n for n in map.successors(lanes[-1]) if map.arrays.drivable[n]]
        if not ways:
            return
        limits = [float(map.samples.limit[map.lanes.first[n]]) for n in ways]
        slow = [n for n, v in zip(ways, limits, strict=True) if not v > 14.0] or ways
        lanes.append(slow[int(rng.integers(len(slow)))])
