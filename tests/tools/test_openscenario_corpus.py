"""Other people's files are counted as they are: good, refused, broken, copied, or without their road."""

from __future__ import annotations

import sys

import pytest

import openscenario_corpus as corpus
from support.scenarios.files import event as happens
from support.scenarios.files import private, speed, story, time, to, write

GOOD = {"end": 2.0}
REFUSED = {"stories": story(happens("e", private(speed(to(4))), time(1.0)), actor="nobody")}
ROADLESS = {"road": '<LogicFile filepath="away.xodr"/>'}


@pytest.fixture
def told(tmp_path, monkeypatch, capsys):
    """The table of folders with these files, by author, and all that was printed."""

    def tell(authors, *arguments):
        for author, files in authors.items():
            for name, parts in files.items():
                (tmp_path / author / name).mkdir(parents=True)
                if isinstance(parts, dict):
                    write(tmp_path / author / name, **parts)
                else:
                    (tmp_path / author / name / "x.xosc").write_text(parts)
        words = ["corpus", str(tmp_path), "--ticks", "20", *arguments]
        monkeypatch.setattr(sys, "argv", words)
        corpus.main()
        said = capsys.readouterr().out
        lines = (line.split(" | ") for line in said.splitlines() if line.startswith("| "))
        head, *rows = ([cell.strip("| ") for cell in line] for line in lines)
        return {row[0]: dict(zip(head[1:], row[1:], strict=False)) for row in rows}, said

    return tell


def counts(row):
    return {name: int(row[name]) for name in corpus.COLUMNS if int(row[name])}


def test_good_refused_and_broken_files_are_told_apart(told):
    files = {"good": GOOD, "refused": REFUSED, "broken": "<OpenSCENARIO"}
    rows, said = told({"one": files}, "--list")
    assert counts(rows["one"]) == {
        "files": 3, "others": 1, "scenarios": 2, "valid": 2, "clean": 1, "played": 1,
    }  # fmt: skip
    assert counts(rows["all"]) == counts(rows["one"])
    assert "played of valid: 50.0%" in said
    assert "one/broken/x.xosc: " in said
    assert "'nobody'" in said
    assert said.count("    1  ") == 1, "one reason, without the name"


def test_each_author_weighs_the_same_and_a_copy_counts_once(told):
    bad = REFUSED | {"end": 3.0}
    rows, said = told(
        {"a": {"1": GOOD, "2": REFUSED, "3": bad}, "b": {"1": GOOD, "2": {"end": 4.0}}}
    )
    assert counts(rows["b"])["copies"] == 1
    assert (rows["all"]["valid"], rows["all"]["played"]) == ("4", "2")
    assert "each of 2 authors weighing the same: 66.7%" in said


def test_without_its_road_or_against_the_schema_a_file_is_not_valid(told):
    """What the schema refuses is played all the same where its meaning is clear: one more."""
    odd = {"init": '<Private entityRef="ego"><Oddity/></Private>'}
    rows, _ = told({"a": {"road": ROADLESS, "odd": odd, "good": GOOD}})
    assert counts(rows["a"]) == {
        "files": 3, "scenarios": 3, "invalid": 1, "lacking": 1, "valid": 1, "clean": 1, "played": 1,
        "more": 1,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("raised", "column"), [(corpus.SkidpadError("no"), "refused"), (KeyError("x"), "tracebacks")]
)
def test_what_fails_while_it_is_played_has_its_own_column(told, monkeypatch, raised, column):
    def fail(*_):
        raise raised

    monkeypatch.setattr(corpus, "play_ideal", fail)
    rows, _ = told({"a": {"good": GOOD}})
    assert counts(rows["a"])[column] == 1
    assert rows["a"]["played"] == "0"


def test_files_may_be_left_out_by_their_names(told):
    rows, said = told({"a": {"good": GOOD}}, "--without", "x.xo")
    assert counts(rows["a"]) == {"files": 1, "excluded": 1}
    assert "no file is valid" in said
