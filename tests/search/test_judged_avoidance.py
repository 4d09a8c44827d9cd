"""The bound over logs on a straight road: when a danger could be known, and what was enough from then on.

The ego goes at 20 m/s on a friction of 0.9: 18 m of reaction and 22.7 m of braking.
"""

from dataclasses import replace

import numpy as np
import pytest

from skidpad.core.states import ContactEvent
from skidpad.roads.bundled import load_map
from skidpad.search.avoidance import find_run_avoidance
from support import makelog

ROAD = load_map("straight")
LANE, V, BEGIN = -1.75, 20.0, 300.0
LENGTH = 4.0  # of both


def approach(seconds, appears=None, angle=0.0, contacts=()):
    """A drive towards a standing car that is touched in its last tick; appears: s before that."""
    ticks = round(seconds / makelog.DT)
    there = BEGIN + V * seconds + LENGTH
    last = -1 if appears is None else ticks - round(appears / makelog.DT)

    def rows(k):
        way = V * k * makelog.DT
        ego = {"x": BEGIN + way * np.cos(angle), "y": LANE + way * np.sin(angle), "yaw": angle}
        ego |= {"vx": V * np.cos(angle), "vy": V * np.sin(angle)}
        return [ego, {"x": there, "y": LANE, "present": k >= last}]

    return makelog.drive(ticks + 2, rows, contacts=contacts), ticks


@pytest.mark.parametrize(
    ("appears", "answer"),
    [(None, "braking"), (2.2, "braking"), (1.2, ""), (0.5, "")],  # 44, 24 and 10 m away
)
def test_what_was_enough_depends_on_when_the_other_could_be_seen(appears, answer):
    log, tick = approach(8.0, appears)
    assert find_run_avoidance(log, ROAD, tick, 1) == answer


def test_less_grip_needs_a_longer_way():
    """Six seconds ahead are 120 m: enough at 0.25 (81.6 m and 18 m), too short at 0.15 (136 m)."""
    log, tick = approach(8.0)
    for mu, answer in ((0.25, "braking"), (0.15, "steering")):
        slippery = replace(log, mu=np.full_like(log.mu, mu))
        assert find_run_avoidance(slippery, ROAD, tick, 1).startswith(answer)
    blind = replace(log, mu=np.full_like(log.mu, np.nan))
    assert find_run_avoidance(blind, ROAD, tick, 1) == "", "without a grip nothing is claimed"


def test_a_thing_that_stands_on_the_road_is_avoided_alike():
    event = ContactEvent(160, -1, "pole", 1.0, V, BEGIN + V * 8.0 + 0.5 * LENGTH, LANE)
    log, tick = approach(8.0, appears=0.0, contacts=(event,))
    assert find_run_avoidance(log, ROAD, tick, -1) == "braking"


def test_a_departure_is_avoided_with_grip_and_not_on_next_to_none():
    """0.1 rad at 20 m/s take 10 s to steer out with 0.02 g."""
    log, _ = approach(16.0, appears=0.0, angle=-0.1)
    a = log.actors
    gone = ROAD.edge.off(a.x[:, 0], a.y[:, 0], a.z[:, 0], a.yaw[:, 0], LENGTH, 2.0)
    tick = int(log.tick[np.flatnonzero(gone)[0]])
    assert find_run_avoidance(log, ROAD, tick, None) == "braking"
    ice = replace(log, mu=np.full_like(log.mu, 0.02))
    assert find_run_avoidance(ice, ROAD, tick, None) == ""
