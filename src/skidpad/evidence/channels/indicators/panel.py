"""The indicators of one drive, cycle by cycle: the state that pure functions do not keep."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.channels import ChannelFrame
from skidpad.core.errors import ConfigError
from skidpad.evidence.channels.indicators import comfort, prediction, similarity
from skidpad.evidence.channels.indicators.catalogue import (
    CHANNEL_INDICATORS,
    PAIR_INDICATORS,
    Indicator,
)
from skidpad.evidence.channels.indicators.comfort import Form
from skidpad.evidence.channels.paths import sample_plan, sample_predictions

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]
CHANNEL_ROW = {indicator: i for i, indicator in enumerate(CHANNEL_INDICATORS)}
PAIR_ROW = {indicator: i for i, indicator in enumerate(PAIR_INDICATORS)}
GAP_MAX = 0.35  # s, a longer silence of a channel forgets its history
JERK_SPAN = 1.0  # s between two fitted accelerations
SHIFT_SHORT = 0.5  # s, decision C-6
SHIFT_LONG = 10.0  # s
_AGREEING = tuple(
    PAIR_ROW[i]
    for i in (
        Indicator.EGO_LOCATION, Indicator.EGO_ORIENTATION, Indicator.OBJECT_COUNT,
        Indicator.OBJECT_LOCATION, Indicator.OBJECT_ORIENTATION, Indicator.OBJECT_AREA,
        Indicator.OBJECT_TRAJECTORY, Indicator.EGO_TRAJECTORY, Indicator.CROSS_PATH,
    )
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class IndicatorSettings:
    """What the sources leave open, with the values of the requirements (C-103, DC-18)."""

    form: Form = Form.CORRECTED
    steepness: float = comfort.STEEPNESS
    history_points: int = 10  # positions before the first score; forms printed and completed
    pairing_distance: float = similarity.PAIRING_DISTANCE
    decay: float = prediction.WAYPOINT_DECAY
    plan_history: int = 10  # earlier plans (C-078)
    history_decay: float = prediction.HISTORY_DECAY
    match_tolerance: float = prediction.MATCH_TOLERANCE

    def __post_init__(self) -> None:
        if self.pairing_distance <= 1.0:
            raise ConfigError(
                "pairing_distance must exceed 1 m, or the bound of object location could never "
                f"be reached (C-054), got {self.pairing_distance}"
            )
        if not (0.0 < self.decay <= 1.0 and 0.0 < self.history_decay <= 1.0):
            raise ConfigError("decay and history_decay must be in (0, 1]")
        if self.history_points < comfort.MIN_POINTS or self.plan_history < 1:
            raise ConfigError(
                f"history_points must be at least {comfort.MIN_POINTS} and plan_history at least 1"
            )

    @property
    def validation_delay(self) -> float:
        """Age in s of the prediction that motion is held against: 0 = the previous cycle."""
        return 1.0 if self.form is Form.CORRECTED else 0.0


@dataclass(slots=True)
class Readings:
    """Values of one cycle; NaN inside, `evaluated` outside."""

    channel: Floats  # (len(CHANNEL_INDICATORS), n channels)
    pair: Floats  # (len(PAIR_INDICATORS), n pairs)

    @property
    def channel_evaluated(self) -> NDArray[np.bool_]:
        """Mask of `channel`."""
        return np.isfinite(self.channel)

    @property
    def pair_evaluated(self) -> NDArray[np.bool_]:
        """Mask of `pair`."""
        return np.isfinite(self.pair)


class _Channel:
    """What is remembered of one channel."""

    def __init__(self, settings: IndicatorSettings) -> None:
        self.poses: deque[tuple[float, float, float, float]] = deque(maxlen=32)
        self.fits: deque[tuple[float, float]] = deque(maxlen=32)  # time, longitudinal acceleration
        self.plans: deque[tuple[float, Floats, Floats]] = deque(maxlen=settings.plan_history)
        self.frames: deque[ChannelFrame] = deque(maxlen=16)
        self.path_scores: deque[float] = deque(maxlen=similarity.VARIANCE_WINDOW)
        self.ways: Floats = np.empty((prediction.WAYPOINTS, 2))
        self.inside = 0
        self.object_ways: Floats = np.empty((0, prediction.WAYPOINTS, 2))
        self.object_inside: Counts = np.empty(0, np.int64)
        self.areas: Floats = np.empty(0)

    def forget(self) -> None:
        for memory in (self.poses, self.fits, self.plans, self.frames, self.path_scores):
            memory.clear()


class IndicatorPanel:
    """All indicators of C-040 to C-079 for any number of channels; call its parts in order."""

    def __init__(self, n_channels: int, settings: IndicatorSettings) -> None:
        if n_channels < 1:
            raise ConfigError(f"a panel needs at least one channel, got {n_channels}")
        self.settings = settings
        self.n = n_channels
        self.pairs = tuple(combinations(range(n_channels), 2))
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.memory = [_Channel(self.settings) for _ in range(self.n)]
        window = similarity.VARIANCE_WINDOW
        self.location_scores = [deque([np.nan] * window, window) for _ in self.pairs]
        self.cross_scores = [deque([np.nan] * window, window) for _ in self.pairs]
        self.offsets: list[deque[tuple[float, float, float]]] = [deque() for _ in self.pairs]

    def begin(self, frames: Sequence[ChannelFrame | None]) -> Readings:
        """Empty readings of a cycle; channels that were silent for long lose their history."""
        for memory, frame in zip(self.memory, frames, strict=True):
            last = memory.frames[-1].t if memory.frames else None
            if frame is not None and last is not None and not 0.0 <= frame.t - last <= GAP_MAX:
                memory.forget()
        return Readings(
            np.full((len(CHANNEL_INDICATORS), self.n), np.nan),
            np.full((len(PAIR_INDICATORS), len(self.pairs)), np.nan),
        )

    def comfort(self, frames: Sequence[ChannelFrame | None], out: Readings) -> None:
        """Comfort of the driven and of the planned path, per channel."""
        printed = self.settings.form is Form.PRINTED
        for i, frame in enumerate(frames):
            if frame is None:
                continue
            out.channel[CHANNEL_ROW[Indicator.HISTORY_COMFORT], i] = self._history_comfort(i, frame)
            out.channel[CHANNEL_ROW[Indicator.PLANNED_PATH_COMFORT], i] = (
                comfort.planned_path_comfort(
                    frame.plan, frame.ego, self.settings.steepness, printed
                )
            )

    def _history_comfort(self, i: int, frame: ChannelFrame) -> float:
        memory, settings = self.memory[i], self.settings
        x, y, heading = frame.ego[:3].tolist()
        if memory.poses and memory.poses[-1][0] == frame.t:
            memory.poses.pop()  # the same message in two cycles is one position
        memory.poses.append((frame.t, x, y, heading))
        table = np.array(memory.poses)
        if settings.form is not Form.CORRECTED:
            table = table[-settings.history_points :]
            if len(table) < settings.history_points:
                return float("nan")
            t, x_, y_, h = np.ascontiguousarray(table.T)
            return comfort.path_comfort(
                t, x_, y_, h, settings.steepness, settings.form is Form.PRINTED
            )
        t, x_, y_, h = np.ascontiguousarray(
            table[table[:, 0] >= frame.t - comfort.FIT_WINDOW - 1e-6].T
        )
        along, across = comfort.fitted_acceleration(t, x_, y_, float(h[len(h) // 2]))
        if memory.fits and memory.fits[-1][0] == frame.t:
            memory.fits.pop()
        memory.fits.append((frame.t, along))
        earlier = _nearest(memory.fits, frame.t - JERK_SPAN)
        if earlier is None:
            return float("nan")
        jerk = (along - earlier[1]) / (frame.t - earlier[0])
        return comfort.comfort_score(along, across, jerk, settings.steepness, False)

    def similarity(self, frames: Sequence[ChannelFrame | None], out: Readings) -> None:
        """Agreement of ego poses and of objects, per pair; pairs objects for `prediction` too."""
        self.object_pairs: list[Counts | None] = [None] * len(self.pairs)
        for frame, memory in zip(frames, self.memory, strict=True):
            if frame is not None:
                memory.areas = similarity.polygon_areas(frame.polygons, frame.polygon_size)
        for p, (a, b) in enumerate(self.pairs):
            frame_a, frame_b = frames[a], frames[b]
            row = out.pair[:, p]
            if frame_a is None or frame_b is None:
                self.location_scores[p].append(np.nan)
                continue
            self._ego_similarity(p, frame_a, frame_b, row)
            pairs = similarity.pair_points(
                frame_a.objects, frame_b.objects, self.settings.pairing_distance
            )
            self.object_pairs[p] = pairs
            location, orientation, area = similarity.object_similarity(
                frame_a.objects, self.memory[a].areas, frame_b.objects, self.memory[b].areas, pairs
            )
            row[PAIR_ROW[Indicator.OBJECT_LOCATION]] = location
            row[PAIR_ROW[Indicator.OBJECT_ORIENTATION]] = orientation
            row[PAIR_ROW[Indicator.OBJECT_AREA]] = area
            row[PAIR_ROW[Indicator.CLASS_AGREEMENT]] = similarity.class_agreement(
                frame_a.classes, frame_b.classes, pairs
            )

    def paired_rows(self) -> list[set[int]]:
        """Per channel the rows of its objects that some other channel also reports now."""
        rows: list[set[int]] = [set() for _ in range(self.n)]
        for (a, b), pairs in zip(self.pairs, self.object_pairs, strict=True):
            if pairs is not None:
                rows[a].update(pairs[:, 0].tolist())
                rows[b].update(pairs[:, 1].tolist())
        return rows

    def _ego_similarity(self, p: int, a: ChannelFrame, b: ChannelFrame, row: Floats) -> None:
        score = similarity.location_similarity(a.ego, b.ego)
        scores = self.location_scores[p]
        scores.append(score)
        row[PAIR_ROW[Indicator.EGO_LOCATION]] = score
        row[PAIR_ROW[Indicator.EGO_LOCATION_VARIANCE]] = similarity.sample_variance(
            np.array(scores)
        )
        row[PAIR_ROW[Indicator.EGO_ORIENTATION]] = similarity.angle_similarity(
            float(a.ego[2]), float(b.ego[2])
        )
        t = max(a.t, b.t)
        dx, dy = (a.ego[:2] - b.ego[:2]).tolist()
        history = self.offsets[p]
        if np.isfinite(dx + dy):
            history.append((t, dx, dy))
        while history and not t - SHIFT_LONG - 0.06 <= history[0][0] <= t:
            history.popleft()
        for indicator, span in (
            (Indicator.EGO_SHIFT_SHORT, SHIFT_SHORT),
            (Indicator.EGO_SHIFT_LONG, SHIFT_LONG),
        ):
            earlier = _nearest(history, t - span)
            if earlier is not None:
                row[PAIR_ROW[indicator]] = float(np.hypot(dx - earlier[1], dy - earlier[2]))

    def counts(self, reported: Sequence[int | None], out: Readings) -> None:
        """Agreement on the number of objects, of all that each channel reported (C-056)."""
        for p, (a, b) in enumerate(self.pairs):
            n_a, n_b = reported[a], reported[b]
            if n_a is not None and n_b is not None:
                out.pair[PAIR_ROW[Indicator.OBJECT_COUNT], p] = similarity.count_similarity(
                    n_a, n_b
                )

    def prediction(self, frames: Sequence[ChannelFrame | None], out: Readings) -> None:
        """Plans and predictions against each other, the past and what happened."""
        for i, frame in enumerate(frames):
            if frame is None:
                self.memory[i].path_scores.clear()
                continue
            self._sample(i, frame)
            out.channel[CHANNEL_ROW[Indicator.CHANNEL_PATH], i] = self._channel_path(i, frame)
            scores = self.memory[i].path_scores
            if len(scores) == similarity.VARIANCE_WINDOW:
                out.channel[CHANNEL_ROW[Indicator.CHANNEL_PATH_VARIANCE], i] = (
                    similarity.sample_variance(np.array(scores))
                )
            self._validate_motion(i, frame, out)
        for p, (a, b) in enumerate(self.pairs):
            self._cross_paths(p, a, b, frames, out.pair[:, p])
            known = out.pair[_AGREEING, p]
            known = known[np.isfinite(known)]
            if known.size:
                out.pair[PAIR_ROW[Indicator.AGREEMENT], p] = known.mean()

    def _sample(self, i: int, frame: ChannelFrame) -> None:
        memory = self.memory[i]
        n, step = len(frame.objects), prediction.WAYPOINT_STEP
        memory.inside = sample_plan(frame.plan, frame.ego, 0.0, step, memory.ways)
        memory.object_ways = np.empty((n, prediction.WAYPOINTS, 2))
        memory.object_inside = np.empty(n, np.int64)
        sample_predictions(
            frame.objects, frame.predictions, frame.prediction_t, 0.0, step,
            memory.object_ways, memory.object_inside,
        )  # fmt: skip

    def _channel_path(self, i: int, frame: ChannelFrame) -> float:
        memory = self.memory[i]
        if memory.plans and memory.plans[-1][0] == frame.t:
            memory.plans.pop()
        scores = np.full(len(memory.plans), np.nan)
        old = np.empty_like(memory.ways)
        for age, (t, plan, ego) in enumerate(reversed(memory.plans)):
            inside = sample_plan(plan, ego, frame.t - t, prediction.WAYPOINT_STEP, old)
            m = min(inside, memory.inside)
            scores[age] = prediction.plan_agreement(memory.ways[:m], old[:m])
        memory.plans.append((frame.t, frame.plan, frame.ego))
        score = prediction.weighted_history(scores, self.settings.history_decay)
        memory.path_scores.append(score)
        return score

    def _validate_motion(self, i: int, frame: ChannelFrame, out: Readings) -> None:
        memory, settings = self.memory[i], self.settings
        if memory.frames and memory.frames[-1].t == frame.t:
            memory.frames.pop()
        then = self._frame_to_validate(memory, frame.t)
        memory.frames.append(frame)
        if then is None:
            return
        n = len(then.objects)
        expected, inside = np.empty((n, 1, 2)), np.empty(n, np.int64)
        sample_predictions(
            then.objects,
            then.predictions,
            then.prediction_t,
            frame.t - then.t,
            0.0,
            expected,
            inside,
        )
        followed, missed, left = prediction.follow_up(
            expected[:, 0], inside, then.ids, frame.objects, frame.ids,
            settings.match_tolerance, settings.pairing_distance,
        )  # fmt: skip
        judged = followed + missed + (0 if settings.form is Form.CORRECTED else left)
        if judged:
            out.channel[CHANNEL_ROW[Indicator.MOTION_VALIDATION], i] = followed / judged
        out.channel[CHANNEL_ROW[Indicator.OBJECTS_LEFT], i] = left

    def _frame_to_validate(self, memory: _Channel, t: float) -> ChannelFrame | None:
        """The channel's frame whose predictions are due: the previous one, or that of 1 s ago."""
        if not memory.frames:
            return None
        delay = self.settings.validation_delay
        if delay == 0.0:
            return memory.frames[-1]
        nearest = min(memory.frames, key=lambda frame: abs(frame.t - (t - delay)))
        return nearest if abs(nearest.t - (t - delay)) <= 0.06 else None

    def _cross_paths(
        self, p: int, a: int, b: int, frames: Sequence[ChannelFrame | None], row: Floats
    ) -> None:
        pairs = self.object_pairs[p]
        if frames[a] is None or frames[b] is None or pairs is None:
            self.cross_scores[p].append(np.nan)
            return
        one, other, settings = self.memory[a], self.memory[b], self.settings
        row[PAIR_ROW[Indicator.OBJECT_TRAJECTORY]] = prediction.object_trajectory_similarity(
            one.object_ways, one.object_inside, other.object_ways, other.object_inside,
            pairs, settings.decay,
        )  # fmt: skip
        m = min(one.inside, other.inside)
        row[PAIR_ROW[Indicator.EGO_TRAJECTORY]] = prediction.trajectory_similarity(
            one.ways[:m], other.ways[:m], settings.decay
        )
        score = prediction.cross_channel_agreement(one.ways[:m], other.ways[:m])
        row[PAIR_ROW[Indicator.CROSS_PATH]] = score
        self.cross_scores[p].append(score)
        row[PAIR_ROW[Indicator.CROSS_PATH_VARIANCE]] = similarity.sample_variance(
            np.array(self.cross_scores[p])
        )


def _nearest(
    history: Sequence[tuple[float, ...]] | deque[tuple[float, ...]], t: float
) -> tuple[float, ...] | None:
    """The entry of `history` (time first, in order) at `t`, or None when none is within 0.06 s."""
    lo, hi = 0, len(history)
    while lo < hi:
        mid = (lo + hi) // 2
        if history[mid][0] < t - 0.06:
            lo = mid + 1
        else:
            hi = mid
    best = [
        e
        for e in (history[k] for k in range(lo, min(lo + 2, len(history))))
        if abs(e[0] - t) <= 0.06
    ]
    return min(best, key=lambda e: abs(e[0] - t), default=None)
