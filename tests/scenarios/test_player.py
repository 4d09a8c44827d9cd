"""The player: trajectories to the centimetre, triggers, refusals with element and line."""

from __future__ import annotations

from math import hypot
from pathlib import Path

import numpy as np
import pytest

from skidpad.campaign.runs.run import run
from skidpad.core.courses import ActorMode, Scenario
from skidpad.core.errors import FileError
from skidpad.core.run import Passenger, StackDriver
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.grip.scores import npc_contact_row
from skidpad.physics.presets import preset
from skidpad.scenarios.movement.motion import Shape, Transition
from skidpad.scenarios.reading.findings import HARMLESS, Kind
from skidpad.scenarios.scenario import check, compile_scenario
from support.runs import scenario_run

HEAD = """<?xml version='1.0'?>
<OpenSCENARIO>
  <FileHeader revMajor="1" revMinor="2" date="2026-01-01T00:00:00" description="x" author="x"/>
  <ParameterDeclarations>
    <ParameterDeclaration name="V" parameterType="double" value="10"/>
  </ParameterDeclarations>
  <CatalogLocations/>
  <RoadNetwork><LogicFile filepath="straight.xodr"/></RoadNetwork>
  <Entities>{entities}</Entities>
  <Storyboard><Init><Actions>{init}</Actions></Init>
    <Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1">
      <Actors selectTriggeringEntities="false"><EntityRef entityRef="other"/></Actors>
      <Maneuver name="m">{events}</Maneuver></ManeuverGroup>
      <StartTrigger/></Act></Story>
    <StopTrigger><ConditionGroup><Condition name="end" delay="0" conditionEdge="none">
      <ByValueCondition><SimulationTimeCondition value="{end}" rule="greaterOrEqual"/>
      </ByValueCondition></Condition></ConditionGroup></StopTrigger>
  </Storyboard>
</OpenSCENARIO>
"""
ENTITY = """<ScenarioObject name="{}"><Vehicle name="v" vehicleCategory="car">
<BoundingBox><Center x="0" y="0" z="0.7"/><Dimensions width="1.8" length="4.2" height="1.5"/>
</BoundingBox></Vehicle></ScenarioObject>"""
PLACED = """<Private entityRef="{0}"><PrivateAction><TeleportAction><Position>
<LanePosition roadId="1" laneId="{1}" s="{2}"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="step" value="0" dynamicsDimension="time"/>
<SpeedActionTarget><AbsoluteTargetSpeed value="{3}"/></SpeedActionTarget></SpeedAction>
</LongitudinalAction></PrivateAction></Private>"""
EVENT = """<Event name="{}" priority="parallel"><Action name="x">{}</Action>
<StartTrigger><ConditionGroup><Condition name="c" delay="{}" conditionEdge="none">{}
</Condition></ConditionGroup></StartTrigger></Event>"""
AT_2_S = """<ByValueCondition><SimulationTimeCondition value="2" rule="greaterOrEqual"/>
</ByValueCondition>"""
VANISH = """<GlobalAction><EntityAction entityRef="other"><DeleteEntityAction/></EntityAction>
</GlobalAction>"""
APPEAR = """<GlobalAction><EntityAction entityRef="other"><AddEntityAction><Position>
<WorldPosition x="60" y="-1.75" h="0"/></Position></AddEntityAction></EntityAction></GlobalAction>"""


def slow_down(v=0.0, rate=2.0, shape="linear", dimension="rate"):
    return f"""<PrivateAction><LongitudinalAction><SpeedAction>
<SpeedActionDynamics dynamicsShape="{shape}" value="{rate}" dynamicsDimension="{dimension}"/>
<SpeedActionTarget><AbsoluteTargetSpeed value="{v}"/></SpeedActionTarget></SpeedAction>
</LongitudinalAction></PrivateAction>"""


def trajectory(rows, timing='<Timing domainAbsoluteRelative="absolute" scale="1" offset="0"/>'):
    vertices = "".join(
        f'<Vertex time="{t}"><Position><WorldPosition x="{x}" y="{y}" h="{h}"/></Position></Vertex>'
        for t, x, y, h in rows
    )
    return f"""<PrivateAction><RoutingAction><FollowTrajectoryAction>
<Trajectory name="t" closed="false"><Shape><Polyline>{vertices}</Polyline></Shape></Trajectory>
<TimeReference>{timing}</TimeReference><TrajectoryFollowingMode followingMode="position"/>
</FollowTrajectoryAction></RoutingAction></PrivateAction>"""


def scenario(folder: Path, *events: str, end=6.0, init_more="", other_lane=-1, name="x") -> Path:
    text = HEAD.format(
        entities=ENTITY.format("ego") + ENTITY.format("other"),
        init=PLACED.format("ego", -3, 100, 10) + PLACED.format("other", other_lane, 120, "$V")
        + init_more,
        events="".join(events),
        end=end,
    )  # fmt: skip
    path = folder / f"{name}.xosc"
    path.write_text(text, encoding="utf-8")
    return path


def played(path: Path, **more):
    course = Scenario(actors=more.pop("actors", ActorMode.IDEAL))
    return run(scenario_run(path, course=course, **{"driver": Passenger(), **more}))


def test_a_trajectory_is_followed_to_the_centimetre(tmp_path):
    rows = [
        (t, 120 + 8 * t + 0.4 * t * t, -1.75 + 0.8 * np.sin(t), 0.05 * t)
        for t in np.arange(0.0, 5.01, 0.1)
    ]
    path = scenario(tmp_path, EVENT.format("e", trajectory(rows), 0, AT_2_S.replace("2", "0")))
    log = played(path).log
    source = np.array(rows)
    for k in range(1, 100):
        t = log.t[k]
        x, y = (np.interp(t, source[:, 0], source[:, c]) for c in (1, 2))
        assert hypot(log.actors.x[k, 1] - x, log.actors.y[k, 1] - y) < 0.01, t
        assert log.actors.yaw[k, 1] == pytest.approx(0.05 * t, abs=1e-3)


def test_a_relative_trajectory_counts_from_its_own_begin(tmp_path):
    timing = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'
    rows = [(0.0, 150.0, -1.75, 0.0), (2.0, 170.0, -1.75, 0.0)]
    path = scenario(tmp_path, EVENT.format("e", trajectory(rows, timing), 0, AT_2_S))
    log = played(path).log
    assert log.actors.x[60, 1] == pytest.approx(160.0, abs=0.01)  # 1 s after 2 s
    assert log.actors.x[-1, 1] == pytest.approx(170.0 + 10.0 * 2.0, abs=0.01)  # and drives on


def test_entities_vanish_and_appear(tmp_path):
    late = AT_2_S.replace('"2"', '"4"')
    path = scenario(
        tmp_path, EVENT.format("gone", VANISH, 0, AT_2_S), EVENT.format("back", APPEAR, 0, late)
    )
    log = played(path).log
    there = log.present[:, 1]
    assert there[:40].all()
    assert not there[42:80].any()
    assert there[82:].all()
    assert log.actors.x[81, 1] == pytest.approx(60.0, abs=1.1)


@pytest.mark.parametrize("mode", [ActorMode.IDEAL, ActorMode.PHYSICAL])
def test_a_speed_action_starts_when_its_trigger_fires_and_keeps_its_rate(tmp_path, mode):
    path = scenario(tmp_path, EVENT.format("slow", slow_down(4.0, 2.0), 0, AT_2_S))
    log = played(path, actors=mode).log
    v = np.hypot(log.actors.vx[:, 1], log.actors.vy[:, 1])
    loose = 0.01 if mode is ActorMode.IDEAL else 0.4
    assert v[40] == pytest.approx(10.0, abs=loose)
    assert v[70] == pytest.approx(10.0 - 2.0 * 1.5, abs=0.11 + loose)
    assert v[-1] == pytest.approx(4.0, abs=loose)


def test_a_delay_puts_a_trigger_off(tmp_path):
    path = scenario(tmp_path, EVENT.format("slow", slow_down(0.0, 5.0), 1.5, AT_2_S))
    v = np.hypot(*(column[:, 1] for column in played(path).log.actors[4:6]))
    assert v[70] == pytest.approx(10.0, abs=0.01)
    assert v[75] < 9.0


@pytest.mark.parametrize("mode", [ActorMode.IDEAL, ActorMode.PHYSICAL])
def test_a_lane_change_ends_on_the_other_lane(tmp_path, mode):
    change = """<PrivateAction><LateralAction><LaneChangeAction>
<LaneChangeActionDynamics dynamicsShape="sinusoidal" value="2" dynamicsDimension="time"/>
<LaneChangeTarget><RelativeTargetLane value="-1" entityRef="other"/></LaneChangeTarget>
</LaneChangeAction></LateralAction></PrivateAction>"""
    path = scenario(tmp_path, EVENT.format("change", change, 0, AT_2_S), end=8.0)
    y = played(path, actors=mode).log.actors.y[:, 1]
    assert y[40] == pytest.approx(-1.75, abs=0.02)
    assert y[60] == pytest.approx(-3.5, abs=0.05 if mode is ActorMode.IDEAL else 0.8)
    assert y[-1] == pytest.approx(-5.25, abs=0.05 if mode is ActorMode.IDEAL else 0.2)


@pytest.mark.parametrize("shape", [Shape.LINEAR, Shape.SINUSOIDAL, Shape.CUBIC])
def test_a_change_that_takes_for_ever_has_begun(shape):
    assert Transition(2.0, 7.0, 1e308, shape).at(1.0) == pytest.approx((2.0, 0.0, 0.0))


@pytest.mark.parametrize("shape", list(Shape))
def test_transitions_end_where_they_should_and_their_rates_are_derivatives(shape):
    change = Transition(2.0, 7.0, 3.0, shape)
    assert change.at(3.0)[0] == change.at(9.0)[0] == 7.0
    if shape is Shape.STEP:
        return
    for t in np.linspace(0.2, 2.8, 14):
        h = 1e-5
        before, now, after = (change.at(float(t + d)) for d in (-h, 0.0, h))
        assert now[1] == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-5)
        assert now[2] == pytest.approx((after[1] - before[1]) / (2 * h), abs=1e-4)


@pytest.mark.parametrize(("rule", "happens"), [("lessThan", True), ("greaterThan", False)])
def test_a_parameter_decides_once_for_all(tmp_path, rule, happens):
    asked = f'<ByValueCondition><ParameterCondition parameterRef="V" value="15" rule="{rule}"/>'
    path = scenario(tmp_path, EVENT.format("gone", VANISH, 0, f"{asked}</ByValueCondition>"))
    assert played(path).log.present[-1, 1] != happens
    path.write_text(path.read_text().replace('parameterRef="V"', 'parameterRef="W"'))
    with pytest.raises(FileError, match="parameter 'W' is not declared"):
        compile_scenario(path)


def serious(path, **more):
    return [f for f in check(path, **more).findings if f.kind not in HARMLESS]


def test_everything_unknown_and_wrong_is_listed_at_once_with_its_line(tmp_path):
    odd = "<GlobalAction><NobodyKnowsAction/></GlobalAction>"
    nobody = AT_2_S.replace("SimulationTime", "Tidal")
    path = scenario(
        tmp_path,
        EVENT.format("one", odd, 0, AT_2_S),
        EVENT.format("two", slow_down(shape="ramp"), 0, AT_2_S),
        EVENT.format("three", slow_down(rate="$Nothing"), 0, nobody),
    )
    found = serious(path)
    assert [(f.element, f.kind) for f in found] == [
        ("NobodyKnowsAction", Kind.UNSUPPORTED),
        ("SpeedActionDynamics", Kind.UNSUPPORTED),
        ("SpeedActionDynamics", Kind.ERROR),
        ("TidalCondition", Kind.UNSUPPORTED),
    ]
    lines = path.read_text(encoding="utf-8").splitlines()
    for finding in found:
        assert f"<{finding.element}" in lines[finding.line - 1]
    with pytest.raises(FileError, match=r"x\.xosc, line \d+, <NobodyKnowsAction>"):
        compile_scenario(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('value="$V"', 'value="$W"', "parameter '\\$W' is not declared"),
        ('value="$V"', 'value="${V + W}"', "parameter 'W' is not declared"),
        ('value="$V"', 'value="nan"', "must be a number"),
        ('value="$V"', 'value="inf"', "must be finite"),
        ('s="120"', 's="far"', "must be a number"),
        ('roadId="1" laneId="-', 'roadId="1" laneId="-7', "is not there"),
        ('entityRef="other"', 'entityRef="nobody"', "no entity 'nobody'"),
        ("<OpenSCENARIO>", "<OpenDRIVE>", "not XML"),
        ("straight.xodr", "nowhere.xodr", "no road file"),
        ('revMinor="2"', 'revMinor="9"', "1.9 is not supported"),
        ('dynamicsShape="linear"', 'dynamicsShape="$V"', "dynamicsShape='10'"),
        ('<EntityRef entityRef="other"/>', '<EntityRef entityRef="ghost"/>', "no entity 'ghost'"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, old, new, message):
    path = scenario(tmp_path, EVENT.format("slow", slow_down(), 0, AT_2_S))
    path.write_text(path.read_text(encoding="utf-8").replace(old, new, 1), encoding="utf-8")
    with pytest.raises(FileError, match=message):
        compile_scenario(path)


def test_what_the_schema_forbids_but_is_clear_is_noted_only(tmp_path):
    path = scenario(tmp_path, EVENT.format("slow", slow_down(), 0, AT_2_S))
    found = check(path)
    assert found.scenario is not None
    assert {f.kind for f in found.findings} == {Kind.SCHEMA}  # the fixture leaves out <Performance>


def test_entities_of_xml_are_not_expanded(tmp_path):
    path = scenario(tmp_path, EVENT.format("slow", slow_down(), 0, AT_2_S))
    text = path.read_text(encoding="utf-8").replace(
        "<OpenSCENARIO>", '<!DOCTYPE a [<!ENTITY b SYSTEM "/etc/passwd">]><OpenSCENARIO>', 1
    )
    path.write_text(text, encoding="utf-8")
    with pytest.raises(FileError, match="document type"):
        compile_scenario(path)


def test_a_parameter_can_be_given(tmp_path):
    path = scenario(tmp_path, EVENT.format("slow", slow_down(), 0, AT_2_S))
    assert compile_scenario(path, {"V": 7.5}).start.entities["other"].speed == 7.5
    with pytest.raises(FileError, match="declares no parameter 'U'"):
        compile_scenario(path, {"U": 1.0})


@pytest.mark.req("B-073")
def test_the_ghost_merges_at_its_distance_whatever_the_ego_does():
    a = run(scenario_run("ghost_cut_in")).log.actors
    begin = int(np.argmax(np.abs(a.y[:, 1] + 1.75) > 0.05))
    assert abs(a.x[begin, 1] - a.x[begin, 0]) < 2.0 + 0.5 * 8.0  # half a second of closing speed


@pytest.mark.req("B-094", "B-104")
def test_a_collision_ends_the_run():
    # without a driver's brakes: the ego rolls on into the wreck
    course = Scenario(end_on_collision=True)
    blind = StackDriver("support.scenarios.blind:Blind")
    result = run(scenario_run("front_accident", course=course, driver=blind))
    assert result.outcome is Outcome.COLLISION
    assert len(result.log.contacts) == 1
    assert result.log.contacts[0].tick == result.log.tick[-1]


@pytest.mark.req("B-062", "B-065")
def test_reduced_friction_reaches_ego_and_others_alike():
    spec = scenario_run("lead_slowdown", "statistical", weather=preset("icy_70"), duration=2.0)
    mu = run(spec).log.mu
    assert mu[-1] == pytest.approx(np.full((2, 4), 0.9 * 0.156082), abs=1e-4)


@pytest.mark.req("B-090", "B-091", "B-092")
@pytest.mark.parametrize(
    ("file", "came_from", "others_meet"),
    [
        ("ghost_cut_in", -1.75, False),  # from the lane on the ego's left
        ("lead_slowdown", -5.25, False),
        ("front_accident", -5.25, True),
    ],
)
def test_what_is_ahead_slows_or_meets_another_and_the_ego_brakes_in_time(
    file: str, came_from: float, others_meet: bool
) -> None:
    log = run(scenario_run(file)).log
    a = log.actors
    v = np.hypot(a.vx, a.vy)
    assert a.y[0, 1] == pytest.approx(came_from, abs=0.01)
    assert a.y[-1, 1] == pytest.approx(a.y[-1, 0], abs=0.3)  # in the ego's lane, ahead of it
    assert a.x[-1, 1] > a.x[-1, 0]
    assert v[-1, 1] < 5.0 < v[0, 1]
    assert (npc_contact_row(log) is not None) is others_meet
    assert log.contacts == ()
    assert v[-1, 0] < 5.0 < v[:, 0].max()
    assert log.applied.brake.max() > 0.3
