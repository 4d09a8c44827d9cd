"""Physical actors do what a scenario asks as far as their tyres let them."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.log_files import read_log
from support.scenarios.files import at, write


@pytest.mark.parametrize("v", [4.0, 13.33, 30.0])
def test_an_actor_holds_the_speed_that_it_is_asked_for(tmp_path, v):
    begin = at("ego", -3, 50) + at("other", -1, 120, v)
    file = write(tmp_path, init=begin, end=10.0)
    out = tmp_path / "out"
    done = CliRunner().invoke(app, ["play", str(file), "--out", str(out), "--actors", "physical"])
    assert done.exit_code in (0, 1), done.output  # whatever the verdict
    log = read_log(out)
    late = log.t > 6.0
    assert np.hypot(log.actors.vx[late, 1], log.actors.vy[late, 1]) == pytest.approx(v, rel=0.01)
