"""Exported hazards: positions, roads, profiles, and the verdict of the ASAM checkers."""

from __future__ import annotations

import numpy as np
import pytest
from lxml import etree
from msgspec import structs
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import ConfigError, InputError
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.hazards.records import (
    HazardWriter,
)
from skidpad.scenarios.export.hazard_export import export_hazard
from skidpad.scenarios.export.version import OscVersion
from support.asam import asam_verdicts, require_asam_python
from support.channel_worlds import Eyes, World, drive, traffic
from support.hazard_record import a_record, unwritten

JUNCTION_RULE = 1  # of two junction rules that exclude each other, one is always skipped


def vertices(path):
    """Entity -> rows of t, x, y, h, read with lxml and nothing of ours."""
    root = etree.parse(str(path)).getroot()
    out = {}
    for group in root.iter("ManeuverGroup"):
        (name,) = {e.get("entityRef") for e in group.iter("EntityRef")} - {None}
        out[name] = np.array(
            [
                [float(v.get("time")), *(float(v.find(".//WorldPosition").get(k)) for k in "xyh")]
                for v in group.iter("Vertex")
            ]
        )
    return root, out


def between(rows, t):
    """Where an entity is at time t, by straight lines."""
    return np.array([np.interp(t, rows[:, 0], rows[:, k]) for k in (1, 2)])


@pytest.mark.req("C-152", "C-154", "C-155", "C-156")
def test_the_file_holds_every_ego_and_object_where_the_record_has_them(tmp_path):
    record = a_record()
    scenario, road = export_hazard(record, tmp_path)
    root, moved = vertices(scenario)
    assert root.find("FileHeader").get("revMinor") == "2"
    assert root.find("RoadNetwork/LogicFile").get("filepath") == road.name
    names = {e.get("name") for e in root.iter("ScenarioObject")}
    assert names == {"Ego_lav", "Ego_tfuse", *(f"lav_{k}" for k in range(1, 5)),
                     *(f"tfuse_{k}" for k in range(1, 4))}  # fmt: skip
    for c, channel in enumerate(record.channels):
        for cycle in record.worlds:
            frame = cycle.frames[c]
            t = cycle.t - record.worlds[0].t
            assert between(moved[f"Ego_{channel}"], t) == pytest.approx(frame.ego[:2], abs=0.01)
            for i in range(len(frame.objects)):
                place = between(moved[f"{channel}_{i + 1}"], t)
                assert place == pytest.approx(frame.objects[i, :2], abs=0.01)
    colours = {
        o.get("name"): o.find(".//Property[@name='color']").get("value")
        for o in root.iter("ScenarioObject")
    }
    assert (colours["Ego_lav"], colours["lav_1"]) == ("#FF0000", "#FFFFFF")
    assert (colours["Ego_tfuse"], colours["tfuse_1"]) == ("#0000FF", "#FFFF00")


@pytest.mark.req("C-152", "C-156")
def test_the_command_decodes_the_text_file_and_puts_everything_where_it_truly_was(tmp_path):
    """Compared with the drive before it was written; the text has a resolution of 1 cm."""
    eyes = (Eyes("lav", 0.05), Eyes("tfuse", 0.05))
    source = drive(World(objects=traffic(3)), eyes, 11.0)
    worlds = [c._replace(truth=None) for c in cycles(source)]
    with HazardWriter(tmp_path) as writer:
        writer.write(unwritten(worlds))
    done = CliRunner().invoke(app, ["hazards", "export", str(tmp_path)])
    assert done.exit_code == 0, done.output
    (scenario,) = (tmp_path / "scenarios").glob("*.xosc")
    assert (scenario.with_suffix(".xodr")).exists()
    _, moved = vertices(scenario)
    for cycle in worlds[::10]:
        for channel, frame in zip(("lav", "tfuse"), cycle.frames, strict=True):
            t = cycle.t - worlds[0].t
            assert between(moved[f"Ego_{channel}"], t) == pytest.approx(frame.ego[:2], abs=0.02)
            for i, place in enumerate(frame.objects[:, :2]):
                assert between(moved[f"{channel}_{i + 1}"], t) == pytest.approx(place, abs=0.02)


@pytest.mark.parametrize("label", [-7, 104, 2**31])
def test_who_is_of_no_known_class_is_a_car(tmp_path, label):
    record = a_record()
    for cycle in record.worlds:
        cycle.frames[0].classes[:] = label
    root = etree.parse(str(export_hazard(record, tmp_path)[0])).getroot()
    (seen,) = root.xpath("//ScenarioObject[@name='lav_1']/Vehicle")
    assert seen.get("vehicleCategory") == "car"


@pytest.mark.req("C-155", "C-156")
def test_the_road_covers_every_position(tmp_path):
    scenario, road = export_hazard(a_record(12), tmp_path)
    _, moved = vertices(scenario)
    line = etree.parse(str(road)).getroot().find(".//geometry")
    x, y, h, length = (float(line.get(k)) for k in ("x", "y", "hdg", "length"))
    lanes = etree.parse(str(road)).getroot().findall(".//left/lane")
    half = sum(float(lane.find("width").get("a")) for lane in lanes)
    points = np.vstack([rows[:, 1:3] for rows in moved.values()]) - (x, y)
    along = points @ [np.cos(h), np.sin(h)]
    left = points @ [-np.sin(h), np.cos(h)]
    assert along.min() >= 0 <= length - along.max()
    assert np.abs(left).max() <= half


@pytest.mark.req("C-156")
def test_late_objects_appear_and_vanish_in_1_2_and_wait_beside_the_road_in_1_0(tmp_path):
    record = a_record(late=True)
    new, _ = export_hazard(record, tmp_path)
    root, moved = vertices(new)
    (name,) = {e.get("entityRef") for e in root.iter("EntityAction")}
    assert moved[name][0, 0] == pytest.approx(3.0)
    kinds = [e[0].tag for e in root.iter("EntityAction")]
    assert kinds == ["DeleteEntityAction", "AddEntityAction", "DeleteEntityAction"]
    old, _ = export_hazard(record, tmp_path / "old", OscVersion.V1_0, "lav")
    root, parked = vertices(old)
    assert not list(root.iter("EntityAction"))
    assert root.find("FileHeader").get("revMinor") == "0"
    t, x = parked[name][:, 0], parked[name][:, 1:3]
    there = (t >= 3.0) & (t <= 6.0)
    assert np.hypot(*(x[~there][0] - x[there][0])) > 30.0
    assert not any(n.startswith("tfuse") for n in parked)


def test_a_1_0_file_takes_the_driving_channel_and_names_wrong_ones(tmp_path):
    _, moved = vertices(export_hazard(a_record(2), tmp_path, OscVersion.V1_0)[0])
    assert "Ego_tfuse" in moved
    assert "Ego_lav" not in moved
    with pytest.raises(ConfigError, match="lav, tfuse"):
        export_hazard(a_record(2), tmp_path, world="third")


def test_a_record_without_worlds_is_refused(tmp_path):
    empty = structs.replace(a_record(1, 0.2), worlds=())
    with pytest.raises(InputError, match="no world"):
        export_hazard(empty, tmp_path)


def test_the_two_versions_stand_side_by_side(tmp_path):
    record = a_record(2)
    new = export_hazard(record, tmp_path)
    old = export_hazard(record, tmp_path, OscVersion.V1_0)
    assert len({*new, *old}) == 4
    root, _ = vertices(old[0])
    assert root.find("RoadNetwork/LogicFile").get("filepath") == old[1].name
    colours = {p.get("value") for p in root.iter("Property") if p.get("name") == "color"}
    assert colours <= {"0,0,255", "255,255,0"}


def test_export_is_repeatable(tmp_path):
    record = a_record(2)
    one = [p.read_bytes() for p in export_hazard(record, tmp_path / "1")]
    export_hazard(record, tmp_path / "2", OscVersion.V1_0)
    assert [p.read_bytes() for p in export_hazard(record, tmp_path / "3")] == one


@pytest.mark.req("C-154", "C-156")
def test_the_asam_checkers_find_nothing(tmp_path):
    require_asam_python()
    record = a_record(late=True)
    files = export_hazard(record, tmp_path)
    old, _ = export_hazard(record, tmp_path / "old", OscVersion.V1_0)
    verdict = asam_verdicts(*files, old)
    new_xosc, xodr = (verdict[str(f)] for f in files)
    assert new_xosc["issues"] == [] == new_xosc["skipped"]
    assert any("valid_schema" in c for c in new_xosc["completed"])
    assert xodr["issues"] == []
    assert len(xodr["skipped"]) == JUNCTION_RULE
    assert verdict[str(old)]["issues"] == []  # its schema is checked, the rules begin with 1.2
    assert any("valid_schema" in c for c in verdict[str(old)]["completed"])
