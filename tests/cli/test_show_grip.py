"""`skidpad show`: what the weather left of each vehicle's tyre friction."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from skidpad.campaign.runs.play import run_to
from skidpad.cli.main import app
from skidpad.cli.runs.show import vehicle_grips
from skidpad.core.run import Friction
from skidpad.recording.run.log_files import read_log
from support.runs import adas_run


@pytest.mark.req("B-068")
@pytest.mark.parametrize(
    ("friction", "ratio", "result"),
    # rain of 60 %: 0.6 exp(-0.916 * 0.6) 0.4^3 + 0.4 - 0.06, of CARLA's own 3.5
    [(Friction.REDUCED, "0.3622", "1.268"), (Friction.ORIGINAL, "1.0000", "3.5")],
)
def test_each_vehicle_has_its_own_friction_the_ratio_and_the_result_with_the_weather(
    tmp_path, friction, ratio, result
):
    run = tmp_path / "run"
    settings = {"grip": "statistical"}
    spec = adas_run(
        weather="rain_60", settings=settings, friction=friction, vehicles=2, duration=0.5
    )
    run_to(spec, run)
    rows = vehicle_grips(run, read_log(run))
    assert [row[0] for row in rows] == ["ego", "traffic_01", "traffic_02"]
    assert {row[2:] for row in rows} == {("3.5", ratio, result, "rain_60")}
    printed = CliRunner().invoke(app, ["show", str(run)]).output
    told = printed.partition("Tyre friction of each vehicle")[2].splitlines()
    assert told[2].split() == list(rows[0])
    (run / "config.yaml").unlink()
    assert vehicle_grips(run, read_log(run)) == []
