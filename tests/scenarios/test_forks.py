"""Forks of two ways as far from straight, without a route: OpenSCENARIO XML 6.8.1."""

from __future__ import annotations

from math import pi

import pytest

from support.oracle.roads import ARC, arm, connection, network
from support.scenarios.files import at, told

TURN = 10.0 * pi  # m of a quarter of a circle of 20 m


def tee(lane: int, *, left_first: bool) -> str:
    """From the end of road 1, at x = 100, road 2 leads north and road 3 south.

    lane: the one of the traffic that comes there, -1 in right-hand traffic, 1 in left-hand traffic.
    """
    legs = [(11, 2, ARC.format(0.05)), (12, 3, ARC.format(-0.05))]
    legs = legs if left_first else legs[::-1]
    lanes = (lane, lane)
    roads = [
        connection(id, ((1, "end"), (to, "start")), lanes, (100.0, 0.0, 0.0), (TURN, shape))
        for id, to, shape in legs
    ]
    if lane > 0:  # the lane of a connecting road is on its left
        roads = [
            text.replace("right>", "left>").replace('<lane id="-1"', '<lane id="1"')
            for text in roads
        ]
    links = "".join(
        f"""<connection id="{k}" incomingRoad="1" connectingRoad="{id}" contactPoint="start">
<laneLink from="{lane}" to="{lane}"/></connection>"""
        for k, (id, _, _) in enumerate(legs)
    )
    whole = network(
        arm(1, (0.0, 0.0, 0.0), "successor"),
        arm(2, (120.0, 20.0, pi / 2), "predecessor"),
        arm(3, (120.0, -20.0, -pi / 2), "predecessor"),
        *roads,
        f'<junction name="" id="10">{links}</junction>',
    )
    return whole if lane < 0 else whole.replace("<road ", '<road rule="LHT" ')


def way(tmp_path, lane, v, *, left_first):
    """The rows of a car on a lane of road 1 with 20 m to go to the fork at which both ways turn as far."""
    (tmp_path / "tee.xodr").write_text(tee(lane, left_first=left_first), encoding="utf-8")
    begins = at("ego", lane, 20, 0) + at("other", lane, 80, v)
    road = '<LogicFile filepath="tee.xodr"/>'
    return told(tmp_path, road=road, init=begins, end=8.0).of("other")


@pytest.mark.parametrize("left_first", [True, False])
def test_right_hand_traffic_turns_right_where_both_ways_turn_as_far(tmp_path, left_first):
    end = way(tmp_path, -1, 10.0, left_first=left_first)[-1]
    assert end.y < -20.0
    assert end.x == pytest.approx(118.25, abs=0.01)  # the lane is 1.75 m right of the road's line


@pytest.mark.parametrize("left_first", [True, False])
def test_left_hand_traffic_turns_left_there(tmp_path, left_first):
    end = way(tmp_path, 1, 10.0, left_first=left_first)[-1]
    assert end.y > 20.0
    assert end.x == pytest.approx(118.25, abs=0.01)
