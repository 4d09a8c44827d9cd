"""The commands on a CARLA server: the real client against our own server (issue 5, outcome a)."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from shutil import rmtree

import numpy as np
import polars as pl
import pytest

from skidpad.core.channels import ChannelFrame, TruthFrame
from skidpad.recording.channels.drives import read_outcomes
from skidpad.recording.channels.mcap_files import McapRecording
from skidpad.recording.run.log_files import read_log
from skidpad.recording.sources import recordings_below
from skidpad.scenarios.shipped import FOLDER
from skidpad.simulation.carla_server.process import ServerProcess
from support.carla_programs import environment

pytest.importorskip("carla")
Serve = Callable[..., ServerProcess]
LIMIT = 600.0  # s


def skidpad(out: Path, port: int, *words: str) -> str:
    """Run a command on the server; what it printed. The wheel hangs now and then: one more try."""
    carla = ("--out", str(out), "--backend", "carla", "--port", str(port))
    try:
        return run(*words, *carla)
    except subprocess.TimeoutExpired:
        rmtree(out, ignore_errors=True)
        return run(*words, *carla)


def run(*words: str) -> str:
    """A command in a process of its own, to its good end."""
    done = subprocess.run(
        [sys.executable, "-m", "skidpad", *words],
        capture_output=True,
        text=True,
        timeout=LIMIT,
        check=False,
        env=environment() | {"COLUMNS": "200"},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_play_moves_the_same_actors_on_both_backends(serve: Serve, tmp_path: Path) -> None:
    """The lead of the file slows down where and when it does in the embedded simulator."""
    file = str(FOLDER / "lead_slowdown.xosc")
    words = ("play", file, "--duration", "4", "--stack", "ideal", "--actors", "ideal")
    said = skidpad(tmp_path / "carla", serve("--mu-ref", "0.9").port, *words)
    assert "The run was not judged." in said
    run(*words, "--out", str(tmp_path / "here"))
    there, embedded = (read_log(tmp_path / name) for name in ("carla", "here"))
    assert len(there.t) == len(embedded.t) == 81  # ticks and the start
    for column in ("x", "y"):
        gap = getattr(there.actors, column) - getattr(embedded.actors, column)
        assert np.abs(gap).max() < 0.1
    assert there.actors.vx[-1, 1] < 0.8 * there.actors.vx[0, 1]  # it slows


@pytest.mark.slow
def test_grip_pairs_runs_on_carla(serve: Serve, tmp_path: Path) -> None:
    """One pair: on ice the ego needs a longer way to stop behind the lead."""
    skidpad(
        tmp_path / "out", serve("--weather-grip", "none", "--mu-ref", "0.9").port,
        "grip", "--scenarios", "lead_slowdown", "--weather", "icy_30", "--repeats", "1",
    )  # fmt: skip
    results = pl.read_parquet(tmp_path / "out" / "results.parquet").sort("friction")
    assert results["friction"].to_list() == ["original", "reduced"]
    dry, ice = results.iter_rows(named=True)
    assert dry["ratio"] == 1.0
    assert ice["ratio"] < 0.4
    assert ice["distance_m"] > dry["distance_m"] + 10.0  # to the stop behind the lead
    assert "crashed" not in results["outcome"].to_list()
    assert (tmp_path / "out" / "report.html").is_file()


@pytest.mark.slow
def test_channels_drive_records_on_carla(serve: Serve, tmp_path: Path) -> None:
    """Two channels see the server's actors and drive its ego for a quarter of a minute."""
    skidpad(
        tmp_path / "out", serve("--mu-ref", "0.9").port,
        "channels", "drive", "--route", "route-4", "--hours", "0.004",
    )  # fmt: skip
    (driven,) = read_outcomes([tmp_path / "out"])
    assert driven.driven_s == pytest.approx(14.4, abs=0.1)
    assert driven.distance_m > 10.0
    assert driven.collisions == 0
    (path,) = recordings_below(tmp_path / "out")
    recording = McapRecording(path)
    assert recording.channels == ("lav_like", "tfuse_like")
    items = [m.item for m in recording.messages()]
    truths = [i for i in items if isinstance(i, TruthFrame)]
    assert len(truths) == round(10.0 * driven.driven_s)  # 10 Hz
    assert any(len(i.objects) for i in items if isinstance(i, ChannelFrame))
