"""How a scenario begins: places and speeds in their own order, roads, who is there."""

from __future__ import annotations

from math import pi
from shutil import copyfile

import pytest

from skidpad.roads.bundled import FOLDER as MAPS
from skidpad.scenarios.reading.findings import Kind, ScenarioError
from skidpad.scenarios.scenario import check
from support.scenarios.files import (
    at,
    compiled,
    condition,
    init,
    on_lane,
    private,
    speed,
    teleport,
    time,
    to,
    told,
    vehicle,
    write,
)


def relative_speed(value, other, kind="delta", continuous="false"):
    return f"""<RelativeTargetSpeed entityRef="{other}" value="{value}" continuous="{continuous}"
speedTargetValueType="{kind}"/>"""


def beside(other, dx, dy):
    return f'<RelativeObjectPosition entityRef="{other}" dx="{dx}" dy="{dy}"/>'


@pytest.mark.osc("RelativeTargetSpeed")
@pytest.mark.parametrize(("kind", "value", "v"), [("delta", -4, 11.0), ("factor", 0.5, 7.5)])
def test_a_speed_at_the_begin_may_refer_to_one_that_is_said_later(tmp_path, kind, value, v):
    first = init("ego", teleport(on_lane(-3, 100)), speed(relative_speed(value, "other", kind)))
    scenario = compiled(tmp_path, init=first + at("other", -1, 120, 15))
    assert scenario.start.entities["ego"].speed == pytest.approx(v)


def test_places_are_worked_out_in_the_order_of_their_references(tmp_path):
    chain = init("a", teleport(beside("b", -10, 0))) + init("b", teleport(beside("ego", -10, 3.5)))
    scenario = compiled(
        tmp_path, entities=vehicle("a") + vehicle("b") + vehicle("ego"),
        init=chain + at("ego", -3, 100),
    )  # fmt: skip
    pose = {n: b.place.pose for n, b in scenario.start.entities.items()}
    assert pose["a"].x == pytest.approx(pose["ego"].x - 20.0)
    assert pose["a"].y == pytest.approx(pose["ego"].y + 3.5)


@pytest.mark.parametrize("what", ["place", "speed"])
def test_a_circle_of_references_is_an_error(tmp_path, what):
    if what == "place":
        wish = init("ego", teleport(beside("other", 1, 0))) + init(
            "other", teleport(beside("ego", 1, 0))
        )
    else:
        wish = init("ego", teleport(on_lane(-3, 100)), speed(relative_speed(1, "other"))) + init(
            "other", teleport(on_lane(-1, 100)), speed(relative_speed(1, "ego"))
        )
    with pytest.raises(ScenarioError, match=f"the {what} of '.*' depends on itself"):
        compiled(tmp_path, init=wish)


def test_a_second_teleport_may_start_from_the_first(tmp_path):
    turned = f"""<RelativeRoadPosition entityRef="ego" ds="0" dt="0">
<Orientation h="{pi}" type="relative"/></RelativeRoadPosition>"""
    wish = init("ego", teleport(on_lane(-1, 100)), teleport(turned))
    place = compiled(tmp_path, init=wish + at("other", -3, 50)).start.entities["ego"].place
    assert place.pose.x == pytest.approx(100.0, abs=0.01)
    assert abs(place.pose.yaw) == pytest.approx(pi, abs=1e-6)


@pytest.mark.osc("TeleportAction")
def test_the_reference_point_is_where_the_file_puts_it_not_the_middle_of_the_box(tmp_path):
    result = told(tmp_path, entities=vehicle("ego") + vehicle("other", x=1.4), end=1.0)
    first, last = result.of("other")[0], result.of("other")[-1]
    assert first.x == pytest.approx(120.0, abs=1e-3)
    assert last.x == pytest.approx(130.0, abs=1e-3)


def test_what_is_put_nowhere_stands_at_the_origin_unless_it_is_added_later(tmp_path):
    entities = vehicle("ego") + vehicle("other") + vehicle("third")
    scenario = compiled(tmp_path, entities=entities)
    assert scenario.start.entities["third"].place.pose.x == 0.0
    add = """<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"/><Maneuver name="m"><Event name="e" priority="parallel">
<Action name="x"><GlobalAction><EntityAction entityRef="third"><AddEntityAction><Position>
<WorldPosition x="9" y="0" h="0"/></Position></AddEntityAction></EntityAction></GlobalAction></Action>
</Event></Maneuver></ManeuverGroup><StartTrigger>{}</StartTrigger></Act></Story>"""
    later = add.format(condition(time(2.0)))
    scenario = compiled(tmp_path, entities=entities, stories=later)
    assert scenario.start.entities["third"].place is None


def test_a_road_beside_the_file_is_taken_before_the_bundled_one_of_that_name(tmp_path):
    copyfile(MAPS / "town.xodr", tmp_path / "straight.xodr")
    road = compiled(tmp_path, init=at("ego", -1, 5) + at("other", -1, 5)).map
    assert road.name == "straight"
    assert len(set(road.lanes.road.tolist())) > 3
    (tmp_path / "straight.xodr").unlink()
    assert len(set(compiled(tmp_path).map.lanes.road.tolist())) == 1


def test_a_bundled_road_is_found_by_its_bare_name_only(tmp_path):
    bare = compiled(tmp_path, road='<LogicFile filepath="straight"/>')
    assert bare.map_name == "straight"
    with pytest.raises(ScenarioError, match="no road file"):
        compiled(tmp_path, road='<LogicFile filepath="../maps/straight.xodr"/>')
    elsewhere = tmp_path / "roads"
    elsewhere.mkdir()
    copyfile(MAPS / "straight.xodr", elsewhere / "Town99.xodr")
    path = write(tmp_path, road='<LogicFile filepath="Town99"/>')
    assert check(path).scenario is None
    assert check(path, maps=[elsewhere]).scenario is not None


def test_a_file_without_a_road_has_a_plain_one(tmp_path):
    assert compiled(tmp_path, road="").map_name == "straight"


def test_a_story_without_events_and_without_a_stop_trigger_does_not_end_what_init_begins(tmp_path):
    empty = """<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"/></ManeuverGroup><StartTrigger/></Act></Story>"""
    assert told(tmp_path, stories=empty, stop="").rows[-1].time == pytest.approx(60.0, abs=0.1)


def test_a_place_beyond_the_end_of_its_lane_is_moved_there_and_noted(tmp_path):
    path = write(tmp_path, init=at("ego", -3, 100) + at("other", -1, 9120))
    found = check(path)
    assert found.scenario is not None
    assert found.scenario.start.entities["other"].place.pose.x == pytest.approx(1500.0, abs=0.5)
    assert any(f.kind is Kind.NOTE and f.what.startswith("s = 9120") for f in found.findings)


def test_unknown_things_can_be_left_out_on_request(tmp_path):
    odd = "<GlobalAction><NobodyKnowsAction/></GlobalAction>"
    path = write(tmp_path, init=odd + at("ego", -3, 100) + at("other", -1, 120))
    assert check(path).scenario is None
    assert check(path, ignore_unsupported=True).scenario is not None
    wrong = private(speed(to("$nothing")))
    path = write(
        tmp_path, init=at("ego", -3, 100) + f'<Private entityRef="other">{wrong}</Private>'
    )
    assert check(path, ignore_unsupported=True).scenario is None
