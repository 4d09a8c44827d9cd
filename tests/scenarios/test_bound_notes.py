"""Where a bound acts, one note names element, asked and applied value; nothing else is bounded."""

from __future__ import annotations

import pytest

from support.oracle.actions import (
    beside,
    gap,
    lane_change,
    lane_offset,
    limits,
    relative,
    round_profile,
    smooth_profile,
)
from support.scenarios.files import (
    at,
    compiled,
    event,
    init,
    on_lane,
    private,
    speed,
    story,
    synchronize,
    teleport,
    time,
    to,
    told,
    trajectory,
    vehicle,
    world,
)


def notes(tmp_path, *actions, entities=None, **parts):
    """What the log says of actions that `other` begins at 1 s."""
    events = (event(f"e{k}", private(a), time(0.975)) for k, a in enumerate(actions))
    values = {"stories": story(*events), "entities": entities or vehicle("ego") + vehicle("other")}
    found = told(tmp_path, **values | parts)
    return [n for n in found.player.scene.notices if "asked" in n], found


def slow(**limits_of):
    body = vehicle("other")
    for name, value in limits_of.items():
        usual = {"maxSpeed": 70, "maxDeceleration": 10, "maxAcceleration": 10}[name]
        body = body.replace(f'{name}="{usual}"', f'{name}="{value}"')
    return vehicle("ego") + body


@pytest.mark.parametrize(
    ("action", "limits_of", "note"),
    [
        (
            speed(to(30), "linear", 5),
            {"maxSpeed": 25},
            "<SpeedAction> of other: speed 30 m/s asked, 25 m/s applied (maxSpeed)",
        ),
        (
            speed(to(20), "linear", 2),
            {"maxAcceleration": 2},
            "<SpeedAction> of other: duration 2 s asked, 5 s applied (maxAcceleration)",
        ),
        (
            speed(to(4), "linear", 6, "rate"),
            {"maxDeceleration": 3},
            "<SpeedAction> of other: duration 1 s asked, 2 s applied (maxDeceleration)",
        ),
        (
            gap('distance="40" freespace="false"', continuous=True, side="ahead", limits=limits(8, 4)),
            {"maxAcceleration": 5},
            (
                "<LongitudinalDistanceAction> of other: maxAcceleration 8 m/s^2 asked, "
                "5 m/s^2 applied (that of its <Performance>)"
            ),
        ),
    ],
)  # fmt: skip
def test_a_bound_of_performance_is_noted_once(tmp_path, action, limits_of, note):
    found, _ = notes(tmp_path, action, entities=slow(**limits_of), end=8.0)
    assert found == [note]


def test_a_speed_that_is_kept_to_another_one_is_bounded_and_noted_once(tmp_path):
    """The ego reaches 20 m/s within 1 s; the other one may gain 2 m/s in a second."""
    action = speed(relative(0, continuous=True), "linear", 0.5)
    ego = story(
        event("ego_e", private(speed(to(20), "linear", 1)), time(1.975)), actor="ego", name="b"
    )
    stories = story(event("e", private(action), time(0.975))) + ego
    found, _ = notes(tmp_path, stories=stories, entities=slow(maxAcceleration=2), end=6.0)
    (note,) = found
    assert note.startswith("<SpeedAction> of other: ")
    assert note.endswith("2 m/s^2 applied (maxAcceleration)")


def test_the_acceleration_of_a_profile_is_bounded_and_noted(tmp_path):
    action = smooth_profile(20, up=2, down=2).replace('"follow"', '"position"')
    found, _ = notes(tmp_path, action, entities=slow(maxAcceleration=2), end=6.0)
    (note,) = found
    assert note.startswith("<SpeedProfileAction> of other: maxAcceleration 3 m/s^2 asked, 2 m/s^2 ")
    assert note.endswith("(that of its <Performance> or 10)")


def test_the_time_of_a_rounded_profile_is_bounded_and_noted(tmp_path):
    """30 m/s in 2 s are 10 m/s^2; the file allows 5."""
    found, _ = notes(tmp_path, round_profile((30, 2), (20, 4)), end=9.0)
    assert found == [
        (
            "<SpeedProfileAction> of other: duration 2 s asked, 4 s applied "
            "(limits of <Performance> and of the file)"
        )
    ]


@pytest.mark.parametrize(
    ("action", "note"),
    [
        (
            beside(2.5, "left", axes="road", limits='maxSpeed="3"'),
            "speed to the side 3 m/s asked, 0.999999 m/s applied (it goes no faster)",
        ),
        (
            beside(2.5, "left", limits='maxAcceleration="2000"'),
            (
                "maxAcceleration 2000 m/s^2 asked, 3 m/s^2 applied "
                "(0.001 to 1000 m/s^2 and a turn of 0.5 m or more)"
            ),
        ),
    ],
)
def test_a_distance_aside_is_closed_within_bounds_that_are_noted_once(tmp_path, action, note):
    begins = at("ego", -3, 100, 1) + at("other", -1, 100, 1)
    found, _ = notes(tmp_path, action, init=begins, end=6.0)
    assert found == [f"<LateralDistanceAction> of other: {note}"]


def test_an_offset_that_is_kept_is_bounded_by_the_own_speed_and_noted_once(tmp_path):
    """The ego goes aside by 3 m at once; the other one, which keeps its side, goes at 1 m/s."""
    keeps = lane_offset(3.5, "step", other="ego").replace('continuous="false"', 'continuous="true"')
    ego = story(
        event("ego_e", private(lane_offset(3.0, "step")), time(1.975)), actor="ego", name="b"
    )
    stories = story(event("e", private(keeps), time(0.975))) + ego
    begins = at("ego", -2, 100, 20) + at("other", -1, 120, 1)
    found, _ = notes(tmp_path, init=begins, stories=stories, end=4.0)
    (note,) = found
    assert note.startswith("<LaneOffsetAction> of other: speed to the side ")
    assert note.endswith(" 1 m/s applied (it goes no faster)")


def test_a_meeting_that_asks_to_stop_too_late_is_noted_once(tmp_path):
    """9 s and 6 m before the meeting at 5 m/s it has to stop from 20 m/s: 35 m/s^2."""
    final = '<FinalSpeed><AbsoluteSpeed value="5"/></FinalSpeed>'
    action = synchronize("ego", on_lane(-3, 200), on_lane(-1, 146), final)
    begins = at("ego", -3, 100, 10) + at("other", -1, 120, 20)
    found, _ = notes(tmp_path, action, init=begins, end=6.0)
    (note,) = found
    assert note.startswith("<SynchronizeAction> of other: deceleration ")
    assert note.endswith("8 m/s^2 applied (of an entity that stops on the way)")


def test_no_entity_goes_sideways_faster_than_it_goes_and_the_log_says_so(tmp_path):
    """3.5 m in 1 s by a cubic are 5.25 m/s at most; it goes at 2 m/s."""
    change = lane_change('<AbsoluteTargetLane value="-2"/>', "cubic", 1.0)
    begins = at("ego", -3, 100) + at("other", -1, 120, 2)
    found, _ = notes(tmp_path, change, init=begins)
    (note,) = found
    assert note.startswith("<LaneChangeAction> of other: speed to the side ")
    assert note.endswith(" 2 m/s applied (it goes no faster)")


def test_a_line_that_it_cannot_turn_is_noted_once(tmp_path):
    path = trajectory((0, 0), (20, 0), (20, 40), following="follow")
    begins = at("ego", -3, 100) + init("other", teleport(world(0, 0, 0)), speed(to(8)), path)
    found, _ = notes(tmp_path, init=begins, end=6.0)
    (note,) = found
    assert note.startswith("<FollowTrajectoryAction> of other: curvature 0.")
    assert "0.109375 1/m applied (maxSteering or 7 m/s^2 to the side)" in note


def test_what_no_bound_touches_is_as_the_file_says_and_is_not_noted(tmp_path):
    """A step without a limit on speed and a teleport: there at once, whatever `Performance` says."""
    place = teleport(on_lane(-1, 400))
    found, result = notes(tmp_path, place, speed(to(60)), entities=slow(maxAcceleration=1))
    assert found == []
    rows = {round(row.time, 2): row for row in result.of("other")}
    assert rows[1.0].speed == pytest.approx(10.0)
    assert rows[1.05].x == pytest.approx(400.0)
    assert rows[1.1].speed == pytest.approx(60.0)


def test_a_speed_at_the_begin_beyond_the_vehicles_is_a_note_of_the_check(tmp_path):
    begins = at("ego", -3, 100) + at("other", -1, 120, 80)
    scenario = compiled(tmp_path, init=begins)
    (note,) = [str(f) for f in scenario.findings if "asked" in str(f)]
    assert "x.xosc" in note
    assert "speed of 'other' at the begin: 80 m/s asked, 70 m/s applied (maxSpeed)" in note
