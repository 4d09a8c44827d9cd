"""The generator of load: what it sends is what was asked for, and what it lost it says."""

from __future__ import annotations

import pytest

pytest.importorskip("fastapi", reason="skidpad[fleet] is not installed")

from fleet_load import HEADER, failed, record
from skidpad.fleet.batch import hazards_of
from skidpad.fleet.words import Limits


def test_records_have_the_size_that_was_asked_for_and_differ():
    for size in (1000, 20_000):
        some = [record(k, size) for k in range(130)]
        assert {len(one) for one in some} == {size}
        text = HEADER.encode() + b"\n" + b"".join(some)
        found = hazards_of(text, Limits())
        assert len({one.digest for one in found}) == 130
        assert {one.size for one in found} == {size}


def test_what_was_lost_or_came_too_late_fails():
    good = {
        "seconds": 605.0, "planned_s": 600.0, "acknowledged_not_stored": 0,
        "stored_not_acknowledged": 0, "not_acknowledged": 0, "bodies_damaged": 0,
    }  # fmt: skip
    assert not failed(good)
    assert not failed(good | {"planned_s": 0.0, "seconds": 1e6})  # no pace was asked for
    assert failed(good | {"seconds": 700.0})
    for name in set(good) - {"seconds", "planned_s"}:
        assert failed(good | {name: 1}), name
