"""Changes of speed within limits of jerk, against hand-derived times and peaks."""

from __future__ import annotations

import math
from itertools import pairwise
from math import inf, sqrt

import pytest

from skidpad.scenarios.actions.jerk import Jerk, pieces_over, settle, smooth_pieces
from support.scenarios.files import event, private, speed, story, time, to, told, vehicle


def ends(pieces):
    """Speed and acceleration at the end of the last piece."""
    return pieces[-1].at(pieces[-1].duration)


@pytest.mark.osc("SpeedProfileAction")
def test_the_fastest_change_rises_holds_and_falls():
    """By 6 m/s: 3 m/s2 after 1.5 s, held for 6 / 3 - 0.5 * 3 * (1/2 + 1/3) = 0.75 s, 0 after 1 s."""
    pieces = list(smooth_pieces(10.0, 16.0, 3.0, Jerk(2.0, 3.0), None))
    assert [p.duration for p in pieces] == pytest.approx([1.5, 0.75, 1.0])
    assert ends(pieces) == pytest.approx((16.0, 0.0))


def test_braking_begins_with_the_downward_limit():
    pieces = list(smooth_pieces(10.0, 9.0, 9.0, Jerk(2.0, 3.0), None))
    assert [p.jerk for p in pieces] == pytest.approx([-3.0, 0.0, 2.0])
    assert pieces[1].a == pytest.approx(-sqrt(2.0 / (1.0 / 2.0 + 1.0 / 3.0)))
    assert ends(pieces) == pytest.approx((9.0, 0.0))


@pytest.mark.parametrize("jerk", [Jerk(2.0, 3.0), Jerk(2.0, inf), Jerk(inf, 1.0)])
def test_a_time_is_kept_where_the_limits_allow_it_else_it_takes_longer(jerk):
    kept = list(smooth_pieces(10.0, 16.0, 3.0, jerk, 6.0))
    assert sum(p.duration for p in kept) == pytest.approx(6.0)
    assert ends(kept)[0] == pytest.approx(16.0)
    fastest = sum(p.duration for p in smooth_pieces(10.0, 16.0, 3.0, jerk, None))
    hasty = list(smooth_pieces(10.0, 16.0, 3.0, jerk, 1.0))
    assert sum(p.duration for p in hasty) == pytest.approx(fastest)
    assert ends(hasty)[0] == pytest.approx(16.0)


def test_a_speed_that_stays_takes_its_time():
    (piece,) = smooth_pieces(10.0, 10.0, 3.0, Jerk(1.0, 1.0), 4.0)
    assert piece.duration == 4.0
    assert ends([piece]) == (10.0, 0.0)


def test_an_acceleration_under_way_is_settled_first():
    """From -2 m/s2 upwards at 4 m/s3: 0.5 s, in which 0.5 m/s are lost."""
    piece = settle(10.0, -2.0, Jerk(4.0, 1.0))
    assert (piece.duration, piece.jerk) == (0.5, 4.0)
    assert piece.at(0.5) == pytest.approx((9.5, 0.0))
    assert settle(10.0, 1.0, Jerk(4.0, 2.0)).jerk == -2.0


def test_a_way_is_kept_where_the_limits_allow_it():
    """Equal limits: the change is symmetric, so that the mean speed is 13 m/s and 78 m take 6 s."""
    pieces = pieces_over(10.0, 16.0, 3.0, Jerk(2.0, 2.0), 78.0)
    assert sum(p.way for p in pieces) == pytest.approx(78.0, abs=1e-6)
    assert sum(p.duration for p in pieces) == pytest.approx(6.0, abs=1e-6)
    oblique = pieces_over(16.0, 10.0, 3.0, Jerk(1.0, 4.0), 78.0)
    assert sum(p.way for p in oblique) == pytest.approx(78.0, abs=1e-6)
    assert ends(oblique) == pytest.approx((10.0, 0.0), abs=1e-9)
    hasty = pieces_over(10.0, 16.0, 3.0, Jerk(2.0, 2.0), 1.0)
    assert sum(p.duration for p in hasty) == pytest.approx(3.5)


def change(value: float, shape: str, amount: float, dimension: str, following: str) -> str:
    return private(f"""<LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="{shape}"
value="{amount}" dynamicsDimension="{dimension}" followingMode="{following}"/><SpeedActionTarget>
{to(value)}</SpeedActionTarget></SpeedAction></LongitudinalAction>""")


def speeds(tmp_path, *events, rates='maxAccelerationRate="2" maxDecelerationRate="3"', a=3.0):
    """Speeds of `other` by time; it has limits of jerk, begins at 10 m/s and does things from 1 s on."""
    eased = vehicle("other").replace('maxAcceleration="10"', f'maxAcceleration="{a}" {rates}')
    parts = {"entities": vehicle("ego") + eased, "stories": story(*events), "minor": 2, "end": 12.0}
    return {round(r.time, 2): r.speed for r in told(tmp_path, **parts).of("other")}


@pytest.mark.osc("SpeedAction")
@pytest.mark.parametrize(
    ("how", "after"),
    [
        # as fast as it can: 3 m/s2 after 1.5 s and 2.25 m/s, held 0.75 s, 1 s down: 3.25 s
        (("step", 0, "time"), {1.5: 12.25, 2.25: 14.5, 3.25: 16.0}),
        (("linear", 0.5, "time"), {1.5: 12.25, 2.25: 14.5, 3.25: 16.0}),
        # at most 2 m/s2: 1 s and 1 m/s up, (6 - 1 - 2/3) / 2 = 2.1667 s held, 0.6667 s down
        (("linear", 2, "rate"), {1.0: 11.0, 2.0: 13.0, 3.1667: 15.3333, 3.8333: 16.0}),
    ],
)  # fmt: skip
def test_a_change_of_speed_that_follows_has_no_jump_of_acceleration(tmp_path, how, after):
    found = speeds(tmp_path, event("e", change(16, *how, "follow"), time(0.975)))
    for t, v in after.items():
        step = round(math.floor(t / 0.05) * 0.05, 2)
        share = (t - step) / 0.05
        low, high = found[round(1.0 + step, 2)], found[round(1.05 + step, 2)]
        assert low + share * (high - low) == pytest.approx(v, abs=0.01)
    v = [found[k] for k in sorted(found)]
    jerk = [(c - 2.0 * b + a) / 0.05**2 for a, b, c in zip(v, v[1:], v[2:], strict=False)]
    assert max(jerk) <= 2.0 + 1e-6
    assert min(jerk) >= -3.0 - 1e-6


def test_a_change_that_replaces_another_one_settles_its_acceleration(tmp_path):
    up = event("up", change(30, "linear", 3, "rate", "follow"), time(0.975))
    down = event("down", change(8, "step", 0, "time", "follow"), time(3.975), priority="overwrite")
    found = speeds(tmp_path, up, down)
    v = [found[k] for k in sorted(found)]
    jerk = [(c - 2.0 * b + a) / 0.05**2 for a, b, c in zip(v, v[1:], v[2:], strict=False)]
    assert max(jerk) <= 2.0 + 1e-6
    assert min(jerk) >= -3.0 - 1e-6
    assert v[-1] == pytest.approx(8.0, abs=1e-6)


def test_a_change_by_position_keeps_its_shape(tmp_path):
    """Nothing but `follow` asks for the limits of jerk: 6 m/s in 3 s are 2 m/s2 from the first step."""
    found = speeds(tmp_path, event("e", change(16, "linear", 3, "time", "position"), time(0.975)))
    assert found[1.05] == pytest.approx(10.1, abs=1e-6)
    assert found[4.0] == pytest.approx(16.0, abs=1e-6)


def test_a_change_to_a_speed_that_goes_on_changing_is_kept_within_the_limits(tmp_path):
    target = """<RelativeTargetSpeed entityRef="ego" value="0" speedTargetValueType="delta"
continuous="true"/>"""
    follows = change(0, "step", 0, "time", "follow").replace(to(0), target)
    events = event("e", follows, time(0.975))
    brakes = story(event("b", private(speed(to(4))), time(4.975)), actor="ego", name="brakes")
    eased = vehicle("other").replace('maxDeceleration="10"', 'maxDeceleration="2"')
    parts = {"entities": vehicle("ego") + eased, "stories": story(events) + brakes, "end": 10.0}
    found = {round(r.time, 2): r.speed for r in told(tmp_path, **parts).of("other")}
    assert found[5.0] == pytest.approx(10.0, abs=0.11)
    assert found[7.0] == pytest.approx(6.0, abs=0.11)
    assert found[9.0] == pytest.approx(4.0, abs=1e-6)


@pytest.mark.osc("LongitudinalDistanceAction")
def test_rates_of_the_vehicle_bound_a_distance_action(tmp_path):
    """Rates of `Performance` alone: the acceleration grows by at most 2 m/s3 and shrinks by 3."""
    how = private("""<LongitudinalAction><LongitudinalDistanceAction entityRef="ego" distance="60"
freespace="false" continuous="true"><DynamicConstraints maxAcceleration="3" maxDeceleration="3"
maxSpeed="40"/></LongitudinalDistanceAction></LongitudinalAction>""")
    v = list(speeds(tmp_path, event("e", how, time(0.975))).values())
    a = [(q - p) / 0.05 for p, q in pairwise(v)]
    grown = [(q - p) / 0.05 for p, q in pairwise(a) if q > 0.0]
    assert max(grown) == pytest.approx(2.0, abs=0.01)


@pytest.mark.osc("SpeedProfileAction")
def test_rates_of_a_profile_by_position_are_not_read(tmp_path):
    profile = private("""<LongitudinalAction><SpeedProfileAction followingMode="position">
<DynamicConstraints maxAccelerationRate="none"/><SpeedProfileEntry speed="16" time="3"/>
</SpeedProfileAction></LongitudinalAction>""")
    found = speeds(tmp_path, event("e", profile, time(0.975)))
    assert found[4.0] == pytest.approx(16.0, abs=1e-6)
