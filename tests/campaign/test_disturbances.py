"""Disturbances of other drivers: off by default, as their law says, part of the record, and branching."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

import skidpad
from skidpad.campaign.runs.run import run as drive
from skidpad.cli.main import app
from skidpad.core.errors import ConfigError
from skidpad.core.run import run_from_plain
from skidpad.core.traffic.disturbance import KNOT_S, LARGEST, SHARE, Disturbance, parse_disturbance
from skidpad.recording.run.log_files import log_hash
from skidpad.scenarios.playing.disturbing import Disturbances


def begin(disturb=("lead=accel(0.6,2)",), seed=5, **more):
    return skidpad.Scenario(
        "lead_slowdown", stack=4, seed=seed, duration=12.0, disturb=disturb, **more
    )


def end(scenario):
    while scenario.step():
        pass
    return log_hash(scenario.finish().log)


def lead_of(log):
    column = log.table.names.index("lead")
    return log.actors.x[:, column], np.hypot(log.actors.vx[:, column], log.actors.vy[:, column])


def test_the_process_has_the_size_and_correlation_that_were_asked_for():
    law, rng = Disturbance("lead", 0.5, 2.0), np.random.default_rng(1)
    x = np.zeros((40, 4000))
    for k, z in enumerate(rng.standard_normal(x.shape)):
        x[k] = [law.follow(a, b, first=k == 0) for a, b in zip(x[k - 1], z, strict=True)]
    assert x.std(axis=1) == pytest.approx(np.ones(40), abs=0.05)
    assert np.mean(x[1:] * x[:-1]) == pytest.approx(np.exp(-KNOT_S / 2.0), abs=0.02)
    assert law.acceleration(1.5) == pytest.approx(0.75)
    assert law.acceleration(99.0) == -law.acceleration(-99.0) == 0.5 * LARGEST


@pytest.mark.parametrize("actors", ["physical", "ideal"])
def test_they_change_the_vehicle_within_its_bounds_and_by_the_seed(actors):
    plain, one, again, other = (
        begin(disturb, seed, actors=actors)
        for disturb, seed in (((), 5), (("lead=accel(0.6,2)",), 5), (("lead=accel(0.6,2)",), 5),
                              (("lead=accel(0.6,2)",), 6))
    )  # fmt: skip
    hashes = [end(s) for s in (plain, one, again, other)]
    assert hashes[1] == hashes[2]
    assert len(set(hashes)) == 3
    undisturbed, disturbed = (lead_of(s.finish().log) for s in (plain, one))
    both = min(len(undisturbed[0]), len(disturbed[0]))
    assert np.abs(undisturbed[0][:both] - disturbed[0][:both]).max() > 0.05
    early = slice(0, 20)  # before it brakes at 30 m it goes at a constant speed of 22.2 m/s
    gained = disturbed[1][early] - undisturbed[1][early]
    assert 0.0 < np.abs(gained).max() <= SHARE * 22.2
    assert np.abs(np.diff(gained)).max() <= 1.5 * LARGEST * 0.6 * 0.05


def test_a_restored_run_goes_on_and_a_branch_draws_another_future():
    whole = end(begin())
    scenario = begin()
    scenario.step(37)
    there = scenario.save()
    before = scenario.player.disturbances.draws["lead"]
    futures = {}
    for name in ("", "a", "b", "a", ""):
        scenario.restore(there, name)
        now = end(scenario)
        assert futures.setdefault(name, now) == now
        drawn = scenario.player.disturbances.draws["lead"]
        assert drawn[: len(before)] == before
        assert len(drawn) > len(before)
    assert futures[""] == whole
    assert len(set(futures.values())) == 3


def test_what_a_branch_drew_is_a_run_of_its_own_with_the_same_hash():
    """Only the disturbances branch here, so that sensor noise stays that of the seed."""
    scenario = begin()
    scenario.step(41)
    there = scenario.save()
    scenario.restore(there)
    scenario.player.disturbances.branch("elsewhere")
    branched = end(scenario)
    plain = scenario.spec.to_plain()
    plain["course"]["draws"] = scenario.player.disturbances.draws
    assert log_hash(drive(run_from_plain(plain, "test")).log) == branched


def test_draws_that_are_given_come_before_those_of_the_seed():
    laws = [parse_disturbance("lead=accel")]
    given, free = Disturbances(laws, {"lead": (1.0, -2.0)}, 3), Disturbances(laws, {}, 3)

    class Straight:
        v = 20.0

    for one in (given, free):
        for _ in range(round(4 * KNOT_S / 0.05)):
            one.drifts[0].step(Straight(), 0.05)
    assert given.draws["lead"][:2] == (1.0, -2.0)
    assert given.draws["lead"][2:] == free.draws["lead"][:2]


def test_without_them_a_run_is_described_as_before():
    plain = begin(()).spec.to_plain()
    assert "disturb" not in plain["course"]
    assert "draws" not in plain["course"]
    described = begin().spec.to_plain()
    assert run_from_plain(described, "test").course.disturb == ("lead=accel(0.6,2)",)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("lead", "--disturb takes ACTOR=accel, or ACTOR=accel(SIGMA,TAU)"),
        ("lead=swerve", "--disturb takes ACTOR=accel"),
        ("=accel", "--disturb takes ACTOR=accel"),
        ("lead=accel(9,2)", "lead: SIGMA must be between 0.001 and 5, got 9.0"),
        ("lead=accel(1,0)", "lead: TAU must be between 0.1 and 60, got 0.0"),
        ("leda=accel", "'leda' is no other vehicle of the file; there are: lead"),
        ("ego=accel", "'ego' is no other vehicle of the file; there are: lead"),
    ],
)
def test_a_wrong_disturbance_is_refused_in_one_sentence(text, complaint):
    with pytest.raises(ConfigError) as caught:
        begin((text,))
    assert complaint in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_command_refuses_with_2(tmp_path):
    call = ["play", "lead_slowdown", "--disturb", "lead=brake", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, call, catch_exceptions=True)
    assert isinstance(result.exception, ConfigError)
