"""Distances without limits are there at once; nobody keeps a speed from the leap."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.events import NoticeSource
from skidpad.recording.run.log_files import read_log
from support.scenarios.files import (
    at,
    by_entity,
    event,
    private,
    speed,
    story,
    time,
    to,
    told,
    write,
)

SIDES = ("leadingReferencedEntity", "trailingReferencedEntity")


def gap(distance, continuous="false", side=SIDES[0], limits=""):
    return f"""<LongitudinalAction><LongitudinalDistanceAction entityRef="ego" freespace="false"
distance="{distance}" continuous="{continuous}" displacement="{side}">{limits}
</LongitudinalDistanceAction></LongitudinalAction>"""


@pytest.mark.osc("LongitudinalDistanceAction")
@pytest.mark.parametrize("continuous", ["false", "true"])
@pytest.mark.parametrize("lane", [-1, 1])
def test_a_leap_to_a_distance_leaves_the_speed_of_the_other_one(tmp_path, continuous, lane):
    """ALKS 4.5 in small: the lead car is to be 5 m further on, at the ego's 10 m/s."""
    action = gap(25 if lane < 0 else 60, continuous, SIDES[lane > 0])
    begin = at("ego", -3 if lane < 0 else 3, 200) + at("other", lane, 220, 12)
    result = told(
        tmp_path, init=begin, stories=story(event("e", private(action), time(2.0))), end=6.0
    )
    ego, other = result.of("ego"), result.of("other")
    assert other[39].speed == pytest.approx(12.0)
    assert max(r.speed for r in other[41:]) == pytest.approx(10.0)
    assert [abs(b.x - a.x) for a, b in zip(ego[42:], other[42:], strict=True)] == pytest.approx(
        [25.0 if lane < 0 else 60.0] * len(ego[42:]), abs=0.02
    )


def test_a_step_to_a_distance_in_init_is_there_from_the_begin(tmp_path):
    begin = at("ego", -3, 100) + at("other", -1, 120, 12)[: -len("</Private>")]
    begin += private(gap(25)) + "</Private>"
    result = told(tmp_path, init=begin, end=2.0)
    ego, other = result.of("ego"), result.of("other")
    assert other[0].x - ego[0].x == pytest.approx(25.0, abs=1e-6)
    assert other[0].speed == pytest.approx(10.0)
    assert max(b.x - a.x for a, b in pairwise(other)) == pytest.approx(0.5, abs=1e-6)


def test_no_condition_sees_a_speed_from_a_leap(tmp_path):
    fast = by_entity('<SpeedCondition value="20" rule="greaterThan"/>', "other")
    stories = story(event("e", private(gap(60)), time(1.0)))
    stories += story(event("fast", private(speed(to(1))), fast), name="watch")
    result = told(tmp_path, stories=stories, end=4.0)
    assert result.player.events[1].t is None
    assert result.player.actors["other"].travelled == pytest.approx(40.0, abs=0.6)


def test_a_car_on_its_tyres_closes_the_gap_within_its_performance(tmp_path):
    """Nothing on tyres leaps: it is asked for what its performance allows, and the log says so."""
    file = write(
        tmp_path, stories=story(event("e", private(gap(60, "true")), time(1.0))), end=25.0,
        init=at("ego", -3, 100) + at("other", -1, 120, 10),
    )  # fmt: skip
    out = tmp_path / "out"
    arguments = ["play", str(file), "--out", str(out), "--stack", "ideal"]
    done = CliRunner().invoke(app, [*arguments, "--actors", "physical"])
    assert done.exit_code == 0, done.output
    log = read_log(out)
    v = np.hypot(log.actors.vx[:, 1], log.actors.vy[:, 1])
    assert np.abs(np.diff(v)).max() <= 12.0 * 0.05
    assert v[-1] == pytest.approx(10.0, abs=0.3)
    assert log.actors.x[-1, 1] - log.actors.x[-1, 0] == pytest.approx(60.0, abs=0.5)
    texts = [n.text for n in log.notices if n.source is NoticeSource.SCENARIO]
    assert len(texts) == 1
    assert texts[0].startswith(
        "<LongitudinalDistanceAction> of other: at once asked, at most 10 m/s^2"
    )
