"""One channel's tracks of vehicles on its path: gap and speed by a Kalman filter, and an alarm."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import dist, hypot, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import ChannelFrame
from skidpad.core.vocabulary import SemanticClass
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.way import Placed, Way

# Measurement and motion noise are assumptions of the order of the channels' sensors.
SIGMA_GAP, SIGMA_V = 0.5, 0.7  # m, m/s of one report
SIGMA_A = 2.0  # m/s^2 by which an object's speed may change unseen
SURE = 2.0  # standard deviations by which a gap must be short
CONFIRM = 0.5  # s
COAST = 0.5  # s without a report after which a track ends
TURN_MOST = np.radians(45.0)
SPARE = 0.3  # m beside the path within which a track that was on it stays on it
V_LEAST = 2.0  # m/s of the ego
NEAR = 4.0  # m between reports of an object without identity
REACH = 75.0  # m from the ego
VEHICLES = {
    int(c)
    for c in (
        SemanticClass.CAR, SemanticClass.TRUCK, SemanticClass.BUS, SemanticClass.TRAIN,
        SemanticClass.MOTORCYCLE, SemanticClass.BICYCLE, SemanticClass.RIDER,
    )
} | {-1}  # fmt: skip


@dataclass(slots=True)
class Track:
    """An object on the path of a channel."""

    behind: bool
    gap: float  # m, bumper to bumper
    v: float  # m/s along the path
    p: tuple[float, float, float]  # variances of gap and v, and their covariance
    t: float  # s of the last report
    place: tuple[float, float]  # in the channel's world
    deficit: float = 0.0  # m that the gap is shorter than the safe one
    sigma: float = 0.0  # m of the deficit
    since: float | None = None  # s from when on it has been surely short
    alarm: bool = False
    alone: float | None = None  # s since when another channel has not had it

    def predict(self, dt: float, v_ego: float) -> None:
        """Moves the gap, and its variances, on by dt s; v_ego is the ego's speed in m/s."""
        rate = (v_ego - self.v) if self.behind else (self.v - v_ego)
        sign = -1.0 if self.behind else 1.0
        self.gap += rate * dt
        a, b, c = self.p
        q = SIGMA_A * SIGMA_A
        self.p = (
            a + 2.0 * sign * dt * c + dt * dt * b + 0.25 * q * dt**4,
            b + q * dt * dt,
            c + sign * dt * b + 0.5 * sign * q * dt**3,
        )

    def correct(self, gap: float, v: float) -> None:
        """Corrects gap in m and speed in m/s by a report of both, one after the other."""
        a, b, c = self.p
        s = a + SIGMA_GAP**2
        k, m = a / s, c / s
        miss = gap - self.gap
        self.gap, self.v = self.gap + k * miss, self.v + m * miss
        a, b, c = (1.0 - k) * a, b - m * c, (1.0 - k) * c
        s = b + SIGMA_V**2
        k, m = c / s, b / s
        miss = v - self.v
        self.gap, self.v = self.gap + k * miss, self.v + m * miss
        self.p = (a - k * c, (1.0 - m) * b, (1.0 - m) * c)

    def judge(self, t: float, v_ego: float, safe: SafeDistance, sure: float) -> None:
        """Compares the gap with the safe one: alarm on when surely short for CONFIRM s, off when surely not.

        t: s; sure: standard deviations. Never an alarm with the ego slower than V_LEAST.
        """
        pair = (self.v, v_ego) if self.behind else (v_ego, self.v)
        need, h = safe.of(*pair), 0.25
        other = (self.v + h, v_ego) if self.behind else (v_ego, self.v + h)
        slope = (safe.of(*other) - need) / h
        a, b, c = self.p
        self.deficit = need - max(self.gap, 0.0)
        self.sigma = sqrt(max(a + slope * slope * b - 2.0 * slope * c, 0.0))
        margin = -sure * self.sigma if self.alarm else sure * self.sigma
        if v_ego < V_LEAST or self.deficit <= margin:
            self.since, self.alarm = None, False
            return
        self.since = t if self.since is None else self.since
        self.alarm = self.alarm or t - self.since >= CONFIRM - 1e-6


class Sighting(NamedTuple):
    """A vehicle near the ego, in path coordinates."""

    key: int  # its identity; negative: the channel gives none
    xy: tuple[float, float]  # in the channel's world
    where: Placed
    half_length: float  # m
    half_width: float


class Seen(NamedTuple):
    """What a message of a channel says of its path, alike for every identifier."""

    v_ego: float
    body: tuple[float, float, float]  # m from the ego's place: front, rear, either side
    sightings: tuple[Sighting, ...]


class Lookout:
    """Puts the messages of one channel, in their order, into path coordinates."""

    def __init__(self) -> None:
        self.way = Way()

    def see(self, frame: ChannelFrame | None) -> Seen | None:
        """Takes in one cycle and returns what it shows; None without a message or a usable ego."""
        if frame is None or not Way.usable(frame):
            return None
        self.way.update(frame)
        rows = _vehicles_near(frame)
        x, y = frame.ego_polygon[:, 0], frame.ego_polygon[:, 1]
        body = (float(x.max()), float(-x.min()), float(np.abs(y).max()))
        places = self.way.line(frame).places(frame.objects[rows]) if len(rows) else ()
        return Seen(
            hypot(*frame.ego[3:].tolist()),
            body,
            tuple(_sighting(frame, i, at) for i, at in zip(rows.tolist(), places, strict=True)),
        )


def _sighting(frame: ChannelFrame, i: int, where: Placed) -> Sighting:
    """Returns object `i` of a frame as a sighting at `where`, with its half sizes in m."""
    shape = frame.polygons[i, : frame.polygon_size[i]]
    half_length, half_width = np.abs(shape).max(axis=0, initial=0.0).tolist()
    x, y = frame.objects[i, :2].tolist()
    return Sighting(int(frame.ids[i]), (x, y), where, half_length, half_width)


class Tracks:
    """Call `update` with every message of the channel, as its lookout has seen it."""

    def __init__(self, safe: SafeDistance, sure: float = SURE) -> None:
        self.safe, self.sure = safe, sure
        self.tracks: dict[int, Track] = {}
        self.number = -1  # of tracks without identity, downwards

    def __iter__(self) -> Iterator[Track]:
        return iter(self.tracks.values())

    def update(self, t: float, seen: Seen | None) -> None:
        """Takes in the cycle at t s and judges all tracks; without a message tracks wait for their end."""
        self.observe(t, seen)
        if seen is not None:
            for track in self:
                track.judge(t, seen.v_ego, self.safe, self.sure)

    def observe(self, t: float, seen: Seen | None) -> None:
        """Follows the objects of the cycle at t s without a judgement; drops tracks unseen for COAST s."""
        if seen is not None:
            for sighting in seen.sightings:
                self._report(t, sighting, seen)
        for key in [k for k, track in self.tracks.items() if t - track.t > COAST + 1e-6]:
            del self.tracks[key]

    def _report(self, t: float, sighting: Sighting, seen: Seen) -> None:
        """Updates or begins the track of an object on the path; leaves out one beside it or turned away."""
        s, offset, turn, v = sighting.where
        body, half_l, half_w = seen.body, sighting.half_length, sighting.half_width
        key = self._key(sighting)
        known = self.tracks.get(key)
        room = body[2] + half_w + (SPARE if known is not None else 0.0)
        if abs(offset) > room or abs(turn) > TURN_MOST:
            return
        behind = s < 0.0
        gap = (-s - body[1] if behind else s - body[0]) - half_l
        if known is None or known.behind is not behind:
            start = (SIGMA_GAP**2, SIGMA_V**2, 0.0)
            self.tracks[key] = Track(behind, gap, v, start, t, sighting.xy)
            return
        known.predict(max(t - known.t, 0.0), seen.v_ego)
        known.correct(gap, v)
        known.t, known.place = t, sighting.xy

    def _key(self, sighting: Sighting) -> int:
        """Returns the object's identity, or that of the nearest track where the channel gives none.

        A new negative one where no track is within NEAR.
        """
        if sighting.key >= 0:
            return sighting.key
        near = [
            (d, key)
            for key, track in self.tracks.items()
            if (d := dist(track.place, sighting.xy)) < NEAR
        ]
        if near:
            return min(near)[1]
        self.number -= 1
        return self.number


def _vehicles_near(frame: ChannelFrame) -> NDArray[np.int64]:
    """Returns the rows of vehicles within REACH of the ego, which may tailgate or be tailgated."""
    labels = frame.classes.tolist()
    rows = np.array([i for i, label in enumerate(labels) if label in VEHICLES], dtype=np.int64)
    dx, dy = (frame.objects[rows, :2] - frame.ego[:2]).T
    near: NDArray[np.int64] = rows[dx * dx + dy * dy <= REACH * REACH]
    return near
