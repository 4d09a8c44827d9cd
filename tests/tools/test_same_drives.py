"""Random runs that two trees of the source drive alike, tick by tick."""

from __future__ import annotations

from typing import Any

import numpy as np
from msgspec import structs

import same_drives
from skidpad.campaign.runs.run import run
from skidpad.core.courses import Roads, Scenario

ROADS = next(k for k in range(100) if isinstance(same_drives.draw_run(k).course, Roads))


def record(**changes: Any) -> dict[str, Any]:
    base = {"k": 7, "ticks": [1, 2, 3], "events": ["contact"], "outcome": "completed"}
    return base | changes


def test_the_same_number_is_the_same_run_and_numbers_meet_roads_and_scenarios() -> None:
    runs = [same_drives.draw_run(k) for k in range(40)]
    assert runs == [same_drives.draw_run(k) for k in range(40)]
    assert {type(r.course) for r in runs} == {Roads, Scenario}
    assert {r.driver.label for r in runs} >= {"0", "1", "2", "3", "4"}


def test_one_bit_in_one_tick_is_found_there() -> None:
    spec = structs.replace(same_drives.draw_run(ROADS), duration=1.0)
    log = run(spec).log
    before = same_drives.sum_ticks(log)
    assert before == same_drives.sum_ticks(run(spec).log)
    log.actors.yaw[12, 0] = np.nextafter(log.actors.yaw[12, 0], np.float32(9.0))
    after = same_drives.sum_ticks(log)
    assert (
        same_drives.describe_difference(record(ticks=before), record(ticks=after))
        == "run 7 differs from tick 12 on"
    )


def test_events_outcome_and_length_count_too() -> None:
    describe = same_drives.describe_difference
    assert describe(record(), record()) == ""
    assert "3 ticks before and 2 after" in describe(record(), record(ticks=[1, 2]))
    assert "events" in describe(record(), record(events=[]))
    assert "outcome" in describe(record(), record(outcome="collision"))
