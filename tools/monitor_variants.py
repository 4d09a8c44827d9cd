"""Variants of the rules `tracked` that were tried: each is a row of docs/channels-tables.md.

They judge what lookouts have seen, as `Tracked` does. Their settings were chosen on drives with seeds
from 9000000 to 9999999 alone.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from math import erf, hypot, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.spatial import cKDTree

from skidpad.core.channels import ChannelFrame
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.judging.curves import Looked
from skidpad.evidence.channels.tracked.tracks import COAST, V_LEAST, VEHICLES, Track
from skidpad.evidence.channels.tracked.vote import CHI2_LIMIT, SIGMA_PLACE, Tracked
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.stack.channels.channel import CYCLE

Floats = NDArray[np.float64]
Variances = tuple[float, float, float]  # of gap and speed, and their covariance
SURE_OF_MEAN = 0.95  # of a probability over the last half second
LAG = 0.5  # s by which smoothed tracks are late
OFF_CENTRE, MEAN_S = 0.8, 0.5  # m from the lane's centre by which the map doubts a position; s
OFF_ROAD = 5.0  # m, of a place that no lane is near
SIGMA_A = 2.0  # m/s^2, motion noise as of the tracks themselves


class Fused(Tracked):
    """Where channels have one object, it is judged by their mean, by inverse covariances."""

    def _follow(self, t: float, seen: Any) -> None:
        for tracks, one in zip(self.tracks, seen, strict=True):
            tracks.observe(t, one)
        own = {
            id(k): (k.gap, k.v, k.p, fused_state([k, *self._others(c, k)]))
            for c, tracks in enumerate(self.tracks)
            for k in tracks
        }
        for tracks, one in zip(self.tracks, seen, strict=True):
            for k in tracks:
                gap, v, p, (k.gap, k.v, k.p) = own[id(k)]
                if one is not None:
                    k.judge(t, one.v_ego, tracks.safe, tracks.sure)
                k.gap, k.v, k.p = gap, v, p
            for key in [key for key, k in tracks.tracks.items() if t - k.t > COAST + 1e-6]:
                del tracks.tracks[key]

    def _others(self, channel: int, track: Track) -> list[Track]:
        rest = (c for c in range(len(self.tracks)) if c != channel)
        return [o for c in rest if (o := self._same(c, track)) is not None]


def fused_state(tracks: Sequence[Track]) -> tuple[float, float, Variances]:
    """Gap, speed and covariances of one object, weighted by the inverse of each track's covariance."""
    weights = [np.linalg.inv([[k.p[0], k.p[2]], [k.p[2], k.p[1]]]) for k in tracks]
    states = [w @ [k.gap, k.v] for w, k in zip(weights, tracks, strict=True)]
    p = np.linalg.inv(np.sum(weights, axis=0))
    gap, v = (p @ np.sum(states, axis=0)).tolist()
    return gap, v, (float(p[0, 0]), float(p[1, 1]), float(p[0, 1]))


class Integrated(Tracked):
    """A gap is short when its probability, averaged over the last half second, is above a limit.

    share: of the newest probability in the mean. on, off: limits of the mean at which an alarm begins
    and ends. vote: another channel that has the object, with a mean below one half, takes it back.
    """

    share, on, off, vote = 0.25, SURE_OF_MEAN, SURE_OF_MEAN, False

    def __init__(self, *words: Any, **more: Any) -> None:
        super().__init__(*words, **more)
        self.means: dict[int, float] = {}
        self.raised: set[int] = set()

    def distances(self, t: float, seen: Any, frames: Any) -> dict[Signal, float]:
        """1 where a gap is short, on either side."""
        super().distances(t, seen, frames)
        out = dict.fromkeys((Signal.FRONT_DEFICIT, Signal.REAR_DEFICIT, Signal.UNSEEN_DEFICIT), 0.0)
        before, self.means = self.means, {}
        for track in (track for tracks in self.tracks for track in tracks):
            rest = (1.0 - self.share) * before.get(id(track), 0.0)
            self.means[id(track)] = rest + self.share * _probability(track)
        raised, self.raised = self.raised, set()
        for c, (tracks, one) in enumerate(zip(self.tracks, seen, strict=True)):
            for track in tracks:
                limit = self.off if id(track) in raised else self.on
                if self.means[id(track)] <= limit or one is None or one.v_ego < V_LEAST:
                    continue
                self.raised.add(id(track))
                if not (self.vote and self._is_disputed(c, track)):
                    out[Signal.REAR_DEFICIT if track.behind else Signal.FRONT_DEFICIT] = 1.0
        return out

    def _is_disputed(self, channel: int, track: Track) -> bool:
        others = (self._same(c, track) for c in range(len(self.tracks)) if c != channel)
        return any(o is not None and self.means[id(o)] < 0.5 for o in others)


class Patient(Integrated):
    """A mean probability over a longer time; an alarm ends at a lower limit than it begins."""

    share, on, off = 0.15, SURE_OF_MEAN, 0.5


class Steady(Integrated, Fused):
    """The same with fusion and a vote, and surer: at most one false alarm per hour on the tuning drives."""

    share, on, off, vote = 0.15, 0.97, 0.6, True


def _probability(track: Track) -> float:
    return 0.5 * (1.0 + erf(track.deficit / max(track.sigma, 1e-6) / sqrt(2.0)))


class Smoothed(Tracked):
    """Gaps are judged half a second late, by tracks that later reports have smoothed (fixed lag)."""

    def __init__(self, *words: Any, **more: Any) -> None:
        super().__init__(*words, **more)
        self.pasts: dict[int, tuple[Track, deque[State]]] = {}

    def _follow(self, t: float, seen: Any) -> None:
        pasts, self.pasts = self.pasts, {}
        for tracks, one in zip(self.tracks, seen, strict=True):
            tracks.observe(t, one)
            for k in tracks if one is not None else ():
                _, past = pasts.get(id(k), (k, deque[State]()))
                self.pasts[id(k)] = (k, past)
                if k.t == t:
                    past.append((t, k.gap, k.v, k.p, one.v_ego))
                while len(past) > 1 and t - past[1][0] >= LAG - 1e-6:
                    past.popleft()
                own = k.gap, k.v, k.p
                k.gap, k.v, k.p = smoothed_state(past, k.behind)
                k.judge(t, past[0][4], tracks.safe, tracks.sure)
                k.gap, k.v, k.p = own
        still = {id(k) for tracks in self.tracks for k in tracks}
        self.pasts |= {i: of for i, of in pasts.items() if i in still and i not in self.pasts}


State = tuple[float, float, float, Variances, float]  # t, gap, speed, variances, the ego's speed


def smoothed_state(past: Sequence[State], behind: bool) -> tuple[float, float, Variances]:
    """Gap, speed and covariances of the oldest state, given all later ones (Rauch, Tung, Striebel)."""
    sign = -1.0 if behind else 1.0
    (t1, gap, v, (a, b, c), v_ego), *earlier = list(past)[::-1]
    for t0, gap0, v0, (a0, b0, c0), v_ego0 in earlier:
        dt, q = t1 - t0, SIGMA_A * SIGMA_A
        # the state as it was predicted from t0, and its covariances
        gap1 = gap0 + sign * dt * (v0 - v_ego)
        m01 = c0 + sign * dt * b0
        pa = a0 + 2.0 * sign * dt * c0 + dt * dt * b0 + 0.25 * q * dt**4
        pb, pc = b0 + q * dt * dt, m01 + 0.5 * sign * q * dt**3
        # gain: P0 F' / P1
        m00 = a0 + sign * dt * c0
        det = max(pa * pb - pc * pc, 1e-12)
        g00, g01 = (m00 * pb - c0 * pc) / det, (c0 * pa - m00 * pc) / det
        g10, g11 = (m01 * pb - b0 * pc) / det, (b0 * pa - m01 * pc) / det
        d_gap, d_v = gap - gap1, v - v0
        da, db, dc = a - pa, b - pb, c - pc
        gap, v = gap0 + g00 * d_gap + g01 * d_v, v0 + g10 * d_gap + g11 * d_v
        a = a0 + g00 * g00 * da + 2.0 * g00 * g01 * dc + g01 * g01 * db
        b = b0 + g10 * g10 * da + 2.0 * g10 * g11 * dc + g11 * g11 * db
        c = c0 + g00 * g10 * da + (g00 * g11 + g01 * g10) * dc + g01 * g11 * db
        t1, v_ego = t0, v_ego0
    return gap, v, (a, b, c)


def majority(short: Floats, length: float) -> Floats:
    """Whether a gap is short in most of the cycles of `length` s around each one: half of that late."""
    out: Floats = median_filter(short, size=round(length / CYCLE) | 1, mode="nearest")
    return out


def off_centre(map: RoadMap, looked: Sequence[Looked]) -> Floats:
    """(T,) m by which the channel that is farthest from a lane's centre lies off it, mean of 0.5 s."""
    worst = np.zeros(len(looked))
    for k, cycle in enumerate(looked):
        for frame in cycle.frames:
            if frame is not None and np.isfinite(frame.ego[:2]).all():
                point = map.project(float(frame.ego[0]), float(frame.ego[1]), 0.0)
                worst[k] = max(worst[k], OFF_ROAD if point is None else abs(point.offset))
    out: Floats = uniform_filter1d(worst, size=round(MEAN_S / CYCLE), mode="nearest")
    return out


class MapMatch:
    """By how much a channel's world lies beside the lanes of the map: its vehicles are on lanes.

    A channel's error of position moves everything that it sees. Its ego says nothing: who drives steers
    until its own position lies on the lane.
    """

    reach, turn, lateral, prior = 40.0, 0.4, 3.0, 1.0  # m, rad, m, vehicles' worth of no error
    share = 0.2  # of a cycle in the mean: half a second

    def __init__(self, map: RoadMap) -> None:
        lanes = np.flatnonzero(map.lanes.kind == LaneKind.DRIVING)
        rows = np.flatnonzero(np.isin(map.samples.lane, lanes))
        s = map.samples
        self.lines = np.column_stack([s.x[rows], s.y[rows], s.heading[rows]])
        self.tree = cKDTree(self.lines[:, :2])
        self.shift: Floats | None = None

    def update(self, frame: ChannelFrame | None) -> None:
        """One cycle of the channel."""
        if frame is None or not np.isfinite(frame.ego).all():
            self.shift = None
            return
        beside = self._residuals(frame)
        if not len(beside):
            self.shift = None
            return
        normals, r = beside[:, :2], beside[:, 2]
        # least squares, a vehicle's residual at most a metre from the median, and a prior of none
        near = np.abs(r - np.median(r)) < 1.0 if len(r) > 2 else np.ones(len(r), dtype=bool)
        left = normals[near].T @ normals[near] + self.prior * np.eye(2)
        now = np.linalg.solve(left, normals[near].T @ r[near])
        self.shift = now if self.shift is None else self.shift + self.share * (now - self.shift)

    def _residuals(self, frame: ChannelFrame) -> Floats:
        """Rows of the lane's normal and the m to the left of its centre, by vehicle on a lane."""
        labels = np.isin(frame.classes, list(VEHICLES))
        apart = np.hypot(*(frame.objects[:, :2] - frame.ego[:2]).T)
        moving = np.hypot(frame.objects[:, 3], frame.objects[:, 4]) > V_LEAST
        objects = frame.objects[labels & (apart < self.reach) & moving]
        if not len(objects):
            return np.empty((0, 3))
        _, found = self.tree.query(objects[:, :2], k=6)
        lines = self.lines[found]  # (n, 6, 3)
        turn = (objects[:, None, 2] - lines[:, :, 2] + np.pi) % (2.0 * np.pi) - np.pi
        nx, ny = -np.sin(lines[:, :, 2]), np.cos(lines[:, :, 2])
        offset = nx * (objects[:, None, 0] - lines[:, :, 0]) + ny * (
            objects[:, None, 1] - lines[:, :, 1]
        )
        fits = np.where(np.abs(turn) < self.turn, np.abs(offset), np.inf)
        k = np.argmin(fits, axis=1)
        rows = np.arange(len(objects))
        good = fits[rows, k] < self.lateral
        out: Floats = np.column_stack([nx[rows, k], ny[rows, k], offset[rows, k]])[good]
        return out


class MapVote:
    """Two channels are apart: the map, as the third voter, says how far each one is from where it is.

    The shifts of both channels' worlds against the lanes give the mean of their errors, their positions the
    difference. Where the map says nothing, two channels apart are enough, as in `tracked`.
    """

    least = 1.4  # m: an error under this is none, as a shift shows two thirds of an error at most

    def __init__(self, channels: Sequence[str], map: RoadMap) -> None:
        self.tracked = Tracked(channels)
        self.matches = [MapMatch(map) for _ in channels]

    def update(self, t: float, frames: Sequence[ChannelFrame | None]) -> bool:
        """Whether positions are apart and the map does not contradict."""
        for match, frame in zip(self.matches, frames, strict=True):
            match.update(frame)
        chi2 = self.tracked._offset(t, frames)
        if not chi2 > CHI2_LIMIT:  # nor is NaN
            return False
        pairs = zip(self.tracked.pairs, self.tracked.offsets, strict=True)
        return any(self._is_confirmed(a, b, window) for (a, b), window in pairs)

    def _is_confirmed(self, a: int, b: int, window: Sequence[tuple[float, float, float]]) -> bool:
        if not window:
            return False
        half = 0.5 * np.mean([row[1:] for row in window], axis=0)
        one, two = self.matches[a].shift, self.matches[b].shift
        if one is None or two is None:
            return bool(4.0 * (half @ half) > 2.0 * CHI2_LIMIT * SIGMA_PLACE**2)
        mean = 0.5 * (one + two)
        return max(hypot(*(mean - half)), hypot(*(mean + half))) > self.least


def hold(begins: Iterable[bool], lasts: Iterable[bool]) -> list[bool]:
    """An alarm from where it begins for as long as it lasts."""
    out: list[bool] = []
    for begin, last in zip(begins, lasts, strict=True):
        out.append(bool(begin or (last and out and out[-1])))
    return out
