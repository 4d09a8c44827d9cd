"""Catalogs: vehicles, manoeuvres, routes and trajectories of other files, with their parameters."""

from __future__ import annotations

import pytest

from skidpad.scenarios.reading.findings import ScenarioError
from support.scenarios.files import (
    VEHICLE,
    at,
    compiled,
    document,
    event,
    private,
    speed,
    time,
    to,
    told,
    vehicle,
)

CATALOG = document('<Catalog name="{name}">{entries}</Catalog>')
LONG = VEHICLE.format(x=1).replace('name="v"', 'name="long"').replace('length="4.2"', 'length="$L"')
DECLARED = """<ParameterDeclarations><ParameterDeclaration name="L" parameterType="double" value="9"/>
</ParameterDeclarations>"""
PLACES = """<VehicleCatalog><Directory path="cat"/></VehicleCatalog>
<ManeuverCatalog><Directory path="cat"/></ManeuverCatalog>"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "cat").mkdir()
    car = LONG.replace("<BoundingBox>", DECLARED + "<BoundingBox>", 1)
    (tmp_path / "cat" / "cars.xosc").write_text(CATALOG.format(name="cars", entries=car))
    slow = event("slow", private(speed(to("$v"), "linear", 2)), time(2.0))
    manoeuvre = f"""<Maneuver name="slow"><ParameterDeclarations><ParameterDeclaration name="v"
parameterType="double" value="1"/></ParameterDeclarations>{slow}</Maneuver>"""
    (tmp_path / "cat" / "acts.xosc").write_text(CATALOG.format(name="acts", entries=manoeuvre))
    return tmp_path


def reference(catalog, entry, **values):
    given = "".join(
        f'<ParameterAssignment parameterRef="{k}" value="{v}"/>' for k, v in values.items()
    )
    inside = f"<ParameterAssignments>{given}</ParameterAssignments>" if given else ""
    return (
        f'<CatalogReference catalogName="{catalog}" entryName="{entry}">{inside}</CatalogReference>'
    )


def other(body):
    return vehicle("ego") + f'<ScenarioObject name="other">{body}</ScenarioObject>'


@pytest.mark.parametrize(("given", "length"), [({}, 9.0), ({"L": 12}, 12.0), ({"L": "$far"}, 14.0)])
def test_a_vehicle_of_a_catalog_with_its_parameters(folder, given, length):
    far = '<ParameterDeclaration name="far" parameterType="double" value="14"/>'
    scenario = compiled(
        folder, catalogs=PLACES, entities=other(reference("cars", "long", **given)), parameters=far
    )
    assert scenario.entities["other"].box.length == length


def test_a_manoeuvre_of_a_catalog_for_its_group(folder):
    result = told(folder, catalogs=PLACES, stories=GROUP.format(reference("acts", "slow", v=6)))
    assert result.of("other")[-1].speed == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("wanted", "message"),
    [(("trucks", "long"), "no catalog 'trucks'"), (("cars", "short"), "no entry 'short'")],
)
def test_what_is_not_there_is_said(folder, wanted, message):
    with pytest.raises(ScenarioError, match=message):
        compiled(folder, catalogs=PLACES, entities=other(reference(*wanted)))


GROUP = """<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="1"><Actors
selectTriggeringEntities="false"><EntityRef entityRef="other"/></Actors>{}</ManeuverGroup>
<StartTrigger/></Act></Story>"""
MANOEUVRE = '<Maneuver name="m">{}</Maneuver>'
FOLLOW = """<RoutingAction><FollowTrajectoryAction>{}<TrajectoryFollowingMode followingMode="position"/>
</FollowTrajectoryAction></RoutingAction>"""
ROUTE = "<RoutingAction><AssignRouteAction>{}</AssignRouteAction></RoutingAction>"
SKY = "<GlobalAction><EnvironmentAction>{}</EnvironmentAction></GlobalAction>"


@pytest.mark.parametrize(
    ("action", "needed"),
    [(private(FOLLOW), "Trajectory"), (private(ROUTE), "Route"), (SKY, "Environment")],
)
def test_an_action_with_an_entry_of_another_kind_is_refused(folder, action, needed):
    inside = MANOEUVRE.format(event("e", action, time(1.0))).format(reference("cars", "long"))
    with pytest.raises(ScenarioError, match=f"<{needed}> is needed, not <Vehicle>"):
        compiled(folder, catalogs=PLACES, stories=GROUP.format(inside))


def test_a_group_with_an_entry_of_another_kind_is_refused(folder):
    stories = GROUP.format(reference("cars", "long"))
    with pytest.raises(ScenarioError, match="<Maneuver> is needed, not <Vehicle>"):
        compiled(folder, catalogs=PLACES, stories=stories)


def test_a_story_has_parameters_of_its_own(tmp_path):
    declared = """<ParameterDeclarations><ParameterDeclaration name="who" parameterType="string"
value="other"/></ParameterDeclarations>"""
    act = f"""<Story name="s">{declared}<Act name="a"><ManeuverGroup name="g"
maximumExecutionCount="1"><Actors selectTriggeringEntities="false"><EntityRef entityRef="$who"/>
</Actors><Maneuver name="m">{event("e", private(speed(to(3))), time(1.0))}</Maneuver></ManeuverGroup>
<StartTrigger/></Act></Story>"""
    rows = told(tmp_path, stories=act, init=at("ego", -3, 100) + at("other", -1, 120)).of("other")
    assert rows[-1].speed == pytest.approx(3.0)


def test_a_folder_of_catalogs_may_have_a_dot_in_its_name(folder):
    (folder / "cat").rename(folder / "cat.v1")
    scenario = compiled(
        folder,
        catalogs='<VehicleCatalog><Directory path="cat.v1"/></VehicleCatalog>',
        entities=other(reference("cars", "long")),
    )
    assert scenario.entities["other"].box.length == 9.0
