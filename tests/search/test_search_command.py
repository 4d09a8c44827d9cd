"""`skidpad search`: finds a real failure, says how it is avoided, resumes, repeats, and refuses in words."""

import shutil

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import InputError, OutputError
from skidpad.recording.campaign.searches import (
    CHOICES,
    TRIALS,
    distinct_failures,
    failure_folder,
    read_findings,
    read_search,
    read_trials,
)
from skidpad.recording.files import write_bytes
from skidpad.recording.run.log_files import log_hash, read_log
from skidpad.search.space import apply_values
from support.report_page import read_page

CALL = (
    "ghost_cut_in", "--vary", "GhostS=25:45", "--vary", "GhostSpeed=17:21", "--vary", "MergeDistance=5:8",
    "--stack", "4", "--budget", "40", "--workers", "1", "--duration", "12",
)  # fmt: skip


def search(*call):
    return CliRunner().invoke(app, ["search", *map(str, call)], catch_exceptions=False)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    out = tmp_path_factory.mktemp("search") / "out"
    done = search(*CALL, "--out", out)
    assert done.exit_code == 0, done.output
    return out, done.stdout


def test_the_answer_counts_what_the_trials_say(found):
    out, text = found
    trials = read_trials(out)
    assert [t.number for t in trials] == list(range(40))
    failing = [t for t in trials if t.is_failure]
    assert failing, "the ranges were chosen so that some fail"
    assert text.startswith(
        f"{len(failing)} failures of our stack (acc, lca, limiter, resume, tla) in 40"
    )
    assert f"the first in run {failing[0].number + 1}." in text
    avoided = [t for t in distinct_failures(trials) if t.is_avoidable]
    assert f"{len(avoided)} of the {len({t.motion for t in failing})} that differ" in text
    reference = sum(t.is_avoided_by_reference for t in distinct_failures(trials))
    bound = sum(t.bound != "" for t in distinct_failures(trials))
    assert (
        f"reference driver avoids {reference}, braking or steering from the same state {bound}"
        in text
    )
    assert len(avoided) >= max(reference, bound) > 0
    page = read_page(out / "report.html")
    assert text.splitlines()[0] in page


def test_failures_are_contacts_above_5_kmh_and_others_are_none(found):
    trials = read_trials(found[0])
    assert {trial.is_failure for trial in trials} == {True, False}
    for trial in trials:
        hard = trial.contact_kmh is not None and trial.contact_kmh > 5.0
        assert trial.is_failure == (hard or trial.departed_s is not None)


def test_the_border_lies_between_two_runs_that_were_driven(found):
    out, _ = found
    space, groups = read_search(out).space, read_findings(out).groups
    assert groups
    for group in groups:
        assert group.failing.is_failure
        assert not group.harmless.is_failure
        gap = np.abs(np.subtract(group.failing.unit, group.harmless.unit))
        assert (gap <= 1.0 / 2**7 + 1e-9).all()
        names = [c.name for c in group.changes]
        assert names == [
            n for n in space.names if group.failing.values[n] != group.harmless.values[n]
        ]


def test_a_kept_failure_is_the_drive_of_its_trial(found):
    from skidpad.campaign.runs.run import run
    from skidpad.recording.run.motion import motion_hash

    out, _ = found
    first = read_findings(out).groups[0].failures[0]
    log = read_log(failure_folder(out, first.number))
    assert motion_hash(log) == first.motion
    spec = apply_values(read_search(out).template, first.values)
    assert log_hash(run(spec).log) == log_hash(log)


def test_failures_are_a_file_that_play_reads(found):
    from skidpad.scenarios.reading.distributions import choices

    out, _ = found
    kept = [t for g in read_findings(out).groups for t in g.failures]
    read = choices(out / CHOICES)
    assert [{k: float(v) for k, v in c.parameters.items()} for c in read] == [
        t.values for t in kept
    ]


def test_a_search_that_was_cut_off_ends_as_one_that_was_not(found, tmp_path):
    out, text = found
    cut = tmp_path / "cut"
    shutil.copytree(
        out, cut, ignore=shutil.ignore_patterns("failures", "found.json", "report.html")
    )
    whole = (out / TRIALS).read_bytes()
    write_bytes(cut / TRIALS, whole[: len(whole) // 2])  # in the middle of a line
    with pytest.raises(OutputError, match="give --resume"):
        search(*CALL, "--out", cut)
    assert (cut / TRIALS).read_bytes() == whole[: len(whole) // 2]
    done = search(*CALL, "--out", cut, "--resume")
    assert done.stdout.replace(str(cut), str(out)) == text
    assert (cut / TRIALS).read_bytes() == whole


@pytest.mark.parametrize(
    ("call", "complaint"),
    [
        (["--vary", "Nothing=1:2"], "declares no parameter 'Nothing'"),
        (["--vary", "GhostS=2:1"], "the range 2:1 is empty"),
        (["--vary", "GhostS=1:2", "--method", "luck"], "unknown --method 'luck'"),
        (["--vary", "GhostS=1:2", "--objective", "fun"], "unknown --objective 'fun'"),
        (["--vary", "GhostS=1:2", "--weather", "clear-noon,snow"], "a search has one weather"),
        ([], "nothing varies"),
    ],
)
def test_wrong_words_are_refused_in_a_sentence_and_leave_nothing(call, complaint, tmp_path):
    out = tmp_path / "out"
    with pytest.raises(InputError) as caught:
        search("ghost_cut_in", *call, "--out", out)
    assert complaint in str(caught.value)
    assert not out.exists()
