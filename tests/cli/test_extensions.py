"""What is said where an optional part, a package or a run is missing."""

import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from skidpad.campaign.campaign import Summary
from skidpad.cli.main import app


def test_relays_name_the_part_that_they_belong_to(monkeypatch):
    monkeypatch.setitem(sys.modules, "skidpad.fleet.alerting.relay_types", None)
    done = CliRunner().invoke(app, ["extensions", "relays"])
    assert done.exit_code != 0
    assert "relays belong to the fleet" in str(done.exception or done.output)
    assert "fleet]" in str(done.exception or done.output)
    assert "unknown kind" not in str(done.exception or done.output)


def test_a_run_on_a_backend_that_is_gone_says_so_before_it_asks(tmp_path):
    from skidpad.cli.runs.rerun import require_backend
    from skidpad.core.errors import ConfigError

    require_backend(tmp_path, "embedded")
    with pytest.raises(
        ConfigError, match="the backend 'fading', which is not installed; there are: embedded"
    ):
        require_backend(tmp_path, "fading")


def test_a_campaign_says_what_the_first_of_its_failed_runs_said():
    summary = Summary(
        Path("out"), 3, 3, failed=1, content_hash="", mixed_machines=False, error="too few places"
    )
    (said,) = summary.warnings()
    assert said == "1 run crashed or timed out (too few places); --resume tries again"
