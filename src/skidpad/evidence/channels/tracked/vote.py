"""What the channels' tracks, places and plans say together: the signals of the profile `tracked`."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import combinations
from math import cos, dist, hypot, inf, log, nan, sin

import numpy as np

from skidpad.core.channels import ChannelFrame
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.tracked.distance import SafeDistance
from skidpad.evidence.channels.tracked.grip import OwnGrip
from skidpad.evidence.channels.tracked.tracks import CONFIRM, SURE, Lookout, Seen, Track, Tracks
from skidpad.recording.channels.cycles import STEP

WINDOW = 0.5  # s
SIDES = (Signal.FRONT_DEFICIT, Signal.REAR_DEFICIT)
SAME = 4.0  # m between two channels' reports of one object
SIGMA_PLACE = 0.27  # m per axis: 0.10 m of jitter and 0.25 m of drift, as docs/channels.md states
UNLIKELY = 1e-6  # share of cycles with right positions that may look wrong (assumption)
CHI2_LIMIT = -2.0 * log(UNLIKELY)  # of two degrees of freedom: 27.6
PLAN_STEP = 0.5  # s
# s over which a short gap is the median of its cycles, so that it comes half as late
SMOOTHING = 1.0


class Tracked:
    """Call `update` once per cycle with usable frames; None: the channel is silent."""

    def __init__(
        self,
        channels: Sequence[str],
        safe: SafeDistance | None = None,
        sure: float = SURE,
        smoothing: float = SMOOTHING,
    ) -> None:
        """safe: None: on the grip that the vehicle itself shows, on a dry road until it does.

        smoothing: s of cycles of which a short gap is the median; 0: each cycle by itself.
        """
        self.smoothing = smoothing
        self.recent: dict[Signal, deque[tuple[float, float]]] = {side: deque() for side in SIDES}
        self.lookouts = [Lookout() for _ in channels]
        self.tracks = [Tracks(safe or SafeDistance(), sure) for _ in channels]
        self.own_grip = OwnGrip() if safe is None else None
        self.odometers = [Odometer() for _ in channels]
        self.pairs = tuple(combinations(range(len(channels)), 2))
        self.offsets: list[deque[tuple[float, float, float]]] = [deque() for _ in self.pairs]
        self.apart: list[deque[tuple[float, float]]] = [deque() for _ in self.pairs]

    def update(self, t: float, frames: Sequence[ChannelFrame | None]) -> dict[Signal, float]:
        """Returns the signals at t s: metres of gap that are missing, chi-square, s until plans part."""
        seen = [out.see(f) for out, f in zip(self.lookouts, frames, strict=True)]
        return self.distances(t, seen, frames) | {
            Signal.OFFSET_CHI2: self._offset(t, frames),
            Signal.POSITION_LEAP: self._leap(t, frames),
            Signal.PLANS_APART: self._plans(t, frames),
        }

    def distances(
        self, t: float, seen: Sequence[Seen | None], frames: Sequence[ChannelFrame | None]
    ) -> dict[Signal, float]:
        """Returns the signals of missing gap at t s alone, by what lookouts have seen in the frames.

        0.0 where no gap is short. A channel's alarm counts unless more channels speak against it.
        """
        self._learn_grip(t, frames)
        self._follow(t, seen)
        out = {
            Signal.REAR_DEFICIT: 0.0,
            Signal.FRONT_DEFICIT: 0.0,
            Signal.UNSEEN_DEFICIT: 0.0,
        }
        for c, tracks in enumerate(self.tracks):
            for track in tracks:
                if not track.alarm:
                    continue
                others = [
                    self._same(o, track)
                    for o in range(len(frames))
                    if o != c and frames[o] is not None
                ]
                agree = sum(o is not None and o.deficit > 0.0 for o in others) + 1
                against = sum(o is not None and o.deficit <= 0.0 for o in others)
                if agree >= against:
                    side = Signal.REAR_DEFICIT if track.behind else Signal.FRONT_DEFICIT
                    out[side] = max(out[side], track.deficit)
                if None not in others:
                    track.alone = None
                elif track.alone is None:
                    track.alone = t
                elif t - track.alone >= CONFIRM - 1e-6:
                    out[Signal.UNSEEN_DEFICIT] = max(out[Signal.UNSEEN_DEFICIT], track.deficit)
        return out | {side: self._smooth(side, t, out[side]) for side in SIDES}

    def _smooth(self, side: Signal, t: float, deficit: float) -> float:
        """Returns the median of a deficit over the last cycles; those missing at the start count 0."""
        if not self.smoothing:
            return deficit
        window = self.recent[side]
        window.append((t, deficit))
        while t - window[0][0] > self.smoothing + 1e-6:
            window.popleft()
        values = [value for _, value in window]
        values += [0.0] * (
            round(self.smoothing / STEP) + 1 - len(values)
        )  # deficits are never less
        return sorted(values)[len(values) // 2]

    def _same(self, channel: int, track: Track) -> Track | None:
        """Returns the track of the same object in the channel of this number; None where it has none."""
        for other in self.tracks[channel]:
            near = dist(other.place, track.place) < SAME
            if near and other.behind is track.behind:
                return other
        return None

    def _follow(self, t: float, seen: Sequence[Seen | None]) -> None:
        """Updates the tracks of each channel at `t` s; None: the channel is silent."""
        for tracks, one in zip(self.tracks, seen, strict=True):
            tracks.update(t, one)

    def _learn_grip(self, t: float, frames: Sequence[ChannelFrame | None]) -> None:
        """Sets the safe distance to that of the grip which the vehicle shows, unless it was told one."""
        if self.own_grip is None:
            return
        before, grip = self.own_grip.grip, self.own_grip.update(t, frames)
        if grip != before:
            safe = SafeDistance() if grip is None else SafeDistance.on(grip)
            for tracks in self.tracks:
                tracks.safe = safe

    def _leap(self, t: float, frames: Sequence[ChannelFrame | None]) -> float:
        """Returns the m by which one channel left odometry and the others; NaN: unknown."""
        for odometer, frame in zip(self.odometers, frames, strict=True):
            odometer.update(t, frame)
        return greatest_leap(self.odometers)

    def _offset(self, t: float, frames: Sequence[ChannelFrame | None]) -> float:
        """Returns the greatest chi-square over pairs of the mean offset of 0.5 s; NaN until that is known."""
        worst = nan
        for (a, b), window in zip(self.pairs, self.offsets, strict=True):
            one, two = frames[a], frames[b]
            if one is None or two is None or not np.isfinite([*one.ego[:3], *two.ego[:3]]).all():
                window.clear()
                continue
            dx, dy = (two.ego[:2] - one.ego[:2]).tolist()
            window.append((t, dx, dy))
            while t - window[0][0] > CONFIRM + 1e-6:
                window.popleft()
            if t - window[0][0] < CONFIRM - 1e-6:
                continue
            mean_x, mean_y = (sum(row[k] for row in window) / len(window) for k in (1, 2))
            chi2 = 0.5 * (mean_x * mean_x + mean_y * mean_y) / (SIGMA_PLACE * SIGMA_PLACE)
            worst = chi2 if worst != worst else max(worst, chi2)
        return worst

    def _plans(self, t: float, frames: Sequence[ChannelFrame | None]) -> float:
        """Returns the least over pairs of the s until both plans' footprints share no ground, held for 0.5 s.

        inf: they share it to their end; nan without a full window.
        """
        least = nan
        for (a, b), window in zip(self.pairs, self.apart, strict=True):
            one, two = frames[a], frames[b]
            if one is None or two is None or not (_has_footprint(one) and _has_footprint(two)):
                window.clear()
                continue
            window.append((t, parting(one, two)))
            while t - window[0][0] > CONFIRM + 1e-6:
                window.popleft()
            if t - window[0][0] >= CONFIRM - 1e-6:
                held = max(value for _, value in window)
                least = held if least != least else min(least, held)
        return least


def _has_footprint(frame: ChannelFrame) -> bool:
    """Returns whether the ego's outline can be carried along its plan."""
    return len(frame.plan) > 1 and len(frame.ego_polygon) > 2


def parting(one: ChannelFrame, two: ChannelFrame) -> float:
    """Returns the s after which the ego on one plan and on the other would stand side by side or apart.

    Each plan is taken from its own channel's ego, so that an offset of positions parts no plans.
    inf: not within both plans.
    """
    length = float(np.ptp(one.ego_polygon[:, 0]))
    width = float(np.ptp(one.ego_polygon[:, 1]))
    end = min(float(one.plan[-1, 2]), float(two.plan[-1, 2]))
    times = np.arange(PLAN_STEP, end + 1e-9, PLAN_STEP)
    ways = [
        np.column_stack([np.interp(times, f.plan[:, 2], f.plan[:, k]) - f.ego[k] for k in (0, 1)])
        for f in (one, two)
    ]
    c, s = cos(one.ego[2]), sin(one.ego[2])
    d = ways[1] - ways[0]
    along, across = np.abs(c * d[:, 0] + s * d[:, 1]), np.abs(c * d[:, 1] - s * d[:, 0])
    apart = np.flatnonzero((along > length) | (across > width))
    return float(times[apart[0]]) if apart.size else inf


# Whether a channel's position follows its own odometry: the innovation of half a second.


class Odometer:
    """Call `update` once per cycle with the frame of one channel."""

    def __init__(self) -> None:
        self.before: tuple[float, float, float] | None = None  # t, vx, vy
        self.driven = (0.0, 0.0)  # m by odometry
        self.errors: deque[tuple[float, float, float]] = deque()  # t, position less odometry

    def update(self, t: float, frame: ChannelFrame | None) -> None:
        """Takes in the cycle at t s; None, or an ego that is not finite, forgets all before."""
        if frame is None or not np.isfinite(frame.ego).all():
            self.before = None
            self.errors.clear()
            return
        x, y, _, vx, vy = frame.ego.tolist()
        if self.before is not None:
            t0, vx0, vy0 = self.before
            half = 0.5 * (t - t0)
            self.driven = (self.driven[0] + half * (vx0 + vx), self.driven[1] + half * (vy0 + vy))
        self.before = (t, vx, vy)
        now = (x - self.driven[0], y - self.driven[1])
        self.errors.append((t, *now))
        while t - self.errors[0][0] > WINDOW + 1e-6:
            self.errors.popleft()

    def moves(self) -> dict[float, tuple[float, float]]:
        """Returns m in x and y by which the position has moved beside odometry, by the time in s since when.

        The times are those of the last WINDOW s; {} after a cycle without a message.
        """
        if not self.errors:
            return {}
        _, x, y = self.errors[-1]
        return {t: (x - ex, y - ey) for t, ex, ey in self.errors}


def greatest_leap(odometers: Sequence[Odometer]) -> float:
    """Returns the m by which one channel's position left odometry and the others'; NaN: all are silent.

    What all positions do alike is an error of the odometry, as of a car that slides sideways.
    """
    known = [moves for o in odometers if (moves := o.moves())]
    return max((_own_leap(i, known) for i in range(len(known))), default=nan)


def _own_leap(i: int, known: Sequence[dict[float, tuple[float, float]]]) -> float:
    """Returns the largest move of channel `i` in m or, if less, its largest difference from another's.

    known: moves of all channels that have any.
    """
    own, rest = known[i], [*known[:i], *known[i + 1 :]]
    apart = [max(dist(own[t], other[t]) for t in own.keys() & other.keys()) for other in rest]
    return min([max(hypot(*move) for move in own.values()), *apart])
