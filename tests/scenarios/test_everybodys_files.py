"""Files as everybody writes them: what is off by the letter, but clear, plays, and it is said."""

from __future__ import annotations

import re

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import FileError
from skidpad.roads.opendrive.bake import bake
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.reading.findings import Kind, ScenarioError
from skidpad.scenarios.scenario import check, compile_scenario
from support.oracle.actions import lane_change
from support.scenarios.files import (
    BRIDGE,
    at,
    compiled,
    event,
    init,
    on_lane,
    private,
    speed,
    state,
    story,
    teleport,
    time,
    to,
    told,
    vehicle,
    write,
)

CATALOG = """<?xml version='1.0'?><OpenSCENARIO><FileHeader revMajor="{0}" revMinor="{1}"
date="2026-01-01T00:00:00" description="x" author="x"/><Catalog name="acts">{2}</Catalog>
</OpenSCENARIO>"""
GROUP = """<Story name="s"><Act name="a"><ManeuverGroup name="g" maximumExecutionCount="{0}">{1}
<CatalogReference catalogName="acts" entryName="m"/></ManeuverGroup><StartTrigger/></Act></Story>"""
ACTORS = """<Actors selectTriggeringEntities="false"><EntityRef entityRef="other"/></Actors>"""
IN_CAT = '<ManeuverCatalog><Directory path="{}"/></ManeuverCatalog>'
LANE = """<?xml version="1.0"?><OpenDRIVE><header revMajor="1" revMinor="4"/><road name="" length="400"
id="unnamed" junction="-1"><link/><planView><geometry s="0" x="0" y="0" hdg="0" length="400"><line/>
</geometry></planView><lanes><laneSection s="0"><center><lane id="0" type="none" level="false"/>
</center><right><lane id="-1" type="driving" level="false"><width sOffset="0" a="3.5" b="0" c="0"
d="0"/></lane></right></laneSection></lanes><objects>{}</objects></road></OpenDRIVE>"""


def notes(found: object) -> str:
    return "\n".join(str(f) for f in found.findings if f.kind in (Kind.NOTE, Kind.SCHEMA))


def test_a_catalog_of_new_names_under_an_old_header_keeps_its_references(tmp_path):
    """The second event waits for the end of the first by 1.0's names."""
    first = event("first", private(speed(to(5))), time(1))
    then = event("then", private(speed(to(2))), state("event", "first", "completeState"))
    entry = f'<Maneuver name="m">{first}{then}</Maneuver>'
    (tmp_path / "cat").mkdir()
    (tmp_path / "cat" / "acts.xosc").write_text(CATALOG.format(0, 9, entry))
    found = told(tmp_path, catalogs=IN_CAT.format("cat"), stories=GROUP.format(1, ACTORS), end=3.0)
    assert found.of("other")[-1].speed == pytest.approx(2.0)


def test_a_road_id_that_is_not_there_means_the_only_road_and_else_names_those_that_are(tmp_path):
    (tmp_path / "lane.xodr").write_text(LANE.format(""))
    one = {"road": '<LogicFile filepath="lane.xodr"/>', "entities": vehicle("ego")}
    place = init("ego", teleport(on_lane(-1, 50, road=0)))
    scenario = compiled(tmp_path, init=place, **one)
    assert scenario.start.entities["ego"].place.pose.x == pytest.approx(50.0)
    assert "there is no road '0'; the only one, 'unnamed', is taken" in notes(scenario)
    (tmp_path / "lane.xodr").write_text(BRIDGE)
    with pytest.raises(ScenarioError, match="there is no road '0'; the map has '1', '2'"):
        compiled(tmp_path, init=place, **one)


@pytest.mark.parametrize("type_", ["barrier", "tree"])
def test_a_road_is_not_refused_for_a_repeat_that_says_no_t(type_):
    thing = f"""<object id="o" type="{type_}" s="10" t="-4.5" length="1" width="1" height="1">
<repeat s="10" length="20" distance="10"/></object>"""
    side = bake(LANE.format(thing).encode(), "lane").roadside
    if type_ == "barrier":
        assert side.barriers[0].points[:, 1] == pytest.approx(-4.5)
    else:
        assert [(b.x, b.y) for b in side.boxes] == [(10, -4.5), (20, -4.5), (30, -4.5)]


def test_a_map_may_be_all_pavement(tmp_path):
    (tmp_path / "walk.xodr").write_text(BRIDGE.replace('type="driving"', 'type="sidewalk"'))
    road = '<LogicFile filepath="walk.xodr"/>'
    found = told(tmp_path, road=road, init=at("ego", -1, 20, 2) + at("other", -1, 60), end=1.0)
    assert found.player.scenario.map_name.endswith("walk.xodr")
    assert found.of("ego")[-1].x == pytest.approx(22.0)
    info = CliRunner().invoke(app, ["map", "info", str(tmp_path / "walk.xodr")])
    assert "road ids: 1, 2" in info.output, info.output


def test_catalog_folders_that_are_not_there_and_those_that_were_searched_are_named(tmp_path):
    story_ = GROUP.format(1, ACTORS)
    file = write(tmp_path, catalogs=IN_CAT.format("no/such"), stories=story_)
    found = check(file)
    assert found.scenario is None
    told_ = "\n".join(map(str, found.findings))
    assert f"there is no folder {tmp_path / 'no' / 'such'}" in told_
    assert f"(looked in {tmp_path / 'no' / 'such'})" in told_


def test_a_catalog_path_may_mean_a_folder_above_the_file(tmp_path):
    (tmp_path / "cat").mkdir()
    entry = f'<Maneuver name="m">{event("e", private(speed(to(5))), time(0))}</Maneuver>'
    (tmp_path / "cat" / "acts.xosc").write_text(CATALOG.format(1, 2, entry))
    (tmp_path / "deep" / "down").mkdir(parents=True)
    file = write(
        tmp_path / "deep" / "down", catalogs=IN_CAT.format("./cat"), stories=GROUP.format(1, ACTORS)
    )
    assert "is taken, seen from a folder above" in notes(compile_scenario(file))


def test_a_catalog_that_breaks_the_schema_is_noted(tmp_path):
    (tmp_path / "cat").mkdir()
    entry = f'<Maneuver name="m">{event("e", private(speed(to(5))), time(0))}</Maneuver>'
    broken = CATALOG.format(1, 2, entry.replace("<Event ", '<Event odd="1" '))
    (tmp_path / "cat" / "acts.xosc").write_text(broken)
    scenario = compiled(tmp_path, catalogs=IN_CAT.format("cat"), stories=GROUP.format(1, ACTORS))
    assert re.search(r"acts.xosc, line \d+, <Event>: .*odd", notes(scenario))


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ('width="1.8" length="4.2"', 'width="0" length="-1"', "length -1, width 0: a box needs"),
        ('value="10"', 'value="1e308"', "1e+308 m/s is faster than any road vehicle"),
        ('maximumExecutionCount="1"', 'maximumExecutionCount="0"', "is 0: it is carried out once"),
        ('"linear" value="5"', '"linear" value="-5"', "a time of -5 is read as a step"),
    ],
)
def test_what_is_hardly_meant_is_noted(tmp_path, old, new, says):
    goes = event("e", private(speed(to(5), "linear", 5)), time(1))
    file = write(tmp_path, stories=story(goes))
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new))
    scenario = compile_scenario(file)
    assert says in notes(scenario)
    box = scenario.entities["ego"].box
    assert min(box.length, box.width, box.height) > 0.0


def test_a_plain_file_has_no_notes(tmp_path):
    goes = event("e", private(speed(to(5), "linear", 5)), time(1))
    assert notes(compiled(tmp_path, stories=story(goes))) == ""


def test_what_is_missing_but_clear_plays_when_asked_to_be_lenient(tmp_path):
    near = teleport('<RelativeWorldPosition entityRef="ego" dy="3"/>')
    lane = teleport('<RelativeLanePosition entityRef="ego" ds="20"/>')
    group = GROUP.format(1, "").replace(
        '<CatalogReference catalogName="acts" entryName="m"/>', '<Maneuver name="m"></Maneuver>'
    )
    file = write(
        tmp_path, entities=vehicle("ego") + vehicle("other") + vehicle("third"), stories=group,
        init=at("ego", -3, 100, 0) + init("other", near) + init("third", lane), end=0.2,
    )  # fmt: skip
    with pytest.raises(ScenarioError, match="dx"):
        compile_scenario(file)
    scenario = compile_scenario(file, lenient=True)
    for words in ("has no attribute dx: read as 0", "has no attribute dLane", "has no <Actors>"):
        assert words in notes(scenario)
    ego, other, third = (play_ideal(scenario, 0.1).of(n)[0] for n in ("ego", "other", "third"))
    assert (other.x - ego.x, other.y - ego.y) == pytest.approx((0.0, 3.0), abs=1e-6)
    assert (third.x - ego.x, third.y - ego.y) == pytest.approx((20.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("name", ["end", "$end"])  # some files declare names with the sign
def test_an_offset_that_is_none_is_read_as_no_offset_when_asked_to_be_lenient(tmp_path, name):
    change = lane_change('<AbsoluteTargetLane value="-2"/>').replace('"0.0"', '"$end"', 1)
    file = write(
        tmp_path, stories=story(event("e", private(change), time(0.1))), end=6.0,
        parameters=f'<ParameterDeclaration name="{name}" parameterType="double" value="None"/>',
    )  # fmt: skip
    with pytest.raises(ScenarioError, match="None"):
        compile_scenario(file)
    scenario = compile_scenario(file, lenient=True)
    assert "targetLaneOffset is None: read as no offset" in notes(scenario)
    assert play_ideal(scenario, 6.0).of("other")[-1].y == pytest.approx(-5.25, abs=0.01)


def test_an_offset_that_is_none_may_be_given_from_outside_and_share_its_beginning(tmp_path):
    """A value from outside is no `None`; `$end` is not used where `$ending` is."""
    change = lane_change('<AbsoluteTargetLane value="-2"/>').replace('"0.0"', '"$end"', 1)
    declared = '<ParameterDeclaration name="{}" parameterType="double" value="{}"/>'.format
    file = write(
        tmp_path, stories=story(event("e", private(change), time("$ending"))), end=6.0,
        parameters=declared("end", "None") + declared("ending", "0.1"),
    )  # fmt: skip
    assert "read as no offset" in notes(compile_scenario(file, lenient=True))
    given = compile_scenario(file, {"end": 0.5}, lenient=True)
    assert "read as no offset" not in notes(given)
    assert play_ideal(given, 6.0).of("other")[-1].y == pytest.approx(-4.75, abs=0.01)


def test_a_file_of_the_domain_specific_language_is_called_so(tmp_path):
    (tmp_path / "x.osc").write_text("scenario top: do parallel()")
    with pytest.raises(FileError, match=r"OpenSCENARIO DSL \(2.x, .osc\) is not supported"):
        check(tmp_path / "x.osc")
    done = CliRunner().invoke(app, ["play", str(tmp_path / "x.osc"), "--out", str(tmp_path / "o")])
    assert "DSL" in str(done.exception)


def test_a_crosswalk_of_two_corners_stops_no_run():
    from skidpad.roads.roadside import Roadside
    from skidpad.simulation.world.traffic.priority import _zebras

    line, area = np.zeros((2, 3)), np.array([[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]], float)
    assert len(_zebras(Roadside(crosswalks=(line, area)))) == 1


def test_a_text_with_a_dollar_that_is_no_reference_is_a_text(tmp_path):
    """The schema's pattern of a reference is `$` and one name; a text may begin with `$` otherwise."""
    file = write(tmp_path)
    plain = file.read_text()
    held = '<Properties><Property name="color" value="{}"/></Properties>'
    for value, faults in (("$a,$b,255", 0), ("$a", 1)):
        file.write_text(plain.replace("<Properties/>", held.format(value), 1))
        said = [str(f) for f in check(file).findings if f.kind is Kind.ERROR]
        assert len(said) == faults
    assert "parameter '$a' is not declared" in said[0]
