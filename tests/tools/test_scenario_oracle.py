"""How long esmini may run when references are recorded."""

from __future__ import annotations

import subprocess
import time

import pytest

import scenario_oracle as oracle

DEAF = ["sh", "-c", "trap '' INT; exec sleep 60"]  # goes on when it is interrupted


def test_a_player_that_goes_on_when_interrupted_is_killed(tmp_path, monkeypatch):
    monkeypatch.setattr(oracle, "WALL_MAX", 1.0)
    begin = time.monotonic()
    with pytest.raises(subprocess.TimeoutExpired):
        oracle._run_until_recorded(DEAF, tmp_path / "record.dat")
    assert time.monotonic() - begin < 40.0
