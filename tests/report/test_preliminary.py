"""The figure of the preliminary against the final system, by value (figure 33 of the source)."""

import csv
from pathlib import Path

import polars as pl
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.report.elements.figures import PALETTE
from skidpad.report.matrix.comparisons.preliminary import preliminary_svg
from skidpad.report.matrix.data import published_preliminary
from support.svg_values import bars, texts

PUBLISHED = Path(__file__).resolve().parents[2] / "src/skidpad/report/published"
ROWS = Path(__file__).resolve().parents[2] / "docs/results/study-preliminary"


@pytest.fixture(scope="module")
def rows():
    (path,) = ROWS.glob("*.csv")
    return pl.read_csv(path)


@pytest.mark.req("A-259", "A-278")
def test_bars_are_the_means_of_both_arms_of_the_study(rows):
    svg = preliminary_svg(rows)
    arms = [rows.filter(pl.col("variant") == arm) for arm in ("preliminary", "final")]
    columns = ("fatal_collisions", "radar_fpr_pct", "radar_fnr_pct", "dropout_pct")
    expected = [arm[c].mean() for c in columns for arm in arms]
    assert bars(svg, PALETTE[0]) == pytest.approx(expected, rel=1e-3, abs=1e-3)
    told = {text for text, *_ in texts(svg)}
    assert {"interventions", "radar false positives, %", "dropout, %", "preliminary"} <= told


@pytest.mark.req("A-259")
def test_published_values_are_the_means_of_the_eleven_common_runs():
    found = {column: values for column, *values in published_preliminary()}
    with (PUBLISHED / "adas_preliminary_vs_final_matching_runs.csv").open(encoding="utf-8") as file:
        runs = list(csv.DictReader(file))
    assert len(runs) == 11
    for column, name in (("radar_fpr_pct", "fpr_pct"), ("dropout_pct", "dropout_pct")):
        means = [sum(float(r[f"{arm}_{name}"]) for r in runs) / 11 for arm in ("prelim", "final")]
        assert found[column] == pytest.approx(means)
    assert set(found) == {
        "fatal_collisions", "lane_invasions", "radar_fpr_pct", "radar_fnr_pct", "dropout_pct"
    }  # fmt: skip


def test_the_command_draws_this_study_alone(tmp_path):
    told = CliRunner().invoke(app, ["study", "F-08", "--figure", str(tmp_path / "x.svg")])
    assert told.exit_code == 2 or "A-278`, not of F-08" in str(told.exception)
    assert not (tmp_path / "x.svg").exists()
