"""Files that cannot be used: one sentence that names the file and the element; traps of M-15."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from skidpad.core.errors import ConfigError, FileError
from skidpad.roads.baked import load_baked
from skidpad.roads.bundled import FOLDER, bake_file, load_map
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.queries import RoadMap

STRAIGHT = (FOLDER / "straight.xodr").read_text()
FIGURE8 = (FOLDER / "figure8.xodr").read_text()
BOMB = """<?xml version="1.0"?><!DOCTYPE l [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>
<OpenDRIVE>&b;</OpenDRIVE>"""


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "not XML"),
        ("hello", "not XML"),
        ("<osm/>", "not OpenDRIVE.*<osm>"),
        ("<OpenDRIVE/>", "has no lane"),
        (BOMB, "document type declaration"),
        (STRAIGHT.replace("<line/>", "<helix/>"), "<geometry> needs line, arc.*helix"),
        (STRAIGHT.replace("<line/>", ""), "<geometry> needs line, arc.*nothing"),
        (re.sub(r'hdg="[^"]*"', 'hdg="north"', STRAIGHT), "needs a number hdg, got 'north'"),
        (re.sub(r'hdg="[^"]*"', 'hdg="nan"', STRAIGHT), "needs a finite hdg"),
        (STRAIGHT.replace('max="100.0"', 'max="fast"'), "<speed> needs a number max"),
        (STRAIGHT.replace('unit="km/h"', 'unit="knots"'), "<speed> has unknown unit 'knots'"),
        (re.sub(r'(<road [^>]*)length="[^"]*"', r'\1length="1e9"', STRAIGHT), "at most 1e\\+06 m"),
        (re.sub(r'(<road [^>]*)length="[^"]*"', r'\1length="-1"', STRAIGHT), "positive length"),
        (
            re.sub(r'(<geometry [^>]*)length="[^"]*"', r'\1length="2147483648"', STRAIGHT),
            "<geometry> is 2.14748e\\+09 m long; at most 1e\\+06 m",
        ),
        (
            re.sub(r'<laneSection s="[^"]*"', '<laneSection s="-2e9"', STRAIGHT),
            "20000000 lane samples",
        ),
        (re.sub(r'(<road [^>]*)\bid="3"', r'\1id="1"', FIGURE8), "twice"),
    ],
)
def test_a_bad_file_is_one_sentence_about_file_and_element(text: str, says: str) -> None:
    with pytest.raises(FileError, match=says) as caught:
        bake(text.encode(), "mine", "mine.xodr")
    assert "mine.xodr" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_files_and_names_are_told_apart(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="figure8"):
        load_map("figure9")
    with pytest.raises(FileError, match="no such file"):
        load_map(tmp_path / "none.xodr")
    broken = tmp_path / "broken.npz"
    broken.write_bytes(b"PK nonsense")
    with pytest.raises(FileError, match="not a baked map"):
        load_map(broken)


def test_a_baked_file_holds_the_same_map(tmp_path: Path, figure8: RoadMap) -> None:
    baked = bake_file(FOLDER / "figure8.xodr")
    baked.save(tmp_path / "copy.npz")
    again = load_baked(tmp_path / "copy.npz")
    assert again.content_hash() == baked.content_hash() == figure8.content_hash
    assert again.ego_start == baked.ego_start
    assert again.roadside.boxes == baked.roadside.boxes
    assert [b.kind for b in again.roadside.barriers] == [b.kind for b in baked.roadside.barriers]


def test_the_content_hash_sees_any_change(figure8: RoadMap) -> None:
    baked = bake_file(FOLDER / "straight.xodr")
    z = baked.samples.z.copy()
    z[7] += 1e-5
    changed = type(baked)(
        name=baked.name,
        samples=baked.samples._replace(z=z),
        lanes=baked.lanes,
        signals=baked.signals,
        roadside=baked.roadside,
    )
    assert changed.content_hash() != baked.content_hash()
    negative = baked.samples._replace(bank=-baked.samples.bank)
    assert not np.signbit(baked.samples.bank).any()
    same = type(baked)(
        name="other name",
        samples=negative,
        lanes=baked.lanes,
        signals=baked.signals,
        roadside=baked.roadside,
    )
    assert same.content_hash() == baked.content_hash()


def test_junction_ids_never_meet_road_ids_in_our_maps() -> None:
    paths = sorted(FOLDER.glob("*.xodr"))
    assert len(paths) > 3
    seen = set()
    for path in paths:
        text = path.read_text()
        roads = set(re.findall(r'<road [^>]*?\bid="(\d+)"', text))
        junctions = set(re.findall(r'<junction [^>]*?\bid="(\d+)"', text))
        assert roads
        assert roads.isdisjoint(junctions)
        assert all(int(j) >= 9000 for j in junctions)
        assert "<geoReference>" in text
        seen |= junctions
    assert len(seen) > 3


def test_our_importer_follows_junctions_even_when_a_road_has_their_id() -> None:
    trap = FIGURE8.replace('"9000"', '"13"')
    map = RoadMap(bake(trap.encode(), "trap"))
    lane = map.on_lane(1, -4, 10.0).lane
    assert {int(map.lanes.road[i]) for i in map.successors(lane)} == {101, 102}


def test_connections_listed_from_both_ends_are_one_branch() -> None:
    connection = re.search(r'<connection incomingRoad="1" .*?</connection>', FIGURE8, re.S)
    assert connection is not None
    doubled = FIGURE8.replace(connection.group(), connection.group() * 2)
    backwards = connection.group().replace('incomingRoad="1"', 'incomingRoad="3"')
    backwards = backwards.replace('contactPoint="start"', 'contactPoint="end"')
    doubled = doubled.replace(connection.group() * 2, connection.group() * 2 + backwards)
    map = RoadMap(bake(doubled.encode(), "twice"))
    lane = map.on_lane(1, -2, 10.0).lane
    assert len(map.successors(lane)) == 1


def test_signals_without_validity_act_in_the_direction_of_their_orientation() -> None:
    text = re.sub(r"<validity[^>]*/>", "", FIGURE8)
    map = RoadMap(bake(text.encode(), "plain"))
    lights = map.signals.id == 1001
    assert sorted(map.lanes.lane_id[map.signals.lane[lights]].tolist()) == [-4, -3, -2, -1]
