"""`skidpad bench` prints a figure for each thing it measures, and the same as JSON."""

from __future__ import annotations

import json

import pytest
from typer.testing import CliRunner

from skidpad.campaign.bench import scenarios as bench_scenarios
from skidpad.campaign.bench.scenarios import ScenarioCost
from skidpad.cli.main import app

RUNNER = CliRunner()


def test_physics_costs_as_json_name_the_machine() -> None:
    result = RUNNER.invoke(app, ["bench", "physics", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["machine"]
    assert set(found["figures"]) == {"fleet of 1", "fleet of 21", "fleet of 200"}
    assert all(value > 0.0 for value in found["figures"].values())


def test_files_are_measured_against_their_targets(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [
        ScenarioCost("played by itself", 310.0, "times real time", 300.0, most=False),
        ScenarioCost("800 checks", 2.5, "s", 2.0, most=True),
    ]
    monkeypatch.setattr(bench_scenarios, "measure", lambda _: rows)
    result = RUNNER.invoke(app, ["bench", "scenarios"])
    assert result.exit_code == 0, result.output
    assert "played by itself         310.00 times real time" in result.output
    assert not {"over", "slow", "ok"} & set(
        result.output.split()
    )  # a maker's goals are in the JSON
    found = json.loads(RUNNER.invoke(app, ["bench", "scenarios", "--json"]).output)
    assert [row["met"] for row in found["rows"]] == [True, False]


def test_an_unknown_subject_is_refused() -> None:
    result = RUNNER.invoke(app, ["bench", "everything"])
    assert result.exit_code == 2
    assert "everything" in result.output
