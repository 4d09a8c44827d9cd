"""A campaign from end to end: equal bytes, nothing lost, one sentence for wrong input."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import polars as pl
import pytest
from msgspec.structs import replace
from typer.testing import CliRunner

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.matrix import cross, published_drivers
from skidpad.campaign.recipes.matrix import RECIPE, warm_up
from skidpad.campaign.workers.pool import local
from skidpad.cli.main import app
from skidpad.core.errors import InputError, OutputError
from skidpad.core.run import StackDriver
from skidpad.physics.presets import find_weather
from skidpad.recording.campaign.ledger import LEDGER
from skidpad.recording.campaign.results import read_results
from support.runs import adas_run

ROOT = Path(__file__).resolve().parents[2]
CALL = [sys.executable, "-m", "skidpad", "adas", "--sensors", "objects", "--duration", "6"]
CELLS = ["--configs", "1,4", "--weather", "clear-noon,rain-night", "--seeds", "2"]


def run_command(call):
    return subprocess.run(
        call, check=False, env=environment(), capture_output=True, text=True, timeout=900
    )


def run(cells, out, workers=1, **how):
    return Campaign(RECIPE, cells).run(out, local(workers, warm_up), **how)


def environment():
    return {**os.environ, "PYTHONPATH": str(ROOT / "src")}


def cells(duration=4.0, weather=("clear-noon", "rain-night"), numbers="1,4"):
    template = adas_run(0, duration=duration)
    return cross(published_drivers(numbers), [find_weather(w) for w in weather], 1, template)


@pytest.mark.req("X-1", "X-12")
def test_one_and_two_workers_give_the_same_content(tmp_path):
    one = run(cells(), tmp_path / "one")
    two = run(cells(), tmp_path / "two", workers=2, csv=True)
    assert one.content_hash == two.content_hash
    assert (tmp_path / "two" / "results.csv").exists()
    assert one.runs == 4
    assert one.failed == 0


@pytest.mark.req("A-257", "A-260")
def test_an_interrupted_campaign_resumes_to_the_same_content(tmp_path):
    whole, part = tmp_path / "whole", tmp_path / "part"
    subprocess.run([*CALL, *CELLS, "--out", str(whole)], check=True, env=environment(), timeout=900)
    call = [*CALL, *CELLS, "--workers", "1", "--out", str(part)]
    parent = subprocess.Popen(call, env=environment(), stderr=subprocess.DEVNULL)
    ledger = part / LEDGER
    deadline = time.monotonic() + 900.0
    while not (ledger.exists() and b"\n" in ledger.read_bytes()):
        assert time.monotonic() < deadline
        time.sleep(0.05)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    done = len(ledger.read_bytes().splitlines())
    again = run_command(call)
    assert again.returncode == 2
    assert "--resume" in again.stderr
    subprocess.run([*call, "--resume"], check=True, env=environment(), timeout=900)
    assert len(ledger.read_bytes().splitlines()) >= 8 > done
    assert read_results(part).equals(read_results(whole))
    assert (part / "report.html").exists()


def test_a_stack_that_kills_its_worker_costs_its_own_runs_only(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT / "tests"), str(ROOT / "src")]))
    monkeypatch.syspath_prepend(str(ROOT / "tests"))
    (good,) = cells(numbers="1", weather=("clear-noon",))
    bad = replace(good, driver=StackDriver("support.jobs:Suicide", name="bad"))
    summary = run([bad, good], tmp_path)
    results = read_results(tmp_path)
    assert summary.failed == 1
    outcome = dict(results.select("config", "outcome").iter_rows())
    assert outcome == {"bad": "crashed", "1": "completed"}
    assert results.filter(pl.col("config") == "bad")["fatal_collisions"].to_list() == [None]


@pytest.mark.req("L-7")
def test_a_stack_that_raises_is_an_outcome_with_its_traceback(tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(ROOT / "tests"), str(ROOT / "src")]))
    monkeypatch.syspath_prepend(str(ROOT / "tests"))
    (good,) = cells(numbers="1", weather=("clear-noon",))
    bad = [
        replace(good, driver=StackDriver(f"support.jobs:{name}", name=name))
        for name in ("Raising", "Speechless")
    ]
    run(bad, tmp_path)
    assert read_results(tmp_path)["outcome"].to_list() == ["agent_error"] * 2
    raised, silent = sorted((tmp_path / "runs").glob("*/error.txt"))
    assert "ZeroDivisionError" in raised.read_text()
    assert "must return a VehicleCommand" in silent.read_text()


def test_a_folder_with_something_else_is_never_touched(tmp_path):
    (tmp_path / "thesis.txt").write_text("years of work")
    with pytest.raises(OutputError, match="choose another --out"):
        run(cells(), tmp_path)
    assert [p.name for p in tmp_path.iterdir()] == ["thesis.txt"]


BAD = {
    "configuration": (["--configs", "7"], "7"),
    "weather": (["--weather", "clear-none"], "clear-none"),
    "weather file": (["--weather", "nowhere.yaml"], "nowhere.yaml"),
    "profile": (["--profile", "best"], "best"),
    "setting": (["--set", "colour=red"], "colour"),
    "value": (["--set", "mu_ref=9"], "mu_ref"),
    "map": (["--map", "moon"], "moon"),
    "function": (["--functions", "acc,fly"], "fly"),
    "stack": (["--stack", "no.such:Thing"], "no.such"),
    "two drivers": (["--configs", "1", "--stack", "a:B"], "--stack"),
    "sweep": (["--sweep", "wetness=0:200:50"], "wetness"),
    "vehicles": (["--vehicles", "500"], "500"),
    "duration": (["--duration", "0"], "0"),
    "sensors": (["--sensors", "eyes"], "eyes"),
    "traffic": (["--traffic", "rush"], "rush"),
}


@pytest.mark.parametrize(("options", "named"), BAD.values(), ids=BAD)
def test_wrong_input_is_named_and_nothing_is_written(tmp_path, options, named):
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["adas", "--out", str(out), *options])
    assert isinstance(done.exception, InputError)
    assert named in str(done.exception)
    assert "\n" not in str(done.exception)
    assert not out.exists()


def test_wrong_input_ends_with_one_sentence_and_exit_code_2(tmp_path):
    call = [sys.executable, "-m", "skidpad", "adas", "--out", str(tmp_path / "o")]
    done = run_command([*call, "--weather", "hail"])
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith("skidpad: ")


def test_a_map_that_cannot_hold_the_traffic_is_refused(tmp_path):
    path = tmp_path / "short.xodr"
    path.write_text("<notOpenDrive/>")
    done = CliRunner().invoke(app, ["adas", "--out", str(tmp_path / "o"), "--map", str(path)])
    assert isinstance(done.exception, InputError)
    assert "short.xodr" in str(done.exception)
