"""Which measurement counts, and for how long a lost one is held (A-085 to A-102).

All durations are counts of ticks, so nothing here depends on the pace of the machine (A-099).
"""

from __future__ import annotations

from math import isnan, nan
from typing import NamedTuple

from skidpad.core.kernels.jit import kernel
from skidpad.core.settings.stack import RadarCloseCheck, StackSettings
from skidpad.core.vocabulary import DetectionStatus
from skidpad.stack.memory import Record
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


NO_TARGET, FUSION_DETECT, FUSION_PERSIST, RADAR_ACTIVE, SAFETY_PERSIST = map(int, DetectionStatus)


class Detection(NamedTuple):
    """The lead of a tick; distance in m, NaN: no target."""

    status: int  # DetectionStatus
    distance: float


NOTHING_DETECTED = Detection(NO_TARGET, nan)


class DetectionRules(NamedTuple):
    """What counts as detected, and for how many ticks a lost target is held."""

    gate: float  # m, farther fused distances count as none
    needs_bumper: bool  # a near radar target needs the bumper camera (D-025)
    safety_persist: bool  # a close lead is held longer (D-023)
    rejected_stays_active: bool  # a radar target off the lane still counts (D-035)
    confirm_ticks: int
    hold_short: int
    hold_following: int
    hold_stopping: int
    forget_ticks: int
    safety_ticks: int


def detection_rules(settings: StackSettings, dt: float) -> DetectionRules:
    """Returns the rules of detection; dt: s, one tick."""
    return DetectionRules(
        gate=settings.detection_gate,
        needs_bumper=settings.radar_close_check is RadarCloseCheck.BUMPER,
        safety_persist=settings.safety_persist,
        rejected_stays_active=settings.rejected_stays_active,
        confirm_ticks=ticks_to_reach(CONFIRM_AFTER, dt),
        hold_short=ticks_within(HOLD_SHORT, dt),
        hold_following=ticks_within(HOLD_FOLLOWING, dt),
        hold_stopping=ticks_within(HOLD_STOPPING, dt),
        forget_ticks=ticks_within(FOLLOWING_FORGOTTEN, dt),
        safety_ticks=ticks_to_reach(SAFETY_HOLD, dt),
    )


@kernel
def forget_detections(m: Record) -> None:
    """Resets the counters and the memory of detections to no target."""
    m.seen_ticks = m.missed_ticks = 0
    m.last_distance = nan
    m.was_following = m.was_stopping = False


@kernel
def is_confirmed(m: Record, rules: DetectionRules) -> bool:
    """Returns whether vision has seen the target for long enough (A-073, A-088)."""
    return bool(m.seen_ticks >= rules.confirm_ticks)


@kernel
def detect(
    m: Record, rules: DetectionRules, fused: float, bumper: float, radar: RadarReading
) -> Detection:
    """Returns the detection of this tick and remembers it (A-096); call it once per tick.

    fused: after the median; bumper: the unfused tier (D-028).
    """
    detection = _detect(m, rules, fused, bumper, radar)
    if isnan(detection.distance) and _safety_holds(m, rules):
        detection = Detection(SAFETY_PERSIST, m.last_distance)
    if detection.distance < VALID_BELOW:
        m.last_distance = detection.distance
    return detection


@kernel
def conclude(
    m: Record, rules: DetectionRules, detected: bool, acc_on: bool, stopping: bool
) -> None:
    """Takes what the tick came to, for the memory of the next one (A-097, A-098)."""
    if detected and acc_on:
        m.was_following = True
    elif m.missed_ticks > rules.forget_ticks:
        m.was_following = False
    m.was_stopping = stopping


@kernel
def _detect(
    m: Record, rules: DetectionRules, fused: float, bumper: float, radar: RadarReading
) -> Detection:
    """Returns the detection of this tick: fused, held for some ticks, or by radar alone; counts ticks."""
    if fused < rules.gate:
        m.seen_ticks += 1
        m.missed_ticks = 0
        if is_confirmed(m, rules):
            return Detection(FUSION_DETECT, fused)
        return _radar_active(rules, radar)
    m.missed_ticks += 1
    if m.missed_ticks <= _window(m, rules) and is_confirmed(m, rules):
        return Detection(FUSION_PERSIST, m.last_distance)
    m.seen_ticks = 0
    # after a loss a near radar target needs the bumper camera, if so set
    if radar.lane <= RADAR_ALONE_ABOVE and rules.needs_bumper:
        if not bumper < RADAR_ALONE_ABOVE:
            return NOTHING_DETECTED
        m.missed_ticks = 0
    return _radar_active(rules, radar)


@kernel
def _window(m: Record, rules: DetectionRules) -> int:
    """Returns how many ticks a missed detection is held, by what the ego was doing (A-091)."""
    if m.was_stopping:
        return rules.hold_stopping
    return rules.hold_following if m.was_following else rules.hold_short


@kernel
def _radar_active(rules: DetectionRules, radar: RadarReading) -> Detection:
    """Returns the detection by radar alone; its distance is NaN for a rejected point that counts."""
    if not isnan(radar.lane):
        return Detection(RADAR_ACTIVE, radar.lane)
    if not isnan(radar.pre) and rules.rejected_stays_active:
        return Detection(RADAR_ACTIVE, nan)
    return NOTHING_DETECTED


@kernel
def _safety_holds(m: Record, rules: DetectionRules) -> bool:
    """Returns whether a close lead that was followed is held beyond the usual window (A-095)."""
    return bool(
        rules.safety_persist
        and m.was_following
        and m.last_distance < SAFETY_DISTANCE
        and m.missed_ticks < rules.safety_ticks
    )
