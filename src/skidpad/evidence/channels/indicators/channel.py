"""The indicators of one channel by itself, and what they remember of it (C-040 to C-047, C-075, C-078)."""

from __future__ import annotations

from bisect import bisect_left
from collections import deque
from collections.abc import Mapping
from itertools import islice, takewhile
from typing import Any, TypeVar

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.channels import ChannelFrame
from skidpad.evidence.channels.choices import Form
from skidpad.evidence.channels.frames import Usable
from skidpad.evidence.channels.indicators import comfort, prediction, similarity
from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.indicators.settings import IndicatorSettings
from skidpad.evidence.channels.paths import sample_plan, sample_predictions

Values = Mapping[Indicator, float]
GAP_MAX = 0.35  # s, a longer silence of a channel forgets its history
JERK_SPAN = 1.0  # s between two fitted accelerations
SAME_CYCLE = 0.06  # s, a little more than half a cycle
FIT_SPAN = comfort.FIT_WINDOW + 1e-6  # s
NAN = float("nan")
Entry = TypeVar("Entry", bound=tuple[Any, ...])  # its first item is a time in s


class ChannelIndicators:
    """One channel, cycle by cycle: `begin`, and where it speaks `comfort` and `prediction`."""

    def __init__(self, settings: IndicatorSettings) -> None:
        self.settings = settings
        self.frame: ChannelFrame | None = None  # of this cycle
        self.reported = 0  # objects in its message
        self.areas: Floats = np.empty(0)  # m^2, of its objects
        self.ways: Floats = np.empty((prediction.WAYPOINTS, 2))  # its plan, sampled
        self.inside = 0  # way-points within the plan's duration
        self.object_ways: Floats = np.empty((0, prediction.WAYPOINTS, 2))
        self.object_inside: Ints = np.empty(0, np.int64)
        self._poses: deque[tuple[float, float, float, float]] = deque(maxlen=32)
        self._fits: deque[tuple[float, float]] = deque(maxlen=32)  # t, acceleration along
        self._plans: deque[tuple[float, Floats, Floats]] = deque(maxlen=settings.plan_history)
        self._frames: deque[ChannelFrame] = deque(maxlen=16)
        self._path_scores: deque[float] = deque(maxlen=similarity.VARIANCE_WINDOW)

    def begin(self, usable: Usable | None) -> None:
        """Takes in the cycle's message; None: the channel said nothing.

        All that is remembered is dropped at a message more than GAP_MAX s after the last, or before it.
        """
        self.frame = None if usable is None else usable.frame
        if usable is None:
            self._path_scores.clear()
            return
        self.reported = usable.reported
        self.areas = similarity.polygon_areas(usable.frame.polygons, usable.frame.polygon_size)
        if self._frames and not 0.0 <= usable.frame.t - self._frames[-1].t <= GAP_MAX:
            for memory in (
                self._poses, self._fits, self._plans, self._frames, self._path_scores,
            ):  # fmt: skip
                memory.clear()

    def comfort(self, frame: ChannelFrame) -> Values:
        """Returns comfort of the driven and of the planned path; to be called once per frame."""
        printed = self.settings.form is Form.PRINTED
        return {
            Indicator.HISTORY_COMFORT: self._history_comfort(frame),
            Indicator.PLANNED_PATH_COMFORT: comfort.planned_path_comfort(
                frame.plan, frame.ego, self.settings.steepness, printed
            ),
        }

    def _history_comfort(self, frame: ChannelFrame) -> float:
        """Returns the comfort of the path driven up to the frame; nan with too few points."""
        settings = self.settings
        x, y, heading = frame.ego[:3].tolist()
        drop_repeat(self._poses, frame.t)
        self._poses.append((frame.t, x, y, heading))
        table = np.array(self._poses)
        if settings.form is Form.CORRECTED:
            return self._fitted_comfort(frame.t, table[table[:, 0] >= frame.t - FIT_SPAN])
        if len(table) < settings.history_points:
            return NAN
        times, xs, ys, headings = np.ascontiguousarray(table[-settings.history_points :].T)
        printed = settings.form is Form.PRINTED
        return comfort.path_comfort(times, xs, ys, headings, settings.steepness, printed)

    def _fitted_comfort(self, t: float, poses: Floats) -> float:
        """Returns comfort from accelerations fitted to `poses` (k, 4) now and a second ago; nan without both.

        poses: rows of t, x, y, heading.
        """
        times, x, y, heading = np.ascontiguousarray(poses.T)
        along, across = comfort.fitted_acceleration(times, x, y, float(heading[len(heading) // 2]))
        drop_repeat(self._fits, t)
        self._fits.append((t, along))
        earlier = nearest(self._fits, t - JERK_SPAN)
        if earlier is None:
            return NAN
        jerk = (along - earlier[1]) / (t - earlier[0])
        return comfort.comfort_score(along, across, jerk, self.settings.steepness, False)

    def prediction(self, frame: ChannelFrame) -> Values:
        """Returns the indicators of the plan against earlier ones and of predictions against what happened.

        Keeps the sampled plan and predictions for the indicators of pairs.
        """
        n, step = len(frame.objects), prediction.WAYPOINT_STEP
        self.inside = sample_plan(frame.plan, frame.ego, 0.0, step, self.ways)
        self.object_ways = np.empty((n, prediction.WAYPOINTS, 2))
        self.object_inside = np.empty(n, np.int64)
        sample_predictions(
            frame.objects, frame.predictions, frame.prediction_t, 0.0, step,
            self.object_ways, self.object_inside,
        )  # fmt: skip
        score = self._path_agreement(frame)
        self._path_scores.append(score)
        full = len(self._path_scores) == similarity.VARIANCE_WINDOW
        return {
            Indicator.CHANNEL_PATH: score,
            Indicator.CHANNEL_PATH_VARIANCE: (
                similarity.sample_variance(np.array(self._path_scores)) if full else NAN
            ),
            **self._motion_validation(frame),
        }

    def _path_agreement(self, frame: ChannelFrame) -> float:
        """Returns the agreement of the plan with past ones, weighted by age; nan without any. Keeps it."""
        drop_repeat(self._plans, frame.t)
        scores = np.full(len(self._plans), np.nan)
        old = np.empty_like(self.ways)
        for age, (t, plan, ego) in enumerate(reversed(self._plans)):
            inside = sample_plan(plan, ego, frame.t - t, prediction.WAYPOINT_STEP, old)
            m = min(inside, self.inside)
            scores[age] = prediction.plan_agreement(self.ways[:m], old[:m])
        self._plans.append((frame.t, frame.plan, frame.ego))
        return prediction.weighted_history(scores, self.settings.history_decay)

    def _motion_validation(self, frame: ChannelFrame) -> Values:
        """Returns how well an earlier frame's predictions held in this one; empty where none is due."""
        drop_repeat(self._frames, frame.t)
        then = self._frame_to_validate(frame.t)
        self._frames.append(frame)
        if then is None:
            return {}
        settings, n = self.settings, len(then.objects)
        expected, inside = np.empty((n, 1, 2)), np.empty(n, np.int64)
        sample_predictions(
            then.objects, then.predictions, then.prediction_t, frame.t - then.t, 0.0,
            expected, inside,
        )  # fmt: skip
        followed, missed, left = prediction.follow_up(
            expected[:, 0], inside, then.ids, frame.objects, frame.ids,
            settings.match_tolerance, settings.pairing_distance,
        )  # fmt: skip
        judged = followed + missed + (0 if settings.form is Form.CORRECTED else left)
        return {
            Indicator.MOTION_VALIDATION: followed / judged if judged else NAN,
            Indicator.OBJECTS_LEFT: left,
        }

    def _frame_to_validate(self, t: float) -> ChannelFrame | None:
        """Returns the frame whose predictions are due: the previous, or that of 1 s ago; None without."""
        delay = self.settings.validation_delay
        if delay == 0.0:
            return self._frames[-1] if self._frames else None
        return nearest(self._frames, t - delay)


def drop_repeat(history: deque[Entry], t: float) -> None:
    """Removes the newest entry if it is of `t`, so that the same message in two cycles counts once."""
    if history and history[-1][0] == t:
        history.pop()


def nearest(history: deque[Entry], t: float) -> Entry | None:
    """Returns the entry of `history` that is nearest to `t` s; None where none is within SAME_CYCLE.

    history: in order of time.
    """
    first = bisect_left(history, t - SAME_CYCLE, key=lambda entry: float(entry[0]))
    there = takewhile(lambda e: e[0] <= t + SAME_CYCLE, islice(history, first, None))
    return min(there, key=lambda entry: abs(entry[0] - t), default=None)
