"""`skidpad bench` prints a figure for each thing it measures, and the same as JSON."""

from __future__ import annotations

import json

from typer.testing import CliRunner

from skidpad.cli.main import app

RUNNER = CliRunner()


def test_physics_costs_as_json_name_the_machine() -> None:
    result = RUNNER.invoke(app, ["bench", "physics", "--json"])
    assert result.exit_code == 0, result.output
    found = json.loads(result.output)
    assert found["machine"]
    assert set(found["figures"]) == {"fleet of 1", "fleet of 21", "fleet of 200"}
    assert all(value > 0.0 for value in found["figures"].values())


def test_an_unknown_subject_is_refused() -> None:
    result = RUNNER.invoke(app, ["bench", "everything"])
    assert result.exit_code == 2
    assert "everything" in result.output
