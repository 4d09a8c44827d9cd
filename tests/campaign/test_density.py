"""Background vehicles leave and come back while a run is driven, and the run can be driven again."""

import numpy as np
import pytest
from msgspec import structs
from typer.testing import CliRunner

from skidpad.campaign.runs.desk_run import drive_at_desk
from skidpad.campaign.runs.run import run
from skidpad.campaign.takeover.desk import FROM_EGO, Density, Desk, Recorded
from skidpad.cli.main import app
from skidpad.cli.runs.cockpit import with_reserve as with_more
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.inputs import Crowd, Timed
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.vocabulary import SensorLevel, TrafficStart
from skidpad.recording.run.inputs import decode_inputs, encode_inputs
from skidpad.recording.run.log_files import log_hash
from support.runs import adas_run

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


def with_reserve(traffic="fixed", duration=12.0):
    course = structs.replace(wanted().course, reserve=6, traffic=TrafficStart(traffic))
    return structs.replace(wanted(duration), course=course)


MORE = [Timed(10, Crowd(15)), Timed(120, Crowd(18)), Timed(200, Crowd(3))]


@pytest.mark.req("A-273")
@pytest.mark.parametrize("traffic", ["fixed", "random", "pack"])
def test_the_reserve_is_called_in_and_the_same_inputs_give_the_same_bytes(traffic):
    spec = with_reserve(traffic)
    log = run(spec, desk=Desk(Recorded(MORE), spec)).log
    reserve = [i for i, name in enumerate(log.table.names) if name.startswith("reserve_")]
    there = log.present[:, reserve]
    assert len(reserve) == 6
    assert not there[:11].any()  # nobody comes uncalled
    assert not there[:121, 3:].any()
    entered = there[:201].any(axis=0)
    assert entered.sum() >= 4
    a = log.actors
    for i, first in zip(reserve, there.argmax(axis=0), strict=True):
        if not log.present[:201, i].any():
            continue
        assert np.hypot(a.x[first, i] - a.x[first, 0], a.y[first, i] - a.y[first, 0]) > FROM_EGO
        assert np.hypot(a.vx[first + 5, i], a.vy[first + 5, i]) > 3.0  # it drives
    assert log.present[-1, 1:].sum() == 3
    again = run(spec, desk=Desk(Recorded(decode_inputs(encode_inputs(MORE))), spec)).log
    assert log_hash(again) == log_hash(log)


def test_an_uncalled_reserve_changes_nobody():
    plain, held = run(wanted(4.0)).log, run(with_reserve(duration=4.0)).log
    n = len(plain.table.names)
    assert held.table.names[:n] == plain.table.names
    assert np.array_equal(held.actors.x[:, :n], plain.actors.x)
    assert not held.present[:, n:].any()
    with pytest.raises(ConfigError, match=r"reserve must be at most 68 .* got 70"):
        run(structs.replace(wanted(1.0), course=structs.replace(wanted().course, reserve=70)))


def test_a_drive_is_offered_what_there_is_room_for():
    assert with_more(Roads(vehicles=70), BackendChoice(), None).reserve == 10
    assert with_more(Roads(), BackendChoice(), 3).reserve == 3
    carla = BackendChoice(backend=BackendKind.CARLA)
    assert with_more(Roads(), carla, None).reserve == 0
    with pytest.raises(ConfigError, match="--more must be at most 60 beside 20 vehicles, got 61"):
        with_more(Roads(), BackendChoice(), 61)
    with pytest.raises(ConfigError, match="--more must be 0 on a CARLA server, got 1"):
        with_more(Roads(), carla, 1)


def test_more_than_the_run_has_is_as_many_as_it_has():
    assert Density().words(None) == []
    log = run(wanted(1.0), desk=Desk(Recorded([Timed(2, Crowd(80))]), wanted(1.0))).log
    assert log.present.all()
    with pytest.raises(ConfigError, match="vehicles must be between 0 and 80"):
        Crowd(81)
