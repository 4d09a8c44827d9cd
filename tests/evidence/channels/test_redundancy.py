"""Drivers are compared on the seeds that all of them have driven (decision C-9)."""

import pytest

from skidpad.evidence.channels.redundancy import compare_drivers, differences
from skidpad.recording.channels.drives import DriveOutcome


def outcome(drive_by: str, seed: int, collisions: int) -> DriveOutcome:
    return DriveOutcome(
        route="route-1", seed=seed, drive_by=drive_by, driven_s=360.0, distance_m=2000.0,
        collisions=collisions, collisions_struck=0, red_lights_run=0, stalls=0, ended="time",
        switches=0, minimal_risk_s=0.0, driving_s={},
    )  # fmt: skip


@pytest.mark.req("C-093", "C-096")
def test_only_shared_seeds_count():
    runs = [outcome("arbiter", s, 0) for s in range(10)]
    runs += [outcome("lav_like", s, 1) for s in range(5, 15)]
    arbiter, alone = compare_drivers(runs)
    assert (arbiter.drive_by, arbiter.segments, alone.segments) == ("arbiter", 5, 5)
    assert alone.hours == pytest.approx(0.5)
    assert alone.rates["collisions"].rate == pytest.approx(10.0)
    assert arbiter.rates["collisions"].events == 0
    assert arbiter.rates["collisions"].interval is None
    assert arbiter.rates["collisions"].most_runs == pytest.approx(1.0 - 0.05 ** (1 / 5))


def test_a_channel_alone_is_compared_on_the_seeds_of_the_arbiter():
    runs = [outcome("arbiter", s, s % 2) for s in range(8)]
    runs += [outcome("lav_like", s, 2 + s % 2) for s in range(4, 12)]
    found = {(d.drive_by, d.event): d.pairs for d in differences(runs)}
    assert found["lav_like", "collisions"].mean == 2.0
    assert found["lav_like", "collisions"].n == 4
    assert found["lav_like", "stalls"].mean == 0.0
    assert differences(runs[:8]) == []
