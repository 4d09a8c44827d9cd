"""A cut-in as other tools write them, untouched, under our stack and by itself."""

from __future__ import annotations

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.recording.run.log_files import read_log
from support.scenarios.files import FILE, ROAD, VEHICLE, document

CATALOG = document('<Catalog name="VehicleCatalog">{entries}</Catalog>', minor=1)
CAR = VEHICLE.format(x=1.4).replace('name="v"', 'name="{name}"')
DECLARED = "".join(
    f'<ParameterDeclaration name="{name}" parameterType="{kind}" value="{value}"/>'
    for name, kind, value in (
        ("EgoSpeed", "double", "${60 / 3.6}"),
        ("CutInSpeed", "double", "${0.8 * $EgoSpeed}"),
        ("Headway", "double", "25"),
        ("EgoLane", "integer", "-2"),
    )
)
ENTITIES = """<ScenarioObject name="Ego"><CatalogReference catalogName="VehicleCatalog"
entryName="car_white"/><ObjectController><Controller name="c"><Properties/></Controller>
</ObjectController></ScenarioObject><ScenarioObject name="Target"><CatalogReference
catalogName="VehicleCatalog" entryName="car_red"/></ScenarioObject>"""
PLACED = """<Private entityRef="{0}"><PrivateAction><TeleportAction><Position><LanePosition
roadId="1" laneId="{1}" offset="0" s="{2}"/></Position></TeleportAction></PrivateAction>
<PrivateAction><LongitudinalAction><SpeedAction><SpeedActionDynamics dynamicsShape="step"
dynamicsDimension="time" value="0"/><SpeedActionTarget><AbsoluteTargetSpeed value="{3}"/>
</SpeedActionTarget></SpeedAction></LongitudinalAction></PrivateAction></Private>"""
STORY = """<Story name="S"><ParameterDeclarations/>
<Act name="A"><ManeuverGroup maximumExecutionCount="1" name="E"><Actors
selectTriggeringEntities="false"><EntityRef entityRef="Ego"/></Actors><Maneuver name="On">
<Event name="HandOver" priority="{override}"><Action name="x"><PrivateAction>
<ControllerAction><ActivateControllerAction longitudinal="true" lateral="true"/>
</ControllerAction></PrivateAction></Action><StartTrigger>
<ConditionGroup><Condition name="after" delay="0" conditionEdge="rising"><ByValueCondition>
<SimulationTimeCondition value="1" rule="greaterThan"/></ByValueCondition></Condition>
</ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup>
<ManeuverGroup maximumExecutionCount="1" name="T"><Actors selectTriggeringEntities="false">
<EntityRef entityRef="Target"/></Actors><Maneuver name="CutIn"><Event name="Change"
priority="{override}"><Action name="y"><PrivateAction><LateralAction><LaneChangeAction>
<LaneChangeActionDynamics dynamicsShape="sinusoidal" value="3" dynamicsDimension="time"/>
<LaneChangeTarget><RelativeTargetLane entityRef="Ego" value="0"/></LaneChangeTarget>
</LaneChangeAction></LateralAction></PrivateAction></Action><StartTrigger><ConditionGroup>
<Condition name="near" delay="0" conditionEdge="none"><ByEntityCondition><TriggeringEntities
triggeringEntitiesRule="any"><EntityRef entityRef="Ego"/></TriggeringEntities><EntityCondition>
<RelativeDistanceCondition entityRef="Target" relativeDistanceType="longitudinal"
value="$Headway" freespace="false" coordinateSystem="road" rule="lessThan"/></EntityCondition>
</ByEntityCondition></Condition></ConditionGroup></StartTrigger></Event></Maneuver>
</ManeuverGroup><StartTrigger><ConditionGroup><Condition name="begin" delay="0"
conditionEdge="none"><ByValueCondition><SimulationTimeCondition value="0" rule="greaterThan"/>
</ByValueCondition></Condition></ConditionGroup></StartTrigger></Act></Story>"""
STOP = """<ConditionGroup><Condition name="end" delay="0" conditionEdge="rising"><ByValueCondition>
<SimulationTimeCondition value="14" rule="greaterThan"/></ByValueCondition></Condition>
</ConditionGroup>"""
CATALOGS = '<VehicleCatalog><Directory path="./catalogs"/></VehicleCatalog>'


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    folder = tmp_path_factory.mktemp("foreign")
    (folder / "catalogs").mkdir()
    cars = "".join(CAR.replace("{name}", name) for name in ("car_white", "car_red"))
    (folder / "catalogs" / "cars.xosc").write_text(CATALOG.format(entries=cars))
    path = folder / "cut_in.xosc"
    path.write_text(
        FILE.format(
            minor=1, parameters=DECLARED, variables="", catalogs=CATALOGS, road=ROAD,
            entities=ENTITIES, stories=STORY.format(override="overwrite"), stop=STOP,
            init=PLACED.format("Ego", "$EgoLane", "50", "$EgoSpeed")
            + PLACED.format("Target", "${$EgoLane + 1}", "${50 + 1.5 * $Headway}", "$CutInSpeed"),
        ),
        encoding="utf-8",
    )  # fmt: skip
    return path


def drive(file, controller, *more):
    out = file.parent / controller
    words = ["play", str(file), "--out", str(out), "--stack", controller, "--weather"]
    done = CliRunner().invoke(app, [*words, "rain-noon", *more])
    assert done.exit_code == 0, done.output
    log = read_log(out)
    story = (out / "storyboard.csv").read_text().splitlines()
    return log, story, log.table.names.index("Target")


def test_our_stack_takes_over_when_the_file_says_so_and_brakes_behind_who_cuts_in(file):
    log, story, target = drive(file, "2")
    handed = next(r for r in story if "HandOver" in r and "startTransition" in r)
    assert 1.0 < float(handed.split(",")[0]) < 1.2
    cut = next(r for r in story if "Change" in r and "startTransition" in r)
    t_cut = float(cut.split(",")[0])
    assert 2.0 < t_cut < 8.0
    first = log.t <= 1.0
    assert log.v_ego[first] == pytest.approx(60 / 3.6, abs=0.3)  # until then the file drives
    assert not log.contacts
    a = log.actors
    assert abs(a.y[-1, target] - a.y[-1, 0]) < 0.8  # in one lane in the end
    assert a.x[-1, target] - a.x[-1, 0] > 5.0
    assert log.v_ego[-1] < 60 / 3.6 - 1.0  # it has slowed down behind the slower one
    assert log.requested.brake[log.t > t_cut].max() > 0.0 or log.v_ego.min() < 15.5


def test_by_itself_the_file_goes_on_at_its_speeds(file):
    log, story, target = drive(file, "ideal", "--actors", "ideal")
    assert any("Change" in r and "endTransition" in r for r in story)
    v = np.hypot(log.actors.vx[:, target], log.actors.vy[:, target])
    assert v[20:40] == pytest.approx(0.8 * 60 / 3.6, abs=0.3)
    assert log.v_ego[20:40] == pytest.approx(60 / 3.6, abs=0.1)
