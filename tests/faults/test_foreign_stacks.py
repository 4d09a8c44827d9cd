"""Whatever a foreign stack does is the outcome of its own run, and of no other (item 3)."""

import os
from pathlib import Path

import msgspec
import pytest

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells.matrix import cross
from skidpad.campaign.recipes.matrix import RECIPE
from skidpad.campaign.runs.run import run
from skidpad.campaign.workers.pool import local, run_jobs
from skidpad.campaign.workers.worker import Job
from skidpad.core.errors import ConfigError
from skidpad.core.run import StackDriver
from skidpad.core.vocabulary import Outcome
from skidpad.recording.campaign.ledger import read_ledger
from skidpad.recording.campaign.matrix import MatrixEntry
from skidpad.roads.bundled import load_map
from skidpad.stack.loading import load_stack
from support import runs
from support.faults import stacks
from support.faults.waiting import waited

HERE = Path(stacks.__file__)


def driven_by(kind, options=None, **changes):
    driver = StackDriver(f"{HERE}:{kind}", options or {}, name=kind)
    return runs.adas_run(driver=driver, duration=0.5, vehicles=0, **changes)


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("Exiting", "raised in tick 0: SystemExit(7)"),
        ("RaisingUnprintable", "raised in tick 0: <Unprintable>"),
        ("Surrogates", r"\ud800 half a letter"),
        ("Chatty", "raised in tick 0: ValueError('xxx"),
        ("Wordy", "throttle must be between 0 and 1, got '1' in tick 0"),
        ("Unsure", "handbrake must be true or false, got 'perhaps' in tick 0"),
        ("RaisingReport", "report raised in tick 0: OSError('no report')"),
        ("WordyReport", "report.distance must be a number or None, got 'far' in tick 0"),
        ("HugeReport", "report.radar_points must be a number or None, got 1099511627776"),
    ],
)
def test_what_a_stack_does_wrong_is_said_in_a_sentence_that_can_be_stored(kind, says):
    driven = run(driven_by(kind))
    assert driven.outcome is Outcome.AGENT_ERROR
    assert says in driven.error.strip().rpartition("\n")[2]
    assert len(driven.error.encode()) < 50_000
    msgspec.json.encode(driven.error)


def test_ctrl_c_remains_the_users():
    with pytest.raises(KeyboardInterrupt):
        run(driven_by("Interrupting"))


CAMPAIGN = (  # forks first, so that what they leave behind would meet the others
    "Forking",
    "ForkingAtStart",
    "Stack",
    "Exiting",
    "Chatty",
    "Interrupting",
    "ExitingHard",
)


def test_in_a_campaign_every_run_is_told_once_and_none_falls_on_another(tmp_path):
    drivers = [StackDriver(f"{HERE}:{kind}", name=kind) for kind in CAMPAIGN]
    template = driven_by("Stack")
    tasks = cross(drivers, [template.weather], 1, template)
    alone = run(template).log
    Campaign(RECIPE, tasks).run(tmp_path / "out", local(2))
    entries = read_ledger(tmp_path / "out", MatrixEntry)
    assert sorted(e.run for e in entries) == sorted(t.name for t in tasks)
    outcomes = {kind: {e.key.outcome for e in entries if e.key.config == kind} for kind in CAMPAIGN}
    assert outcomes == {
        "Stack": {"completed"},
        "Forking": {"completed"},
        "ForkingAtStart": {"completed"},
        "Exiting": {"agent_error"},
        "ExitingHard": {"crashed"},
        "Interrupting": {"crashed"},
        "Chatty": {"agent_error"},
    }
    # a fork changes nothing of what is recorded
    hashes = {(e.key.seed, e.key.log_hash) for e in entries if e.key.outcome == "completed"}
    assert len(hashes) == len({seed for seed, _ in hashes})
    assert len(alone) == 10
    assert (tmp_path / "out" / "ledger.jsonl").stat().st_size < 100_000


def gone(pid):
    """Whether a process has ended, also if nobody has asked for its end."""
    try:
        status = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return True
    return status.rsplit(")", 1)[1].split()[0] in "ZX"


def drive_quietly(spec):
    return run(spec).outcome


def test_a_child_that_keeps_the_pipe_open_delays_nobody_and_is_ended(tmp_path):
    pid = tmp_path / "pid"
    spec = driven_by("LeavingAChild", {"pid": str(pid)})
    (done,) = run_jobs([Job("a", drive_quietly, spec, 3600.0)], 1)
    assert done.failure is Outcome.CRASHED
    assert "exit code 3" in done.detail
    assert waited(lambda: gone(int(pid.read_text())))


def test_a_stack_that_goes_elsewhere_moves_no_output(tmp_path, monkeypatch):
    home, elsewhere = tmp_path / "home", tmp_path / "elsewhere"
    home.mkdir()
    elsewhere.mkdir()
    monkeypatch.chdir(home)
    spec = driven_by("Wandering", {"elsewhere": str(elsewhere)})
    Campaign(RECIPE, [spec]).run(Path("out"), local(1))
    run(spec, folder=Path("here"))
    assert Path.cwd() == home
    assert [p.name for p in elsewhere.iterdir()] == ["mine.txt"]
    assert {p.name for p in (home / "out" / "runs" / spec.name).iterdir()} >= {"ticks.parquet"}


def test_importing_a_stack_may_neither_exit_nor_wander(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exiting, moving = tmp_path / "exiting.py", tmp_path / "moving.py"
    exiting.write_text("import sys\nsys.exit(7)\n")
    moving.write_text("import os\nos.chdir('/')\nclass S:\n    def tick(self, frame): pass\n")
    with pytest.raises(ConfigError, match=r"cannot be imported: SystemExit\(7\)"):
        load_stack(f"{exiting}:S")
    assert load_stack(f"{moving}:S").__name__ == "S"
    assert Path.cwd() == tmp_path


@pytest.mark.parametrize(
    ("table", "column"),
    [("arrays", "sample"), ("samples", "x"), ("lanes", "length"), ("signals", "x")],
)
def test_a_stack_sees_the_map_and_cannot_change_it(table, column):
    shared = getattr(getattr(load_map("figure8"), table), column)
    before = shared.copy()
    driven = run(driven_by("Vandal", {"table": table, "column": column}))
    assert "read-only" in driven.error
    assert (shared == before).all()
    assert shared.flags.writeable


def test_what_a_stack_does_to_its_settings_is_forgotten():
    spec = driven_by("Meddler", {"nested": []})
    assert run(spec).outcome is Outcome.COMPLETED
    assert spec.driver.options == {"nested": []}


def test_environment_of_this_test_is_left_alone():
    assert os.getcwd() == str(Path.cwd())
