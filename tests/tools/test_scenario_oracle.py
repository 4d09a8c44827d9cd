"""How long esmini may run when references are recorded, and ours beside it."""

from __future__ import annotations

import subprocess
from time import monotonic

import pytest

import scenario_oracle as oracle
from support.scenarios.files import event, private, speed, story, time, to, write

DEAF = ["sh", "-c", "trap '' INT; exec sleep 60"]  # goes on when it is interrupted


def test_a_player_that_goes_on_when_interrupted_is_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(oracle, "WALL_MAX", 1.0)
    begin = monotonic()
    with pytest.raises(subprocess.TimeoutExpired):
        oracle._run_until_recorded(DEAF, tmp_path / "record.dat")
    assert monotonic() - begin < 40.0


def test_what_has_no_stop_trigger_goes_on_when_its_acts_are_over(tmp_path):
    """ "If no trigger is defined, the Storyboard will be never stopped" (class Storyboard)."""
    slow = event("slow", private(speed(to(5), "step", 0)), time(1.0))
    file = write(tmp_path, stories=story(slow), stop="")
    assert oracle.play_without_controllers(file, 4.0).rows[-1].time == pytest.approx(4.0)
