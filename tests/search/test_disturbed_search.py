"""`skidpad search --disturb` and `skidpad risk --disturb`: another driver varies while the ego goes on."""

from __future__ import annotations

import numpy as np
import pytest
from msgspec import structs
from typer.testing import CliRunner

import skidpad
from skidpad.campaign.runs.run import run as drive
from skidpad.campaign.runs.stored import read_run
from skidpad.campaign.workers.pool import keep_workers
from skidpad.campaign.workers.worker import Finished
from skidpad.cli.main import app
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.maths.space import Space
from skidpad.core.run import run_from_plain
from skidpad.core.traffic.disturbance import SOURCE, actor_of_draw
from skidpad.recording.campaign.risks import SPLITTING, Risk, read_risk_found
from skidpad.recording.campaign.searches import (
    CHOICES,
    failure_folder,
    read_findings,
    read_search,
    read_trials,
)
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.roads.bundled import load_map
from skidpad.search import branching
from skidpad.search.branching import Drives, SplitTask, split_drives
from skidpad.search.margin import NO_CONFLICT, approach, closeness
from skidpad.search.risk import split_all
from skidpad.search.space import disturbance_variables
from skidpad.search.splitting import split_paths, splitting_estimate

CALL = (
    "lead_slowdown", "--stack", "0", "--param", "TriggerDistance=10000", "--disturb", "lead=accel(0.6,2)",
    "--duration", "6", "--workers", "1",
)  # fmt: skip


def call(command, *words):
    return CliRunner().invoke(app, [command, *map(str, words)], catch_exceptions=False)


def ask(lead_s, per_level, **more):
    """Returns a question in which an ego at constant speed follows a lead that is disturbed for 6 s."""
    spec = skidpad.Scenario(
        "lead_slowdown", stack=0, disturb=("lead=accel(0.6,2)",), duration=6.0,
        parameters={"TriggerDistance": 10000, "LeadS": lead_s},
    ).spec  # fmt: skip
    return Risk(
        run=spec.to_plain(), space=Space(disturbance_variables(spec)), per_hour=None,
        per_100km=None, repetitions=2, per_level=per_level, samples=100, seed=1, **more,
    )  # fmt: skip


@pytest.fixture(scope="module")
def searched(tmp_path_factory):
    out = tmp_path_factory.mktemp("search") / "out"
    done = call(
        "search",
        *CALL,
        "--param",
        "LeadS=110",
        "--method",
        "random",
        "--budget",
        "20",
        "--out",
        out,
    )
    assert done.exit_code == 0, done.output
    return out


def test_the_draws_are_what_a_search_varies(searched):
    space = read_search(searched).space
    assert space.names == tuple(f"disturb.lead.{k}" for k in range(6))
    assert all(actor_of_draw(name) == "lead" for name in space.names)
    trials = read_trials(searched)
    assert len({t.motion for t in trials}) == len(trials), "each draw is another drive"
    for trial in trials:
        z = np.array(list(trial.values.values()))
        assert space.likelihood(trial.values) == pytest.approx(np.exp(-0.5 * np.sum(z**2)))


def test_a_kept_failure_is_a_run_that_drives_alike(searched):
    groups = read_findings(searched).groups
    assert groups, "the gap was chosen so that some fail"
    failures = groups[0].failures
    size = [sum(z**2 for z in t.values.values()) for t in failures]
    assert size == sorted(size), "the likeliest comes first"
    folder = failure_folder(searched, failures[0].number)
    stored = read_run(folder)
    assert stored.course.draws == {"lead": tuple(failures[0].values.values())}
    assert log_hash(drive(stored).log) == log_hash(read_log(folder))
    assert not (searched / CHOICES).exists(), "no parameter varies"


def test_measured_sizes_have_a_source_and_chosen_ones_are_assumptions(tmp_path):
    plain = ask(110, 4)
    assert plain.assumptions == ["disturbance of lead"]
    assert plain.disturbed_actors == ("lead",)
    spec = skidpad.Scenario("lead_slowdown", disturb=("lead=accel",), duration=3.5).spec
    variables = disturbance_variables(spec)
    assert len(variables) == 4
    assert {v.source for v in variables} == {SOURCE}


def test_a_draw_cannot_be_varied_by_hand(tmp_path):
    with pytest.raises(ConfigError, match="disturbances are given by --disturb ACTOR=accel"):
        call("search", *CALL, "--vary", "disturb.lead.0=0:1", "--out", tmp_path / "out")


def test_the_level_of_a_drive_ends_at_its_margin_and_never_rises():
    plain, checked = ask(118, 4).run, 0
    for seed in range(1, 7):
        driven = drive(run_from_plain(plain | {"seed": seed}, "test"))
        near = closeness(driven.log, load_map(driven.road), driven.off_road, "combined")
        levels = approach(driven.log, driven.off_road)
        assert (np.diff(levels) <= 0.0).all()
        if near.margin > 1.0:
            assert levels[-1] == pytest.approx(near.margin)
            checked += 1
        else:
            assert levels[-1] == 1.0
    assert checked


def test_a_branch_is_the_drive_that_it_left_until_its_level_and_another_one_then():
    drives = Drives(ask(112, 4), 0)
    path = min((drives.begin(k) for k in range(6)), key=lambda p: p.score)
    below = float(np.quantile(path.levels, 0.4))
    row = int(np.argmax(path.levels < below))
    one, other, again = (drives.branch(path, below, name) for name in ("a", "b", "a"))
    drives.close()
    for branch in (one, other):
        assert (branch.places[: row + 1] == path.places[: row + 1]).all()
        assert (branch.levels[: row + 1] == path.levels[: row + 1]).all()
    assert (one.levels == again.levels).all()
    assert np.abs(one.places[-1] - other.places[-1]).max() > 0.01
    assert len(drives.apart) == 3
    assert all(apart[0] == 0.0 for apart in drives.apart)


def test_a_drive_without_a_tick_is_a_fault_far_from_any_failure(tmp_path, monkeypatch):
    (tmp_path / "failing.py").write_text(
        "class Failing:\n"
        "    def __init__(self, specs, map, settings):\n        pass\n"
        "    def tick(self, frame):\n        raise ValueError('not today')\n"
    )
    plain = ask(112, 4)
    driver = {**plain.run, "driver": {"type": "stack", "where": f"{tmp_path}/failing.py:Failing"}}
    drives = Drives(structs.replace(plain, run=driver), 0)
    path = drives.begin(0)
    assert (path.score, path.kind, len(path.levels)) == (NO_CONFLICT, "", 0)
    found = split_drives(SplitTask(structs.replace(plain, run=driver), 0))
    assert (found.p, found.faults, found.runs) == (0.0, 4, 4)

    def refuse(template, values):
        raise FileError("LeadS leaves the road")

    monkeypatch.setattr(branching, "apply_values", refuse)
    assert split_drives(SplitTask(plain, 0)).faults == 4


def test_workers_change_nothing_and_what_was_cut_off_goes_on(tmp_path):
    asked, told = ask(114, 6), []

    def drive_here(jobs):
        for job in jobs:
            told.append(job.key)
            yield Finished(job, job.work(job.argument))

    here = split_all(asked, tmp_path, drive_here, lambda runs: None)
    with keep_workers(2) as runner:
        (tmp_path / "two").mkdir()
        assert split_all(asked, tmp_path / "two", runner, lambda runs: None) == here
    whole = (tmp_path / SPLITTING).read_bytes()
    (tmp_path / SPLITTING).write_bytes(whole[:-5])  # in the middle of the second line
    assert split_all(asked, tmp_path, drive_here, lambda runs: None) == here
    assert (tmp_path / SPLITTING).read_bytes() == whole
    assert told == ["splitting 0", "splitting 1", "splitting 1"]


def test_the_page_shows_how_branches_diverge_and_what_they_stem_from(tmp_path):
    out = tmp_path / "out"
    done = call(
        "risk", *CALL, "--param", "LeadS=110", "--repetitions", "2", "--per-level", "50",
        "--samples", "100", "--out", out,
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    found = read_risk_found(out)
    methods = [e.method for e in found.probabilities]
    assert methods == ["counting", "subset simulation", "splitting"]
    assert found.p == pytest.approx(np.mean([r.p for r in found.splitting]))
    assert sum(found.kinds.values()) == pytest.approx(1.0)
    assert all(1 <= r.ancestors <= r.failing for r in found.splitting)
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "s since the branch" in page
    assert "repetitions of splitting" in page
    assert "disturbance of lead" in page
    assert "disturb.lead.3" not in page


# of BRUTE independent drives FAILED did: `python tests/search/test_disturbed_search.py`, 2026-11-26
BRUTE, FAILED = 600, 13


def test_splitting_finds_the_probability_that_brute_force_finds():
    asked, ps, runs = ask(118, 40), [], 0
    for repetition in range(10):
        drives = Drives(asked, repetition)
        found = split_paths(drives, 40, np.random.default_rng(repetition), 1.0)
        drives.close()
        ps.append(found.p)
        runs += found.paths
    estimate, truth = splitting_estimate(ps, runs), FAILED / BRUTE
    error = np.sqrt(truth * (1.0 - truth) / BRUTE)
    assert estimate.low <= truth + 2.0 * error
    assert estimate.high >= truth - 2.0 * error
    assert estimate.half_width < 2.0


def count_failures(drives):
    """Returns how many of so many independent drives of the test above fail."""
    plain, failed = ask(118, 30).run, 0
    for seed in range(1, drives + 1):
        driven = drive(run_from_plain(plain | {"seed": seed}, "test"))
        near = closeness(driven.log, load_map(driven.road), driven.off_road, "combined")
        failed += near.margin <= 0.0
    return failed


if __name__ == "__main__":
    print(count_failures(600))
