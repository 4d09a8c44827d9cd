"""Background vehicles leave and come back while a run is driven, and the run can be driven again."""

import numpy as np
import pytest
from typer.testing import CliRunner

from runs import adas_run
from skidpad.campaign.density import FROM_EGO, Density
from skidpad.campaign.desk import Desk, Recorded
from skidpad.campaign.desk_run import drive_at_desk
from skidpad.campaign.run import run
from skidpad.cli.main import app
from skidpad.core.errors import ConfigError
from skidpad.core.inputs import Crowd, Timed
from skidpad.core.vocabulary import SensorLevel
from skidpad.recording.inputs import decode_inputs, encode_inputs
from skidpad.recording.logfiles import log_hash

INPUTS = [Timed(20, Crowd(4)), Timed(60, Crowd(9)), Timed(61, Crowd(12))]


def wanted(duration=8.0):
    return adas_run(
        2, "clear-noon", sensors=SensorLevel.OBJECTS, duration=duration, seed=3, vehicles=12
    )


@pytest.mark.req("A-273")
def test_vehicles_leave_and_come_back_and_the_same_inputs_give_the_same_bytes():
    log = run(wanted(), desk=Desk(Recorded(INPUTS), wanted())).log
    count = log.present[:, 1:].sum(axis=1)
    assert (count[:21] == 12).all()
    assert (count[21:60] == 4).all()
    assert count[-1] > 9
    assert (count[21:] <= 12).all()
    # nobody appears close to the ego, and those who stayed are the nearest ones
    a = log.actors
    away = np.hypot(a.x - a.x[:, :1], a.y - a.y[:, :1])
    back = ~log.present[60:-1, 1:] & log.present[61:, 1:]
    assert back.any()
    assert away[61:, 1:][back].min() > 0.8 * FROM_EGO
    stayed, left = log.present[25, 1:], ~log.present[25, 1:]
    assert away[20, 1:][stayed].max() < away[20, 1:][left].min()
    again = run(wanted(), desk=Desk(Recorded(decode_inputs(encode_inputs(INPUTS))), wanted())).log
    assert log_hash(again) == log_hash(log)
    assert log_hash(run(wanted()).log) != log_hash(log)


def test_a_folder_with_thinner_traffic_is_driven_again(tmp_path):
    drive_at_desk(wanted(3.0), Desk(Recorded(INPUTS), wanted(3.0)), tmp_path / "run")
    words = ["rerun", str(tmp_path / "run"), "--from", "0", "--to", "3", "--video"]
    done = CliRunner().invoke(app, [*words, str(tmp_path / "film.mp4")])
    assert done.exit_code == 0, done.output
    assert "the same drive" in done.output


def test_more_than_the_run_began_with_is_as_many_as_it_began_with():
    assert Density().words(None) == []
    log = run(wanted(1.0), desk=Desk(Recorded([Timed(2, Crowd(80))]), wanted(1.0))).log
    assert log.present.all()
    with pytest.raises(ConfigError, match="vehicles must be between 0 and 80"):
        Crowd(81)
