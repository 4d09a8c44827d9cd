"""Which extras are asked for, and how an answer is told."""

from __future__ import annotations

import re
from subprocess import CompletedProcess

import pytest

import extras_check
from extras_check import ROOT, describe, extras_of, files_that_ask

TEXT = extras_check.PROJECT.read_text(encoding="utf-8")


def test_every_extra_is_asked_for_with_all_that_it_names():
    tomllib = pytest.importorskip("tomllib", reason="Python 3.10 has no tomllib")
    extras = tomllib.loads(TEXT)["project"]["optional-dependencies"]
    assert list(extras_of(TEXT)) == list(extras)
    for name, requirements in extras.items():
        assert len(extras_of(TEXT)[name]) == len(requirements), name
    assert extras_of(TEXT)["carla"] == ["msgpack", "carla"]


def test_the_page_has_a_row_for_each_extra_and_says_why_a_part_is_left_out():
    page = (ROOT / "docs" / "benchmarks.md").read_text(encoding="utf-8")
    section = page.split("## Which extras install on which Python\n")[1].split("\n## ")[0]
    rows = dict(re.findall(r"^\| `?(\w+)`? \| (.*) \|$", section, re.MULTILINE))
    assert list(rows) == ["extra", "none", *extras_of(TEXT)]
    for part in re.findall(r"without ([\w-]+)", " ".join(rows.values())):
        assert f"* `{part}` " in section


@pytest.mark.parametrize(
    ("done", "cell"),
    [
        (CompletedProcess([], 0, "A_b==1\nmsgpack==1.1\n", ""), "2, without carla"),
        (CompletedProcess([], 0, "carla==0.9.16\nmsgpack==1.1\n", ""), "2"),
        (CompletedProcess([], 1, "", "no wheel\n  of carla\n"), "**no**: no wheel of carla"),
    ],
)
def test_a_cell_says_how_many_what_is_left_out_or_why_not(done, cell):
    assert describe(done, ["msgpack", "carla"]) == cell


def test_an_unknown_extra_is_refused(capsys):
    assert extras_check.main(["colour"]) == 2
    assert "colour" in capsys.readouterr().err


def test_tests_of_an_extra_are_those_that_name_what_it_brings(tmp_path):
    (tmp_path / "test_a.py").write_text('optuna = pytest.importorskip("optuna")\n')
    (tmp_path / "test_b.py").write_text("    from optuna.trial import Trial\n")
    (tmp_path / "test_c.py").write_text("import optunable\nassert 'optuna'\n")
    assert files_that_ask(["optuna"], tmp_path) == [str(tmp_path / f"test_{k}.py") for k in "ab"]
    assert files_that_ask([], tmp_path) == []
