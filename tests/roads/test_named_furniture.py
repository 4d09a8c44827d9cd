"""Kerbs and traffic lights that a file names are there to be seen, as town editors write them."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import LaneKind, Marking
from skidpad.roads.opendrive.bake import bake
from skidpad.roads.queries import RoadMap
from skidpad.sensors.scene.materials import Material
from skidpad.sensors.scene.road_mesh import KERB_HEIGHT, road_pieces

LANE = (
    '<lane id="{id}" type="{type}"><width sOffset="0" a="{width}" b="0" c="0" d="0"/>'
    '<roadMark sOffset="0" type="{mark}"/></lane>'
)
SIGNAL = (
    '<signal name="Signal_3Light_Post01" id="{id}" s="{s}" t="{t}" zOffset="{z}" dynamic="yes"'
    ' orientation="-" type="1000001" subtype="-1" value="-1" height="1.16" width="0.52"/>'
)
ROAD = """<OpenDRIVE><header revMajor="1" revMinor="4"/>
<road name="" length="60" id="1" junction="-1"><planView>
<geometry s="0" x="0" y="0" hdg="0" length="60"><line/></geometry></planView>
<elevationProfile><elevation s="0" a="2" b="0" c="0" d="0"/></elevationProfile>
<lanes><laneSection s="0"><left>{left}</left><center><lane id="0" type="none">
<roadMark sOffset="0" type="broken"/></lane></center><right>{right}</right></laneSection></lanes>
<signals>{signals}</signals></road></OpenDRIVE>"""


def town_road(signals: str = "") -> RoadMap:
    """Returns a street as the towns of CARLA have it: its only height is that of the road."""

    def side(sign: int) -> list[str]:
        lanes = [
            (1, "driving", 4.0, "none"),
            (2, "shoulder", 0.3, "curb"),
            (3, "sidewalk", 4, "none"),
        ]
        return [LANE.format(id=sign * i, type=t, width=w, mark=m) for i, t, w, m in lanes]

    text = ROAD.format(left="".join(side(1)[::-1]), right="".join(side(-1)), signals=signals)
    return RoadMap(bake(text.encode(), "street", "street.xodr"))


def nearest_mesh(road: RoadMap):
    levels = [meshes[0] for _, meshes in road_pieces(road.samples, road.lanes)]
    points = np.concatenate([m.vertices[m.triangles].reshape(-1, 9) for m in levels])
    return (
        points,
        np.concatenate([m.label for m in levels]),
        np.concatenate([m.material for m in levels]),
    )


def test_a_kerb_that_a_road_mark_names_stands_up_and_the_sidewalk_behind_it_lies_higher() -> None:
    road = town_road()
    walks = np.flatnonzero(road.lanes.kind == LaneKind.SIDEWALK)
    assert (road.samples.marking_left[np.isin(road.samples.lane, walks)] == Marking.CURB).all()
    points, label, material = nearest_mesh(road)
    stones = points[material == Material.KERB].reshape(-1, 3)
    assert stones[:, 2].min() == pytest.approx(2.0)
    assert stones[:, 2].max() == pytest.approx(2.0 + KERB_HEIGHT, abs=0.02)
    assert np.abs(np.abs(stones[:, 1]) - 4.3).max() <= 0.151
    pavement = points[(material == Material.SIDEWALK)].reshape(-1, 3)
    assert pavement[:, 2] == pytest.approx(2.0 + KERB_HEIGHT)
    assert (label[material == Material.KERB] == SemanticClass.SIDEWALK).all()
    asphalt = points[material == Material.ASPHALT].reshape(-1, 3)
    assert asphalt[:, 2] == pytest.approx(2.0)


def test_a_light_whose_height_is_the_foot_of_its_post_stands_on_a_post() -> None:
    road = town_road(SIGNAL.format(id=7, s=30, t=-4.8, z=-0.7))
    (head,) = road.roadside.heads
    (post,) = road.roadside.boxes
    assert head.z - 0.58 == pytest.approx(2.0 + 2.4)  # its lower edge, above the road
    assert (post.label, post.x, post.y) == (
        SemanticClass.POLE,
        pytest.approx(30),
        pytest.approx(-4.8),
    )
    assert post.z == pytest.approx(1.3)
    assert post.z + post.height == pytest.approx(4.4)


def test_a_light_at_a_height_of_its_own_stays_there_and_one_over_a_lane_has_no_post() -> None:
    road = town_road(SIGNAL.format(id=7, s=30, t=-4.8, z=3.0) + SIGNAL.format(id=8, s=30, t=0, z=0))
    own, above = road.roadside.heads
    assert own.z == pytest.approx(2.0 + 3.58)
    assert above.z == pytest.approx(2.0 + 5.58)
    assert road.roadside.boxes == ()
