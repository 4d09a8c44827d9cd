"""Contacts among background vehicles, and those that may be owed to the ego."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from skidpad.core.states import ContactEvent, TrafficContact
from skidpad.evidence.drive.background import UNSEEN, background
from skidpad.recording.run.events import MovedOn, PutBack, RolledOver
from skidpad.recording.run.log import RunLog
from support import makelog

TICKS = 1000  # 50 s


def log_of(*events: Any) -> RunLog:
    """The ego and two cars at 20 m/s: 1 km each, 2 km of background."""
    rows = [{"vx": 20.0}, {"vx": 20.0}, {"vx": 20.0}]
    return replace(makelog.drive(TICKS, lambda _k: rows), events=events)


def metrics_of(log: RunLog) -> Any:
    drive = SimpleNamespace(log=log, row=lambda tick: tick)
    return background(cast("Any", drive), np.ones(TICKS, dtype=np.bool_))


def test_contacts_soon_after_one_of_the_ego_are_counted_apart() -> None:
    own = ContactEvent(100, 1, "", 1000.0, 5.0, 0.0, 0.0)
    others = [TrafficContact(tick, 1, 2, 3.0) for tick in (99, 100, 499, 501)]
    found = metrics_of(
        log_of(
            own,
            *others,
            TrafficContact(300, 1, -1, 3.0),
            PutBack(700, 2),
            MovedOn(800, 1),
            RolledOver(600, 2),
            RolledOver(650, 0),
        )
    )
    assert (found.traffic_contacts, found.traffic_contacts_after_ego) == (2, 2)
    assert (found.traffic_put_back, found.traffic_moved) == (1, 1)
    assert found.traffic_roll_overs == 1
    assert found.traffic_km == pytest.approx(2.0, rel=2e-3)
    assert found.traffic_contacts_per_100_km == pytest.approx(100.0, rel=2e-3)


def test_where_nobody_tells_there_is_nothing_to_say() -> None:
    log = log_of()
    unseen = replace(log, header=replace(log.header, about={"traffic": UNSEEN}))
    assert metrics_of(unseen).traffic_contacts is None
    assert metrics_of(log).traffic_contacts == 0
