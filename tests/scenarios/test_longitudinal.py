"""Speeds: when they begin, how they are limited, relative and kept ones, profiles, gaps, meetings."""

from __future__ import annotations

import itertools

import pytest

from support.scenarios.files import at, event, on_lane, private, speed, story, time, to, told


def rows_of(tmp_path, action, name="other", end=12.0, **parts):
    return told(tmp_path, stories=story(event("e", action, time(2.0))), end=end, **parts).of(name)


@pytest.mark.osc("SpeedAction", "AbsoluteTargetSpeed")
def test_a_change_begins_when_its_trigger_fires_and_takes_its_time(tmp_path):
    rows = rows_of(tmp_path, private(speed(to(4), "linear", 3, "time")))
    assert rows[40].speed == pytest.approx(10.0)
    assert rows[41].speed == pytest.approx(10.0 - 2.0 * 0.05)
    assert rows[100].speed == pytest.approx(4.0)
    assert rows[100].x - rows[40].x == pytest.approx(21.0, abs=0.16)  # half a step of the sum


@pytest.mark.parametrize(("value", "dimension"), [(-2, "rate"), (2, "rate")])
def test_the_sign_of_a_rate_does_not_matter(tmp_path, value, dimension):
    rows = rows_of(tmp_path, private(speed(to(4), "linear", value, dimension)))
    assert rows[70].speed == pytest.approx(7.0, abs=1e-6)


@pytest.mark.parametrize("value", [0, -1])
def test_no_time_for_a_change_is_a_step(tmp_path, value):
    assert rows_of(tmp_path, private(speed(to(4), "linear", value)))[41].speed == pytest.approx(4.0)


def test_a_change_is_no_faster_than_the_vehicle(tmp_path):
    rows = rows_of(tmp_path, private(speed(to(0), "linear", 20, "rate")))
    assert rows[50].speed == pytest.approx(10.0 - 10.0 * 0.5, abs=1e-6)
    assert rows_of(tmp_path, private(speed(to(99))))[41].speed == pytest.approx(70.0)


def test_a_change_over_a_distance_takes_that_distance(tmp_path):
    rows = rows_of(tmp_path, private(speed(to(4), "linear", 35, "distance")))
    moving = [r for r in rows if 4.0 + 1e-6 < r.speed < 10.0 - 1e-6]
    assert moving[-1].x - moving[0].x == pytest.approx(35.0, abs=1.0)


@pytest.mark.osc("RelativeTargetSpeed")
def test_a_continuous_relative_speed_is_kept(tmp_path):
    follow = """<RelativeTargetSpeed entityRef="ego" value="2" speedTargetValueType="delta"
continuous="true"/>"""
    keep = story(event("keep", private(speed(follow, "linear", 1)), time(1.0)))
    slow = story(
        event("slow", private(speed(to(5), "linear", 2)), time(4.0)), actor="ego", name="b"
    )
    rows = told(tmp_path, stories=keep + slow, end=9.0).of("other")
    assert rows[60].speed == pytest.approx(12.0)
    assert rows[-1].speed == pytest.approx(7.0)


@pytest.mark.osc("SpeedProfileAction")
def test_a_profile_goes_from_speed_to_speed(tmp_path):
    profile = private("""<LongitudinalAction><SpeedProfileAction followingMode="position">
<SpeedProfileEntry speed="14" time="2"/><SpeedProfileEntry speed="6" time="4"/>
</SpeedProfileAction></LongitudinalAction>""")
    rows = rows_of(tmp_path, profile)
    assert rows[60].speed == pytest.approx(12.0, abs=1e-6)
    assert rows[80].speed == pytest.approx(14.0, abs=1e-6)
    assert rows[120].speed == pytest.approx(10.0, abs=1e-6)
    assert rows[-1].speed == pytest.approx(6.0)


def gap(how, limits=""):
    return private(f"""<LongitudinalAction><LongitudinalDistanceAction entityRef="ego" {how}
continuous="true" displacement="leadingReferencedEntity">{limits}</LongitudinalDistanceAction>
</LongitudinalAction>""")


@pytest.mark.osc("LongitudinalDistanceAction")
@pytest.mark.parametrize(
    ("how", "ahead"),
    [
        ('distance="30" freespace="false"', 30.0),
        ('distance="30" freespace="true"', 34.2),
        ('timeGap="2.5" freespace="false"', 25.0),
    ],
)
def test_a_gap_is_kept(tmp_path, how, ahead):
    limits = '<DynamicConstraints maxAcceleration="3" maxDeceleration="3" maxSpeed="40"/>'
    result = told(tmp_path, stories=story(event("e", gap(how, limits), time(1.0))), end=25.0)
    ego, other = result.of("ego")[-1], result.of("other")[-1]
    assert other.x - ego.x == pytest.approx(ahead, abs=0.1)
    assert other.speed == pytest.approx(10.0, abs=0.05)


def test_an_acceleration_grows_no_faster_than_the_file_allows(tmp_path):
    """The other car is 20 m ahead and shall be 60 m: it hurries, then brakes."""
    limits = """<DynamicConstraints maxAcceleration="3" maxDeceleration="3" maxSpeed="40"
maxAccelerationRate="2" maxDecelerationRate="1"/>"""

    def grown(limits):
        how = gap('distance="60" freespace="false"', limits)
        result = told(tmp_path, stories=story(event("e", how, time(1.0))), end=12.0)
        v = [r.speed for r in result.of("other")]
        a = [(q - p) / 0.05 for p, q in itertools.pairwise(v)]
        return [(q, (q - p) / 0.05) for p, q in itertools.pairwise(a)]

    eased, hasty = grown(limits), grown(limits.partition("\n")[0] + "/>")
    assert max(jerk for _, jerk in eased) == pytest.approx(2.0, abs=0.01)
    assert min(jerk for a, jerk in eased if a < 0.0) >= -1.0 - 0.01
    assert max(jerk for _, jerk in hasty) > 10.0


def test_a_gap_without_limits_is_there_at_once(tmp_path):
    how = gap('distance="50" freespace="false"')
    result = told(tmp_path, stories=story(event("e", how, time(1.0))), end=3.0)
    assert result.of("other")[-1].x - result.of("ego")[-1].x == pytest.approx(50.0, abs=0.6)


@pytest.mark.osc("SynchronizeAction")
@pytest.mark.parametrize("final", ["", '<FinalSpeed><AbsoluteSpeed value="8"/></FinalSpeed>'])
def test_two_cars_arrive_at_their_places_together(tmp_path, final):
    meet = private(f"""<SynchronizeAction masterEntityRef="ego" targetTolerance="0.5"
targetToleranceMaster="0.5"><TargetPositionMaster>{on_lane(-3, 250)}</TargetPositionMaster>
<TargetPosition>{on_lane(-1, 240)}</TargetPosition>{final}</SynchronizeAction>""")
    result = told(
        tmp_path, stories=story(event("e", meet, time(1.0))), end=15.0,
        init=at("ego", -3, 100) + at("other", -1, 160, 5),
    )  # fmt: skip
    k = next(k for k, r in enumerate(result.of("ego")) if r.x >= 250.0)
    assert result.of("other")[k].x == pytest.approx(240.0, abs=1.5)
    if final:
        assert result.of("other")[k].speed == pytest.approx(8.0, abs=0.3)


def test_a_steady_last_stretch_is_driven_at_the_final_speed(tmp_path):
    meet = private(f"""<SynchronizeAction masterEntityRef="ego"><TargetPositionMaster>
{on_lane(-3, 250)}</TargetPositionMaster><TargetPosition>{on_lane(-1, 240)}</TargetPosition>
<FinalSpeed><AbsoluteSpeed value="6"><TargetDistanceSteadyState distance="24"/></AbsoluteSpeed>
</FinalSpeed></SynchronizeAction>""")
    result = told(
        tmp_path, stories=story(event("e", meet, time(1.0))), end=15.0,
        init=at("ego", -3, 100) + at("other", -1, 160, 5),
    )  # fmt: skip
    rows = result.of("other")
    assert all(r.speed == pytest.approx(6.0, abs=0.01) for r in rows if 217.0 < r.x < 239.0)
    k = next(k for k, r in enumerate(result.of("ego")) if r.x >= 250.0)
    assert rows[k].x == pytest.approx(240.0, abs=0.5)


def test_the_course_to_a_final_speed_is_two_straight_pieces_of_one_rate(tmp_path):
    """From 5 m/s to 8 m/s over 80 m in 14 s: slower to w = 4.02 m/s, then faster, at 0.354 m/s^2.

    By hand: 14 = x + y, 80 = (5 + w) x / 2 + (8 + w) y / 2 and (5 - w) / x = (8 - w) / y.
    """
    meet = private(f"""<SynchronizeAction masterEntityRef="ego"><TargetPositionMaster>
{on_lane(-3, 250)}</TargetPositionMaster><TargetPosition>{on_lane(-1, 240)}</TargetPosition>
<FinalSpeed><AbsoluteSpeed value="8"/></FinalSpeed></SynchronizeAction>""")
    result = told(
        tmp_path, stories=story(event("e", meet, time(1.0))), end=16.0,
        init=at("ego", -3, 100) + at("other", -1, 155, 5),
    )  # fmt: skip
    rows = result.of("other")
    speeds = [r.speed for r in rows if 1.1 < r.time < 14.5]
    assert min(speeds) == pytest.approx(4.02, abs=0.06)
    steps = sorted(b - a for a, b in itertools.pairwise(speeds))
    assert steps[10] == pytest.approx(-0.354 * 0.05, rel=0.02)
    assert steps[-20] == pytest.approx(0.354 * 0.05, rel=0.02)
    assert rows[300].x == pytest.approx(240.0, abs=0.6)
    assert rows[299].speed == pytest.approx(8.0, abs=0.2)
