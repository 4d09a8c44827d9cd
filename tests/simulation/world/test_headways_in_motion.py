"""The headway that a driver of the background keeps is the one that was drawn for it."""

from __future__ import annotations

import pytest

from skidpad.campaign.bench.traffic import background_world
from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.campaign.bench.traffic_watch import leaders
from skidpad.core.vocabulary import Headways
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.traffic.idm import GAP_MIN, Character, idm


@pytest.mark.parametrize("held_up", [1.02, 1.05, 1.3])
@pytest.mark.parametrize("v", [5.0, 15.0, 30.0])
def test_the_steady_gap_of_the_exact_model_hangs_on_the_headway_alone(
    v: float, held_up: float
) -> None:
    exact, plain = (Character(1.2, 1.4, 2.0, -8.0, is_exact) for is_exact in (True, False))
    gap = GAP_MIN + 1.2 * v
    assert idm(v, held_up * v, gap, v, exact) == pytest.approx(0.0, abs=1e-9)
    assert idm(v, held_up * v, gap, v, plain) < -0.4, "the plain model falls back"
    closer, farther = (idm(v, held_up * v, f * gap, v, exact) for f in (0.9, 1.1))
    assert closer < 0.0 < farther


@pytest.mark.parametrize("headway", [0.5, 1.0, 2.5])
def test_a_driver_on_a_motorway_ends_up_at_its_headway(headway: float) -> None:
    asked = TrafficBench(map="motorway", vehicles=2, headways=Headways.FIELD)
    world = background_world(asked, "clear-noon", 1)
    traffic, placed = world.traffic, world.placed
    assert traffic is not None
    traffic.waiting.clear()
    lane, s = int(placed["lane"][0]), float(placed["s"][0])
    world.put(1, load_map("motorway").at(lane, s + 60.0).pose, 20.0)
    traffic.engage(1, lane, s + 60.0)
    trait = traffic.drivers.trait
    trait["factor"][:2], trait["headway"][0] = (1.2, 0.7), headway
    trait["eager"][:2] = 0.0
    for _ in range(900):
        traffic.drivers.state["change"][:2] = 5.0  # no change of lane
        world.step()
    leader, gap = leaders(world)
    assert leader[0] == 1
    assert gap[0] / placed["speed"][0] == pytest.approx(headway, rel=0.04)
