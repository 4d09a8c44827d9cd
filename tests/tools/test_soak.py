"""The long drives on a small scale: what is done stays done, what goes wrong is seen."""

from __future__ import annotations

import sys

import pytest

import dated_lines
import soak_server
import soak_worker
from soak_server import Leg

LINE = {
    "seed": 1, "leg": 0, "ok": True, "server": 1, "memory_mb": 200.0, "done": 100, "hung": False,
    "woken": 0, "slowest_s": 0.1,
}  # fmt: skip


def test_verdict_needs_every_leg_and_steady_memory():
    legs = [Leg(1, 0, 100, 5, "town", "")]
    good, said = soak_server.verdict(legs, [LINE])
    assert good
    assert said.startswith("100 ticks, 0.00 h")
    assert not soak_server.verdict([*legs, Leg(1, 1, 100, 5, "town", "")], [LINE])[0]
    assert not soak_server.verdict(legs, [LINE, LINE | {"hung": True, "ok": False}])[0]
    grown = [LINE | {"memory_mb": mb} for mb in (200.0, 210.0, 220.0, 400.0)]
    assert not soak_server.verdict(legs, grown)[0]


def test_a_client_that_says_nothing_hangs():
    program = soak_server.Spoken([sys.executable, "-c", "import time; time.sleep(600)"])
    with pytest.raises(soak_server.queue.Empty):
        program.line(0.2)
    program.end()
    told = soak_server.Told()
    assert told.hear("TICKS 200 50 0.25\n")
    assert not told.hear("terminate called\n")
    assert (told.done, told.spawned, told.said) == (200, 50, "terminate called")


def test_runs_in_one_worker(tmp_path, capsys):
    assert soak_worker.soak(2, tmp_path) == []
    assert "2 runs in one worker" in capsys.readouterr().out
    assert [line["runs"] for line in dated_lines.read(tmp_path / "worker.jsonl")] == [1, 2]


@pytest.mark.slow
def test_two_legs_in_one_server(tmp_path):
    pytest.importorskip("carla")
    legs = [Leg(1, 0, 60, 5, "figure8", "car"), Leg(1, 1, 60, 5, "motorway", "")]
    file = tmp_path / "server.jsonl"
    soak_server.soak(legs, file, None)
    lines = dated_lines.read(file)
    assert soak_server.verdict(legs, lines)[0], lines
    assert {line["map"] for line in lines} == {"figure8", "motorway"}
    assert len({line["server"] for line in lines}) == 1
    soak_server.soak(legs, file, None)
    assert len(dated_lines.read(file)) == 2
