"""What a stopped action leaves behind, which of two actions wins, and whom actions refer to."""

import pytest

from skidpad.core.courses import ActorMode
from skidpad.core.geometry import Pose
from skidpad.core.setup import DT, ActorCommand
from skidpad.scenarios.movement.motion import Guide
from skidpad.scenarios.playing.player import Player
from skidpad.scenarios.playing.stage import IdealWorld
from skidpad.simulation.scripted import Motion
from support.scenarios.files import (
    at,
    by_entity,
    compiled,
    condition,
    event,
    on_lane,
    private,
    speed,
    state,
    story,
    teleport,
    time,
    to,
    told,
)

V_EGO = 20.0  # m/s, twice what its file says
Y_EGO = -5.25  # m, the lane -2, where its file says -3
CHANGE = private(
    '<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="linear" value="4"'
    ' dynamicsDimension="time"/><LaneChangeTarget><AbsoluteTargetLane value="-2"/>'
    "</LaneChangeTarget></LaneChangeAction></LateralAction>"
)
LATER = time(3)
STRAIGHT, ASLANT = 0.0, 1.5  # m to the left in each second


def follow(aside, seconds=8):
    rows = "".join(
        f'<Vertex time="{k}"><Position><WorldPosition x="{130 + 10 * k}" y="{-1.75 + aside * k}"/>'
        "</Position></Vertex>"
        for k in range(seconds + 1)
    )
    return private(
        '<RoutingAction><FollowTrajectoryAction><TrajectoryRef><Trajectory name="t" closed="false">'
        f"<Shape><Polyline>{rows}</Polyline></Shape></Trajectory></TrajectoryRef><TimeReference>"
        '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/></TimeReference>'
        '<TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction></RoutingAction>'
    )


def halted(story_text, t):
    """The story's act with a stop trigger."""
    return story_text.replace("</Act>", f"<StopTrigger>{condition(time(t))}</StopTrigger></Act>")


def row(done, t, name="other"):
    return min(done.of(name), key=lambda r: abs(r.time - t))


def test_a_lane_change_that_is_stopped_goes_straight_on_at_its_speed(tmp_path):
    done = told(tmp_path, stories=halted(story(event("e", CHANGE, time(1))), 3))
    a, b = row(done, 4), row(done, 6)
    assert a.y == pytest.approx(-3.5, abs=1e-6)  # half of the way
    assert b.h == pytest.approx(0.0, abs=1e-9)
    assert b.x - a.x == pytest.approx(20.0, abs=1e-6)


def test_a_trajectory_that_is_stopped_is_left_for_the_lane(tmp_path):
    done = told(tmp_path, stories=halted(story(event("e", follow(ASLANT), time(1))), 3))
    assert row(done, 6).y == pytest.approx(row(done, 3.1).y, abs=1e-6)


def test_a_change_of_speed_that_is_stopped_asks_for_no_more(tmp_path):
    faster = private(speed(to(30), "linear", 6))
    done = told(tmp_path, stories=halted(story(event("e", faster, time(1))), 4))
    guide = done.player.actors["other"].guide
    assert (guide.v, guide.a) == (pytest.approx(20.0, abs=0.2), 0.0)


@pytest.mark.parametrize(
    ("action", "end"), [(CHANGE, -5.25), (private(speed(to(20))), -1.75)], ids=["lane", "speed"]
)
def test_the_newer_action_wins_against_a_trajectory_with_times(tmp_path, action, end):
    stories = story(event("e", follow(STRAIGHT), time(1)), event("f", action, time(2)))
    done = told(tmp_path, stories=stories, end=9.0)
    assert row(done, 8).y == pytest.approx(end, abs=1e-3)
    assert row(done, 8).speed == pytest.approx(20.0 if end == -1.75 else 10.0)


def with_a_stack(folder, action, when=LATER, **parts):
    """Played with an ego that drives itself: at V_EGO, from 1 s on on another lane."""
    scenario = compiled(folder, stories=story(event("e", action, when)), end=20.0, **parts)
    stage, modes = IdealWorld(scenario), dict.fromkeys(scenario.entities, ActorMode.IDEAL)
    player = Player(scenario, modes=modes | {"ego": None})
    begin = scenario.start.entities["ego"].place.pose
    while True:
        words = list(player.step(stage.truth()))
        if player.ended:
            return player.actors
        t = (stage.tick + 1) * DT
        place = Pose(begin.x + V_EGO * t, Y_EGO if t > 1.0 else begin.y, yaw=begin.yaw)
        stage.step([*words, ActorCommand("ego", place=place, speed=V_EGO)])


def test_a_speed_relative_to_an_ego_under_a_stack_is_to_its_own(tmp_path):
    target = (
        '<RelativeTargetSpeed entityRef="ego" value="2" speedTargetValueType="delta"'
        ' continuous="false"/>'
    )
    actors = with_a_stack(tmp_path, private(speed(target)))
    assert actors["other"].v == pytest.approx(V_EGO + 2.0)


def test_a_lane_relative_to_an_ego_under_a_stack_is_beside_where_it_is(tmp_path):
    change = private(
        '<LateralAction><LaneChangeAction><LaneChangeActionDynamics dynamicsShape="linear" value="1"'
        ' dynamicsDimension="time"/><LaneChangeTarget><RelativeTargetLane entityRef="ego" value="0"/>'
        "</LaneChangeTarget></LaneChangeAction></LateralAction>"
    )
    assert with_a_stack(tmp_path, change)["other"].pose.y == pytest.approx(Y_EGO, abs=1e-3)


def test_a_place_relative_to_an_ego_under_a_stack_is_seen_from_where_it_is(tmp_path):
    place = '<RelativeLanePosition entityRef="ego" dLane="0" ds="10"/>'
    actors = with_a_stack(tmp_path, private(teleport(place)))
    ego, other = actors["ego"].pose, actors["other"].pose
    late = 17.0 * (V_EGO - 10.0)  # m that the ego gains until the end
    assert ego.x - other.x == pytest.approx(late - 10.0, abs=1.5)
    assert other.y == pytest.approx(Y_EGO, abs=1e-6)


def test_a_gap_to_an_ego_under_a_stack_is_kept(tmp_path):
    gap = private(
        '<LongitudinalAction><LongitudinalDistanceAction entityRef="ego" distance="20"'
        ' freespace="false" continuous="true" displacement="trailingReferencedEntity">'
        '<DynamicConstraints maxAcceleration="5" maxDeceleration="8" maxSpeed="50"/>'
        "</LongitudinalDistanceAction></LongitudinalAction>"
    )
    actors = with_a_stack(tmp_path, gap, init=at("ego", -3, 100) + at("other", -3, 70))
    step = V_EGO * DT  # whom the file places is told where to be a step later
    assert actors["ego"].pose.x + step - actors["other"].pose.x == pytest.approx(20.0, abs=0.1)


def test_an_offset_that_is_continuous_never_ends_and_follows_its_reference(tmp_path):
    offset = private(
        '<LateralAction><LaneOffsetAction continuous="true"><LaneOffsetActionDynamics'
        ' dynamicsShape="linear" maxLateralAcc="3"/><LaneOffsetTarget><RelativeTargetLaneOffset'
        ' entityRef="ego" value="0"/></LaneOffsetTarget></LaneOffsetAction></LateralAction>'
    )
    aside = private(teleport(on_lane(-2, 300)))
    then = event("f", private(speed(to(20))), state("event", "e", "endTransition"))
    stories = story(event("e", offset, time(1)), then) + story(
        event("g", aside, time(6)), actor="ego", name="second"
    )
    done = told(tmp_path, stories=stories, end=14.0)
    assert row(done, 5).y == pytest.approx(-8.75, abs=1e-3)
    assert row(done, 13).y == pytest.approx(-5.25, abs=1e-3)
    assert row(done, 13).speed == pytest.approx(10.0)


def test_a_sideways_distance_that_is_reached_leaves_no_lean(tmp_path):
    aside = private(
        '<LateralAction><LateralDistanceAction entityRef="ego" distance="4" freespace="false"'
        ' continuous="false"><DynamicConstraints maxSpeed="1"/></LateralDistanceAction></LateralAction>'
    )
    done = told(tmp_path, stories=story(event("e", aside, time(1))))
    assert row(done, 6).y == pytest.approx(-4.75, abs=1e-2)
    assert row(done, 6).h == pytest.approx(0.0, abs=1e-9)


def test_a_word_is_not_added_to(tmp_path):
    def change(name, t, how):
        action = (
            f'<GlobalAction><VariableAction variableRef="n">{how}</VariableAction></GlobalAction>'
        )
        return event(name, action, time(t))

    add = '<ModifyAction><Rule><AddValue value="1"/></Rule></ModifyAction>'
    done = told(
        tmp_path,
        variables='<VariableDeclarations><VariableDeclaration name="n" variableType="string"'
        ' value="3"/></VariableDeclarations>',
        stories=story(change("a", 1, '<SetAction value="abc"/>'), change("b", 2, add)),
    )
    assert done.player.scene.variables == {"n": "abc"}
    assert "is no number" in " ".join(done.player.scene.notices)


def test_height_is_that_of_the_ground_for_whom_the_file_does_not_place(tmp_path):
    scenario = compiled(tmp_path)
    stage, player = IdealWorld(scenario), Player(scenario, modes={"ego": None})
    player.step(stage.truth())
    stage.step([ActorCommand("ego", place=Pose(102.0, -8.75, 12.0), speed=40.0)])
    player.step(stage.truth())
    assert player.actors["ego"].pose.z == 12.0


def test_who_drives_itself_past_the_end_of_the_road_is_there(tmp_path):
    """The road is 1500 m long."""
    past = by_entity('<EndOfRoadCondition duration="0.5"/>')
    actors = with_a_stack(
        tmp_path, private(speed(to(17))), init=at("ego", -3, 1400) + at("other", -1, 120), when=past
    )
    assert actors["other"].v == pytest.approx(17.0)


def test_a_driver_is_asked_to_stop_at_the_end_of_the_road(tmp_path):
    network = compiled(tmp_path).network
    guide = Guide(network, network.on_lane(1, -1, 1490.0, 0.0), 20.0)
    inside = guide.demand(Motion(1495.0, -1.75, 0.0, 20.0, 0.0))
    outside = guide.demand(Motion(1502.0, -1.75, 0.0, 20.0, 0.0))
    assert (inside.v, outside.v, guide.at_end) == (20.0, 0.0, True)
