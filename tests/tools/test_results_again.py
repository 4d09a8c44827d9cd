"""`make results` says what moved; the main jobs of the Makefile are commands that skidpad knows."""

import shlex
import subprocess
import sys
from pathlib import Path

import polars as pl
import pytest
import typer

from skidpad.cli.main import app

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import campaigns  # noqa: E402
from moved import read_rows, what_moved  # noqa: E402

ROWS = pl.DataFrame(
    {
        "config": ["1", "1", "2"], "seed": [1, 2, 1], "map": ["m"] * 3, "outcome": ["completed"] * 3,
        "log_hash": ["a", "b", "c"], "fatal_collisions": [0, 2, 4],
        "mean_speed_kmh": [40.0, None, 30.0],
    }
)  # fmt: skip


def test_rows_that_moved_are_counted_and_means_are_told_from_the_largest_change_on():
    after = ROWS.with_columns(
        fatal_collisions=pl.Series([0, 2, 7]), mean_speed_kmh=pl.Series([40.0, None, 31.0])
    )
    assert what_moved(ROWS, after) == [
        "1 of 3 rows moved; 0 gone, 0 new",
        "  fatal_collisions: 2 -> 3",
        "  mean_speed_kmh: 35 -> 35.5",
    ]


@pytest.mark.parametrize("name", ["study-speed", "grip-camera", "grip-threshold", "matrix-figure8"])
def test_every_frozen_row_counts_whatever_sets_its_run_apart(name):
    rows = read_rows(ROOT / "docs" / "results" / name)
    assert what_moved(rows, rows)[0] == f"0 of {len(rows):,} rows moved; 0 gone, 0 new"


def test_equal_results_move_nothing_whatever_their_hashes_and_missing_runs_are_told():
    same = ROWS.with_columns(log_hash=pl.lit("other"))
    assert what_moved(ROWS, same) == ["0 of 3 rows moved; 0 gone, 0 new"]
    fewer = pl.concat([ROWS.head(2), ROWS.tail(1).with_columns(seed=pl.lit(9, pl.Int64))])
    assert what_moved(ROWS, fewer)[0] == "0 of 2 rows moved; 1 gone, 1 new"


def test_again_drives_the_planned_command_and_leaves_the_frozen_rows(tmp_path, monkeypatch, capsys):
    frozen = tmp_path / "results" / "matrix-x"
    frozen.mkdir(parents=True)
    ROWS.write_parquet(frozen / "results.parquet")
    calls = []

    def drive(name, words, out, workers):
        calls.append(words)
        (out / name).mkdir(parents=True)
        ROWS.with_columns(fatal_collisions=pl.Series([1, 2, 4])).write_parquet(
            out / name / "results.parquet"
        )
        return out / name

    plan = {"campaigns": [{"name": "matrix-x", "command": "adas --seeds 3"}]}
    monkeypatch.setattr(campaigns, "drive", drive)
    monkeypatch.setattr(campaigns, "plan", lambda: plan)
    monkeypatch.setattr(campaigns, "RESULTS", tmp_path / "results")
    assert campaigns.main(["--again", "--out", str(tmp_path / "out")]) == 0
    assert calls == [["adas", "--seeds", "3"]]
    assert "matrix-x: 1 of 3 rows moved" in capsys.readouterr().out
    assert read_rows(frozen).equals(ROWS)


def command_of(target, *variables):
    made = subprocess.run(
        ["make", "-n", target, *variables], cwd=ROOT, check=True, capture_output=True, text=True
    ).stdout.replace("\\\n", " ")
    line = next(line for line in made.splitlines() if "skidpad adas" in line)
    return shlex.split(line)[2:]


@pytest.mark.req("A-210")
@pytest.mark.parametrize(
    ("target", "variables", "wanted"),
    [
        ("run", (), {"sensors": "objects", "seeds": 10, "distinct": True, "parity_seeds": 1,
                     "traffic": "pack", "profile": "recommended", "resume": True}),
        ("published", (), {"sensors": "pixels", "seeds": 1, "distinct": False, "traffic": "fixed",
                           "profile": "thesis_text", "map": "figure8", "duration": 500.0}),
        ("published", ("TOWN04=/maps/Town04.xodr",), {"map": "/maps/Town04.xodr", "edges": "rail"}),
    ],
)  # fmt: skip
def test_the_main_jobs_ask_for_what_they_promise(target, variables, wanted):
    command = typer.main.get_command(app).commands["adas"]
    asked = command.make_context("adas", command_of(target, *variables)).params
    assert {name: asked[name] for name in wanted} == wanted
