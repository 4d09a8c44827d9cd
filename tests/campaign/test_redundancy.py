"""Drivers are compared on the seeds that all of them have driven (decision C-9)."""

import pytest

from skidpad.campaign.channel_outcomes import DriveOutcome
from skidpad.campaign.redundancy import compare_drivers, read_outcomes
from skidpad.core.errors import FileError


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
    assert arbiter.rates["collisions"].interval.high > 0.0


def test_an_empty_folder_is_refused(tmp_path):
    (tmp_path / "other.json").write_text("{}")
    with pytest.raises(FileError, match="no driven segments"):
        read_outcomes([tmp_path])
