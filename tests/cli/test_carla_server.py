"""`skidpad carla-server`: bad input before anything is compiled."""

from __future__ import annotations

from typer.testing import CliRunner

from skidpad.cli.main import app


def test_an_unknown_map_is_refused_with_those_there_are():
    done = CliRunner().invoke(app, ["carla-server", "--port", "0", "--map", "nowhere"])
    said = str(done.exception)
    assert "unknown --map 'nowhere'; choose one of: " in said
    assert "figure8" in said
