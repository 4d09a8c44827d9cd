"""Drives are one drive when poses, contacts and applied commands are equal (decision T-3)."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from skidpad.core.states import ContactEvent, StackReport, TrafficContact
from skidpad.core.vocabulary import DetectionStatus
from skidpad.recording.run.events import Notice, NoticeSource
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import log_hash
from skidpad.recording.run.motion import motion_hash
from support.makelog import drive

TOUCH = ContactEvent(4, 1, "", 900.0, 3.0, 10.0, 0.0)


def some_log() -> RunLog:
    report = StackReport(status=DetectionStatus.FUSION_DETECT, detected=True, distance=30.0, hsv=1)
    return drive(
        8,
        lambda k: [{"x": 1.0 * k, "vx": 20.0}, {"x": 30.0 + k, "vx": 20.0}],
        report=lambda _k: report,
        contacts=[TOUCH],
    )


def test_what_sensors_and_stack_said_makes_no_other_drive() -> None:
    before, after = some_log(), some_log()
    after.report.hsv[:] = np.nan
    after.report.distance[3] += 1.0
    after.mu[:] *= 0.5
    notice = Notice(3, NoticeSource.STACK, "red light")
    after = dataclasses.replace(after, events=(*after.events, notice))
    assert log_hash(before) != log_hash(after)
    assert motion_hash(before) == motion_hash(after)


def shift(field: str, actor: int) -> Callable[[RunLog], RunLog]:
    def change(log: RunLog) -> RunLog:
        getattr(log.actors, field)[5, actor] += np.float32(0.001)
        return log

    return change


def gone(log: RunLog) -> RunLog:
    log.present[6, 1] = False
    return log


def braked(log: RunLog) -> RunLog:
    log.applied.brake[2] += 1e-9
    return log


def harder(log: RunLog) -> RunLog:
    return dataclasses.replace(log, events=(dataclasses.replace(TOUCH, impulse=901.0),))


def touched_another(log: RunLog) -> RunLog:
    return dataclasses.replace(log, events=(*log.events, TrafficContact(5, 1, -1, 2.0)))


def later(log: RunLog) -> RunLog:
    return dataclasses.replace(log, tick=log.tick + 1)


def other_road(log: RunLog) -> RunLog:
    return dataclasses.replace(log, header=dataclasses.replace(log.header, map_hash="other"))


@pytest.mark.parametrize(
    "change",
    [
        *(shift(field, actor) for field in ("x", "y", "z", "yaw") for actor in (0, 1)),
        gone,
        braked,
        harder,
        touched_another,
        later,
        other_road,
    ],
)
def test_any_change_of_the_motion_makes_another_drive(change: Callable[[RunLog], RunLog]) -> None:
    assert motion_hash(change(some_log())) != motion_hash(some_log())


def test_where_an_absent_actor_was_left_does_not_matter() -> None:
    before, after = gone(some_log()), gone(some_log())
    after.actors.x[6, 1] = 500.0
    assert motion_hash(before) == motion_hash(after)
