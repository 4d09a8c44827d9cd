"""`skidpad extensions` on a machine without an optional part."""

import sys

from typer.testing import CliRunner

from skidpad.cli.main import app


def test_relays_name_the_part_that_they_belong_to(monkeypatch):
    monkeypatch.setitem(sys.modules, "skidpad.fleet.alerting.relay_types", None)
    done = CliRunner().invoke(app, ["extensions", "relays"])
    assert done.exit_code != 0
    assert "relays belong to the fleet" in str(done.exception or done.output)
    assert "fleet]" in str(done.exception or done.output)
    assert "unknown kind" not in str(done.exception or done.output)
