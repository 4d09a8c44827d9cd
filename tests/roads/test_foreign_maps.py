"""What files of other authors use: header offsets, banked roads, ids that are words, many repeats."""

from __future__ import annotations

from math import cos, pi, sin

import pytest

from skidpad.core.errors import FileError
from skidpad.core.geometry import wrap_angle
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.opendrive.reader import id_number
from skidpad.roads.queries import RoadMap

LANE = '<lane id="{}" type="driving"><link/><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>'
ROAD = """<road name="" length="100" id="{id}" junction="-1"><planView>
<geometry s="0" x="10" y="20" hdg="0" length="100"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="1" b="0" c="0" d="0"/></elevationProfile>
<lateralProfile>{bank}</lateralProfile>
<lanes><laneSection s="0"><left>{left}</left><center><lane id="0" type="none"/></center>
<right>{right}</right></laneSection></lanes><objects>{objects}</objects></road>"""


def world(header="", bank="", road="7", objects=""):
    text = ROAD.format(
        id=road, bank=bank, left=LANE.format(1), right=LANE.format(-1), objects=objects
    )
    file = f'<OpenDRIVE><header revMajor="1" revMinor="7">{header}</header>{text}</OpenDRIVE>'
    return RoadMap(bake(file.encode(), "mine", "mine.xodr"))


def test_the_offset_of_a_header_moves_then_turns_everything():
    plain = world().on_lane(7, -1, 40.0)
    moved = world('<offset x="-1000" y="-500" z="3" hdg="0.9"/>').on_lane(7, -1, 40.0)
    x, y = plain.x - 1000.0, plain.y - 500.0
    assert moved.x == pytest.approx(x * cos(0.9) - y * sin(0.9), abs=1e-4)
    assert moved.y == pytest.approx(x * sin(0.9) + y * cos(0.9), abs=1e-4)
    assert moved.z == pytest.approx(plain.z + 3.0)
    assert moved.heading == pytest.approx(plain.heading + 0.9, abs=1e-6)


@pytest.mark.parametrize("roll", [-0.3, 0.0, 0.5])
def test_lanes_of_a_banked_road_lie_as_seen_from_above(roll):
    bank = f'<superelevation s="0" a="{roll}" b="0" c="0" d="0"/>'
    place = world(bank=bank).on_lane(7, -1, 40.0)
    assert place.y == pytest.approx(20.0 - 1.5 * cos(roll), abs=1e-4)
    assert place.z == pytest.approx(1.0 - 1.5 * sin(roll), abs=1e-4)


def test_a_changing_bank_turns_the_lane():
    bank = '<superelevation s="0" a="0" b="0.01" c="0" d="0"/>'
    map = world(bank=bank)
    a, b = map.on_lane(7, 1, 79.5), map.on_lane(7, 1, 80.5)
    slope = (b.y - a.y) / (b.x - a.x)
    assert wrap_angle(map.on_lane(7, 1, 80.0).heading + pi) == pytest.approx(slope, abs=1e-5)


def test_ids_may_be_words():
    assert id_number("12") == 12
    assert id_number("Road4") == id_number("Road4") != id_number("Road5")
    assert world(road="Road4").on_lane(id_number("Road4"), -1, 5.0).x == pytest.approx(15.0)


@pytest.mark.parametrize(("distance", "count"), [("0.005", 20001), ("0", 51)])
def test_an_object_may_be_repeated_often_or_without_a_gap(distance, count):
    posts = f"""<object id="1" type="pole" s="0" t="5" length="0.1" width="0.1" height="1">
<repeat s="0" length="100" distance="{distance}" tStart="5" tEnd="5" heightStart="1" heightEnd="1"
zOffsetStart="0" zOffsetEnd="0"/></object>"""
    assert len(world(objects=posts).roadside.boxes) == count


def test_a_direct_junction_links_roads_without_roads_of_its_own():
    def road(id, x, link):
        text = ROAD.format(id=id, bank="", left="", right=LANE.format(-1), objects="")
        text = text.replace('x="10"', f'x="{x}"')
        return text.replace("<planView>", f"<link>{link}</link><planView>", 1)

    junction = """<junction id="9" type="direct" name=""><connection id="0" incomingRoad="1"
linkedRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/></connection></junction>"""
    there, back = (
        f'<{end} elementType="junction" elementId="9"/>' for end in ("successor", "predecessor")
    )
    text = road(1, 10, there) + road(2, 110, back) + junction
    map = RoadMap(bake(f"<OpenDRIVE><header/>{text}</OpenDRIVE>".encode(), "m", "m.xodr"))
    assert map.ahead(map.on_lane(1, -1, 90.0), 30.0).road == 2


def test_a_building_given_by_its_corners_alone_has_their_size():
    corners = "".join(
        f'<cornerLocal u="{u}" v="{v}" z="0" height="9"/>'
        for u, v in ((8, 3), (-8, 3), (-8, -3), (8, -3))
    )
    building = (
        f'<object id="1" type="building" s="50" t="20" zOffset="0" hdg="0.5"><outline>{corners}'
        "</outline></object>"
    )
    (box,) = world(objects=building).roadside.boxes
    assert (box.x, box.y, box.z) == pytest.approx((60.0, 40.0, 1.0), abs=1e-4)
    assert sorted((box.length, box.width)) == pytest.approx([6.0, 16.0], abs=1e-4)
    assert box.height == 9.0
    along = box.yaw if box.length > box.width else box.yaw + pi / 2.0
    assert abs(sin(along - 0.5)) == pytest.approx(0.0, abs=1e-4)


def test_objects_of_a_map_are_counted_before_they_are_made():
    many = "".join(
        f'<object id="{i}" type="pole" s="0" t="8"><repeat s="0" length="90" distance="0.001" tStart="8"'
        ' tEnd="8" zOffsetStart="0" zOffsetEnd="0"/></object>'
        for i in range(3)
    )
    with pytest.raises(FileError, match=r"<object id=2> brings the map beyond 200000 objects"):
        world(objects=many)
