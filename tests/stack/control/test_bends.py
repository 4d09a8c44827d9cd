"""Slowing for bends: by hand, on a drawn road, and through figure8's own bends."""

from __future__ import annotations

from math import inf

import pytest
from hypothesis import given
from hypothesis.strategies import floats

from skidpad.campaign.runs.run import run
from skidpad.core.courses import Roads
from skidpad.core.run import AdasDriver, Function, RunSpec
from skidpad.core.vocabulary import SensorLevel, Tier
from skidpad.roads.bundled import load_map
from skidpad.stack.adas import AdasStack
from skidpad.stack.control.bends import BendSpeed, bend_speed, speed_before
from support.stack_parts import Request, slow_for_bend
from support.stackfakes import SPECS, ArcMap, ego_at, frame


def test_speeds_by_hand() -> None:
    assert bend_speed(1.0 / 75.0) == pytest.approx(15.0)  # 15^2 / 75 = 3 m/s^2
    assert bend_speed(-1.0 / 75.0) == pytest.approx(15.0)
    assert bend_speed(0.0) == inf
    assert speed_before(15.0, 100.0) == pytest.approx(22.913, abs=1e-3)  # 15^2 + 2 x 1.5 x 100


@given(v=floats(16.0, 45.0))
def test_braking_as_planned_arrives_at_the_speed_of_the_bend(v: float) -> None:
    begins = 700.0  # m to a bend of R 75

    def ahead(x: float) -> float:
        return 1.0 / 75.0 if x >= begins else 0.0

    bends, x, dt = BendSpeed(0.05), 0.0, 0.05
    while x < begins:
        allowed = bends.update(v, lambda d, x=x: ahead(x + d))
        v -= 1.7 * dt if v > allowed else 0.0
        x += v * dt
    assert v < 15.0 + 1.0  # a step of 5 m and a look every 0.2 s


def test_the_harder_braking_wins() -> None:
    cruise, stop = Request(Tier.CRUISE, throttle=0.5), Request(Tier.HARD_STOP, brake=1.0)
    assert slow_for_bend(cruise, 20.0, inf) == cruise
    assert slow_for_bend(cruise, 20.0, 20.0) == cruise
    assert slow_for_bend(cruise, 20.5, 20.0) == Request(Tier.BEND, brake=pytest.approx(0.2))
    assert slow_for_bend(cruise, 40.0, 20.0).brake == 0.4
    assert slow_for_bend(stop, 40.0, 20.0) == stop


def test_a_bend_is_braked_for_only_with_the_function() -> None:
    for functions, tier in ((["acc", "lca"], Tier.CRUISE), (["acc", "lca", "bend"], Tier.BEND)):
        stack = AdasStack(SPECS, ArcMap(curvature=1.0 / 75.0), {"functions": functions})
        command = stack.tick(frame(0, [], ego_at(0.0, 0.0, 0.0, 20.0), level="objects"))
        assert stack.report.tier is tier
        assert (command.brake > 0.0) is (tier is Tier.BEND)


def test_figure8_s_bends_are_entered_at_their_speed() -> None:
    def sharpest(*functions: Function) -> float:
        """m/s^2 that the lane's curvature asks for at the speed driven."""
        driver = AdasDriver(label="x", functions=frozenset(functions))
        spec = RunSpec(
            driver=driver, course=Roads(vehicles=0), sensors=SensorLevel.OBJECTS, duration=35.0
        )
        ego, map = run(spec).log.actors, load_map("figure8")
        asked = []
        for k in range(0, len(ego.x), 10):
            place = map.project(*(float(c[k, 0]) for c in (ego.x, ego.y, ego.z)))
            if place is not None:
                v_sq = float(ego.vx[k, 0] ** 2 + ego.vy[k, 0] ** 2)
                asked.append(v_sq * abs(place.curvature))
        return max(asked)

    assert sharpest(Function.ACC, Function.LCA, Function.BEND) < 3.6
    assert sharpest(Function.ACC, Function.LCA) > 6.0
