"""The share of lines that quick tests reach: counted by hand, in pieces, resumed."""

from __future__ import annotations

import csv
import json
import sqlite3
import sys
from contextlib import closing
from pathlib import Path

import pytest

import quick_share

QUICK = {"core/a.py": [1, 2], "__init__.py": [1]}
FULL = {"core/a.py": [2, 3, 4], "roads/b.py": [7], "cli/c.py": []}


def part(lines, seconds=1.0, commit="abc"):
    return {
        "commit": commit,
        "date": "2026-01-01",
        "passed": True,
        "seconds": seconds,
        "lines": lines,
    }


def test_a_package_has_the_lines_of_all_pieces():
    """Of core line 1 is reached by the quick tests alone; two pieces reach line 2 and it counts once."""
    measured = {
        "quick": [part(QUICK), part({"core/a.py": [2]}, 2.0)],
        "full": [part(FULL, 6.0), part({}, 4.0)],
    }
    rows = {row["of"]: row for row in quick_share.make_rows(measured)}
    assert {of: (row["quick"], row["full"], row["share"]) for of, row in rows.items()} == {
        "core": (2, 4, "0.500"), "roads": (0, 1, "0.000"), "skidpad": (1, 1, "1.000"),
        "all": (3, 10, "0.300"),
    }  # fmt: skip
    assert rows["core"]["commit"] == "abc"


def test_a_file_that_a_killed_process_left_unfinished_adds_no_line(tmp_path):
    """Its first table is there and empty. A copy of the package elsewhere adds none either."""
    coverage = pytest.importorskip(
        "coverage", reason="coverage.py is not installed: make check does"
    )
    module = quick_share.PACKAGE / "core" / "a.py"
    data = coverage.CoverageData(str(tmp_path / "data.whole"))
    data.add_lines({str(module): [3, 1], str(tmp_path / "skidpad" / "core" / "a.py"): [7]})
    data.write()
    with closing(sqlite3.connect(tmp_path / "data.killed")) as file:
        file.execute("create table coverage_schema (version integer)")
    assert quick_share.read_lines(tmp_path) == {"core/a.py": [1, 3]}


def test_every_test_file_is_in_one_piece():
    given = [
        quick_share.ROOT / path
        for p in quick_share.list_pieces()
        for path in quick_share.files_of(p)
    ]
    files = [f for path in given for f in (path.rglob("test_*.py") if path.is_dir() else [path])]
    assert sorted(files) == sorted(quick_share.TESTS.rglob("test_*.py"))


@pytest.fixture
def tool(tmp_path, monkeypatch):
    """The tool with two pieces; returns what was measured by each call."""
    monkeypatch.setattr(quick_share, "list_pieces", lambda: ["a", "b"])
    monkeypatch.setattr(quick_share, "TABLE", tmp_path / "table.csv")
    monkeypatch.setattr(quick_share, "commit", lambda: "abc")

    def call(*words: str) -> list[tuple[str, str]]:
        ran = []

        def measure(piece: str, suite: str):
            ran.append((piece, suite))
            return part(QUICK if suite == "quick" else FULL)

        monkeypatch.setattr(quick_share, "measure", measure)
        monkeypatch.setattr(sys, "argv", ["quick_share", "--out", str(tmp_path / "out"), *words])
        quick_share.main()
        return ran

    return call


def test_pieces_are_run_once_and_the_table_is_written_with_the_last(tool, tmp_path, capsys):
    assert tool("--only", "b") == [("b", "quick"), ("b", "full")]
    assert "1 of 2 pieces" in capsys.readouterr().out
    assert not (tmp_path / "table.csv").exists()
    assert tool() == [("a", "quick"), ("a", "full")]
    assert tool() == []
    with (tmp_path / "table.csv").open() as file:
        shares = {row["of"]: row["share"] for row in csv.DictReader(file)}
    assert shares == {"core": "0.500", "roads": "0.000", "skidpad": "1.000", "all": "1.000"}


def test_a_piece_of_another_commit_is_run_again(tool, tmp_path):
    tool("--only", "a")
    path = Path(tmp_path / "out" / "a-full.json")
    path.write_text(json.dumps(part(FULL, commit="older")))
    assert tool("--only", "a") == [("a", "full")]


def test_without_any_piece_it_says_so(tool):
    with pytest.raises(SystemExit, match="no piece was measured"):
        tool("--only")
