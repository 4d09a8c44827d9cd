"""Which measurement counts, and for how long a lost one is held (A-085 to A-102).

All durations are counts of ticks, so nothing here depends on the pace of the machine (A-099).
"""

from __future__ import annotations

from typing import NamedTuple

from skidpad.core.settings.stack import RadarCloseCheck
from skidpad.core.vocabulary import DetectionStatus
from skidpad.stack.perception.radar import RadarReading
from skidpad.stack.timing import ticks_to_reach, ticks_within

CONFIRM_AFTER = 0.067  # s of vision
HOLD_SHORT = 0.17  # s
HOLD_FOLLOWING = 1.0  # s
HOLD_STOPPING = 1.5  # s
FOLLOWING_FORGOTTEN = 5.0  # s
RADAR_ALONE_ABOVE = 22.0  # m
SAFETY_DISTANCE = 30.0  # m
SAFETY_HOLD = 5.0  # s
VALID_BELOW = 80.0  # m


class Detection(NamedTuple):
    """The lead of a tick; distance None: no target."""

    status: DetectionStatus
    distance: float | None


NOTHING_DETECTED = Detection(DetectionStatus.NO_TARGET, None)


class Persistence:
    """Vision first, then its memory, then the radar."""

    def __init__(
        self,
        dt: float,
        gate: float,
        close_check: RadarCloseCheck,
        safety_persist: bool,
        rejected_stays_active: bool,
    ) -> None:
        self.gate, self.close_check = gate, close_check
        self.safety_persist, self.rejected_stays_active = safety_persist, rejected_stays_active
        self.confirm_ticks = ticks_to_reach(CONFIRM_AFTER, dt)
        self.hold_short = ticks_within(HOLD_SHORT, dt)
        self.hold_following = ticks_within(HOLD_FOLLOWING, dt)
        self.hold_stopping = ticks_within(HOLD_STOPPING, dt)
        self.forget_ticks = ticks_within(FOLLOWING_FORGOTTEN, dt)
        self.safety_ticks = ticks_to_reach(SAFETY_HOLD, dt)
        self.reset()

    def reset(self) -> None:
        """Resets the counters and the memory to no target."""
        self.seen_ticks = 0
        self.missed_ticks = 0
        self.last_distance: float | None = None
        self.was_following = False
        self.was_stopping = False

    @property
    def is_confirmed(self) -> bool:
        """Whether vision has seen the target for long enough (A-073, A-088)."""
        return self.seen_ticks >= self.confirm_ticks

    def update(self, fused: float | None, bumper: float | None, radar: RadarReading) -> Detection:
        """Returns the detection of this tick and remembers it; call it once per tick.

        fused: after the median; bumper: the unfused tier (D-028); m, None: no target.
        """
        detection = self._detect(fused, bumper, radar)
        if detection.distance is None and self._safety_holds():
            detection = Detection(DetectionStatus.SAFETY_PERSIST, self.last_distance)
        if detection.distance is not None and detection.distance < VALID_BELOW:
            self.last_distance = detection.distance
        return detection

    def conclude(self, detected: bool, acc_on: bool, stopping: bool) -> None:
        """Takes what the tick came to, for the memory of the next one (A-097, A-098)."""
        if detected and acc_on:
            self.was_following = True
        elif self.missed_ticks > self.forget_ticks:
            self.was_following = False
        self.was_stopping = stopping

    def _detect(self, fused: float | None, bumper: float | None, radar: RadarReading) -> Detection:
        """Returns the detection of this tick: fused, held for some ticks, or by radar alone; counts ticks."""
        if fused is not None and fused < self.gate:
            self.seen_ticks += 1
            self.missed_ticks = 0
            if self.is_confirmed:
                return Detection(DetectionStatus.FUSION_DETECT, fused)
            return self._radar_active(radar)
        self.missed_ticks += 1
        if self.missed_ticks <= self._window() and self.is_confirmed:
            return Detection(DetectionStatus.FUSION_PERSIST, self.last_distance)
        self.seen_ticks = 0
        return self._radar_fallback(bumper, radar)

    def _window(self) -> int:
        """Returns how many ticks a missed detection is held, by what the ego was doing."""
        if self.was_stopping:
            return self.hold_stopping
        return self.hold_following if self.was_following else self.hold_short

    def _radar_active(self, radar: RadarReading) -> Detection:
        """Returns the detection by radar alone; its distance is None for a rejected point that counts."""
        if radar.lane is not None:
            return Detection(DetectionStatus.RADAR_ACTIVE, radar.lane)
        if radar.pre is not None and self.rejected_stays_active:
            return Detection(DetectionStatus.RADAR_ACTIVE, None)
        return NOTHING_DETECTED

    def _radar_fallback(self, bumper: float | None, radar: RadarReading) -> Detection:
        """Returns the detection by radar after a loss; a near one needs the bumper camera, if so set."""
        near = radar.lane is not None and radar.lane <= RADAR_ALONE_ABOVE
        if near and self.close_check is RadarCloseCheck.BUMPER:
            if bumper is None or bumper >= RADAR_ALONE_ABOVE:
                return NOTHING_DETECTED
            self.missed_ticks = 0
        return self._radar_active(radar)

    def _safety_holds(self) -> bool:
        """Returns whether a close lead that was followed is held beyond the usual window."""
        return (
            self.safety_persist
            and self.was_following
            and self.last_distance is not None
            and self.last_distance < SAFETY_DISTANCE
            and self.missed_ticks < self.safety_ticks
        )
