"""What all campaigns take and show: the same options, a line per cell, one sentence beforehand."""

from dataclasses import replace

import pytest
import typer
from typer.core import TyperOption
from typer.testing import CliRunner

from skidpad.campaign.workers.worker import Finished
from skidpad.cli.main import app
from skidpad.cli.options.campaigns import CampaignOptions, Estimate
from skidpad.core.errors import InputError, OutputError
from skidpad.core.vocabulary import Outcome
from support.toy_campaign import campaign

ROOT = typer.main.get_command(app)
CAMPAIGNS = {"adas": "adas", "grip": "grip", "channels drive": "channels", "play": "play"}
SHARED = {"out", "workers", "cluster", "until_halfwidth", "resume", "or_next", "csv", "plan"}
OF_FILES = {"check", "expect", "junit", "tree"}  # what is asked of scenarios costs no run
OF_ONE_FILE = {"checkpoints"}  # of `play`; the estimate is of a folder


def options(path):
    command = ROOT
    for name in path.split():
        command = command.commands[name]
    return {p.name: (p.help, tuple(p.opts)) for p in command.params if isinstance(p, TyperOption)}


@pytest.mark.parametrize("path", CAMPAIGNS)
def test_every_campaign_takes_the_same_options_and_can_be_estimated(path):
    taken = options(path)
    assert set(taken) >= SHARED
    alike = SHARED - {"out"} if path == "play" else SHARED
    assert {k: taken[k] for k in alike} == {k: options("grip")[k] for k in alike}
    estimated = options(f"campaign estimate {CAMPAIGNS[path]}")
    aside = OF_FILES | (OF_ONE_FILE if path == "play" else set())
    assert set(estimated) == set(taken) - SHARED - aside | {"workers"}


def test_the_terminal_shows_cells_as_they_end_and_then_the_report(tmp_path, capsys):
    how = CampaignOptions(out=tmp_path / "out", workers=1)
    summary = how(campaign(), lambda folder: f"report of {folder.name}")
    shown = capsys.readouterr()
    assert shown.out == "report of out\n"
    assert "even: 4 runs, 2 heads" in shown.err
    assert summary.runs == 8
    with pytest.raises(OutputError, match="--resume"):
        how(campaign(), str)
    again = CampaignOptions(out=tmp_path / "out", workers=1, resume=True)(campaign(), str)
    assert (again.driven, again.content_hash) == (0, summary.content_hash)
    assert "even: 4 runs, 2 heads" in capsys.readouterr().err


def test_where_no_run_has_a_result_the_command_fails_and_says_so(tmp_path, capsys, monkeypatch):
    def crash(jobs):
        for k, job in enumerate(jobs):
            if k < crashing:
                yield Finished(job, failure=Outcome.CRASHED, detail="gone")
            else:
                yield Finished(job, value=job.work(job.argument))

    monkeypatch.setattr("skidpad.campaign.workers.pool.local", lambda *_: crash)
    crashing = 8
    with pytest.raises(typer.Exit) as ended:
        CampaignOptions(out=tmp_path / "all", workers=1)(campaign(), lambda folder: "a report")
    assert ended.value.exit_code == 1
    shown = capsys.readouterr()
    assert shown.out == "a report\n", "the page says what crashed"
    assert "none of 8 runs has a result" in shown.err
    crashing = 7
    assert CampaignOptions(out=tmp_path / "most", workers=1)(campaign(), str).failed == 7


def test_another_campaign_goes_to_the_next_folder(tmp_path, capsys):
    out = tmp_path / "out"
    for n, wanted in ((4, "out"), (5, "out-2"), (5, "out-2")):
        how = CampaignOptions(out=out, workers=1, or_next=True, resume=True)
        assert how(campaign(n), str).folder.name == wanted


def test_an_estimate_is_one_sentence(capsys):
    Estimate(workers=3)(campaign(), str)
    told = capsys.readouterr().out
    assert told.startswith("8 runs at 0.00 s each (measured on 8) on 3 workers: about 0.0 min")
    assert told.count("\n") == 1


def test_a_plan_names_cells_and_runs_and_drives_nothing(tmp_path, capsys):
    with pytest.raises(typer.Exit) as ended:
        CampaignOptions(out=tmp_path / "out", plan=True)(campaign(), str)
    assert ended.value.exit_code == 0
    assert capsys.readouterr().out.splitlines() == [
        "sure: 4 runs, quick way: no, runs of this kind are driven tick by tick",
        "even: 4 runs, quick way: no, runs of this kind are driven tick by tick",
        "8 runs planned, nothing was driven",
    ]
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            "adas --sensors objects --configs 4,reference --weather rain-noon --seeds 2",
            [
                "4_rain-noon: 2 runs, quick way: yes",
                "reference_rain-noon: 2 runs, quick way: no, another stack drives",
                "4 runs planned, nothing was driven",
            ],
        ),
        (
            "grip --scenarios front_accident --weather icy_30 --seeds 3 --sensors pixels",
            ["quick way: no, its sensors are pixels, or a radar with noise"],
        ),
        ("play front_accident", ["1 run, quick way: yes"]),
    ],
)
def test_a_plan_says_which_runs_go_the_quick_way(words, told, tmp_path):
    out = tmp_path / "out"
    done = CliRunner().invoke(app, [*words.split(), "--plan", "--out", str(out)])
    assert done.exit_code == 0, done.output
    for line in told:
        assert line in done.output
    assert not out.exists()


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("play front_accident --seeds 3", "one file is one run"),
        ("play front_accident --grip none,physical", "one file is one run"),
        ("play {folder}/broken.xosc --weather rain-noon", "broken.xosc"),
        ("adas --weather rain-noon --seeds 2 --until-halfwidth 0.9", "--until-halfwidth"),
        (
            "adas --weather rain-noon --seeds 2 --until-halfwidth 0.1 --distinct",
            "exclude each other",
        ),
    ],
)
def test_a_plan_refuses_what_the_command_refuses(words, told, tmp_path):
    (tmp_path / "broken.xosc").write_text("<OpenSCENARIO>")
    asked = [*words.format(folder=tmp_path).split(), "--out", str(tmp_path / "out")]
    for more in ([], ["--plan"]):
        done = CliRunner().invoke(app, [*asked, *more])
        assert isinstance(done.exception, InputError), done.output
        assert told in str(done.exception)
    assert not (tmp_path / "out").exists()


def test_a_single_file_with_checkpoints_can_be_planned(tmp_path):
    words = [
        "play",
        "front_accident",
        "--checkpoints",
        "5",
        "--plan",
        "--out",
        str(tmp_path / "out"),
    ]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    assert "1 run planned, nothing was driven" in done.output


@pytest.mark.parametrize(
    ("distinct", "halfwidth", "total"),
    [
        (False, None, "8 runs planned"),
        (True, None, "at most 8 runs planned"),
        (False, 0.1, "at most 8 runs planned"),
    ],
)
def test_a_plan_of_what_may_end_early_gives_an_upper_limit(
    distinct, halfwidth, total, tmp_path, capsys
):
    how = CampaignOptions(out=tmp_path / "out", plan=True, until_halfwidth=halfwidth)
    with pytest.raises(typer.Exit):
        how(replace(campaign(), distinct=distinct), str)
    assert capsys.readouterr().out.splitlines()[-1] == f"{total}, nothing was driven"


def test_a_plan_names_stacks_that_cannot_begin_and_fails(tmp_path):
    code = tmp_path / "mine.py"
    code.write_text(
        "class NoWeights:\n"
        "    def __init__(self):\n"
        "        raise RuntimeError('no weights')\n"
        "    def tick(self, frame):\n"
        "        pass\n"
    )
    words = ["--sensors", "objects", "--weather", "rain-noon,clear-noon", "--seeds", "2", "--plan"]
    done = CliRunner().invoke(
        app, ["adas", "--stack", f"{code}:NoWeights", *words, "--out", str(tmp_path / "out")]
    )
    assert done.exit_code == 1, done.output
    assert done.output.count("2 runs, cannot be driven: ") == 2
    assert "could not be built" in done.output
    assert "quick way" not in done.output
