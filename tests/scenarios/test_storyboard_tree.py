"""The storyboard as a tree of text, by value."""

import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.scenarios.scenario import compile_scenario
from skidpad.scenarios.shipped import FOLDER
from skidpad.scenarios.tree import storyboard_tree

CUT_IN = """\
ghost_cut_in.xosc: can be played
story story
  act act
    starts when start: SimulationTimeCondition value=0.0 rule=greaterOrEqual
    group ghost_group: ghost
      manoeuvre ghost_manoeuvre
        event merge, parallel
          when near_the_ego: ghost: RelativeDistanceCondition value=12 freespace=false \
entityRef=ego rule=lessThan relativeDistanceType=longitudinal coordinateSystem=entity
          -> merge_lane: LaneChangeAction [LaneChangeActionDynamics dynamicsShape=sinusoidal \
value=2.0 dynamicsDimension=time; RelativeTargetLane value=-1 entityRef=ghost]
        event slow, parallel
          when merged: StoryboardElementStateCondition storyboardElementType=event \
storyboardElementRef=merge state=completeState
          -> slow_speed: SpeedAction [SpeedActionDynamics dynamicsShape=linear value=5.0 \
dynamicsDimension=rate; AbsoluteTargetSpeed value=4.0]
ends when over: StoryboardElementStateCondition storyboardElementType=event \
storyboardElementRef=slow state=completeState, delay 12 s
or ego_stands: ego: StandStillCondition duration=3.0
or time_is_up: SimulationTimeCondition value=40.0 rule=greaterOrEqual
"""


@pytest.mark.req("B-073")
def test_the_tree_of_the_cut_in_has_its_conditions_and_actions_with_the_values_asked_for():
    call = ["play", "ghost_cut_in", "--tree", "--param", "MergeDistance=12"]
    done = CliRunner().invoke(app, call, catch_exceptions=False)
    assert done.exit_code == 0
    assert done.stdout == CUT_IN
    checked = CliRunner().invoke(app, ["play", "ghost_cut_in", "--check"], catch_exceptions=False)
    assert checked.stdout == CUT_IN.splitlines(keepends=True)[0], "a check prints no tree"


def test_the_tree_tells_counts_edges_several_entities_and_long_lists_in_short(tmp_path):
    text = (FOLDER / "ghost_cut_in.xosc").read_text(encoding="utf-8")
    both = '<EntityRef entityRef="ghost" /><EntityRef entityRef="ego" />'
    ways = "".join(
        f'<Waypoint routeStrategy="shortest"><Position><LanePosition roadId="1" laneId="-1" '
        f's="{s}" /></Position></Waypoint>'
        for s in range(50, 150, 10)
    )
    route = f'<Route name="way" closed="false">{ways}</Route>'
    action = f"<RoutingAction><AssignRouteAction>{route}</AssignRouteAction></RoutingAction>"
    before, lateral = text.split("<LateralAction>")
    text = before + action + lateral.split("</LateralAction>")[1]
    for old, new in (
        ("straight.xodr", str(FOLDER / "straight.xodr")),
        ('selectTriggeringEntities="false"', 'selectTriggeringEntities="true"'),
        ('name="near_the_ego" delay="0.0" conditionEdge="none"',
         'name="near_the_ego" delay="0.5" conditionEdge="rising"'),
        ('"any">\n                        <EntityRef entityRef="ghost" />', f'"all">{both}'),
        ('"merge" priority="parallel" maximumExecutionCount="1"',
         '"merge" priority="override" maximumExecutionCount="3"'),
    ):  # fmt: skip
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    file = tmp_path / "odd.xosc"
    file.write_text(text, encoding="utf-8")
    lines = [s.strip() for s in storyboard_tree(compile_scenario(file).storyboard).splitlines()]
    assert lines[3] == "group ghost_group: ghost, entities that trigger an event"
    assert lines[5] == "event merge (at most 3 times), override"
    assert lines[6].startswith("when near_the_ego: all of ghost, ego: RelativeDistanceCondition ")
    assert lines[6].endswith("coordinateSystem=entity, rising, delay 0.5 s")
    assert lines[7].startswith("-> merge_lane: AssignRouteAction [Route name=way closed=false; Way")
    assert lines[7].endswith("LanePosition roadId=1 laneId=-1 s=70; Waypoint "
                             "routeStrategy=shortest; ...]")  # fmt: skip
