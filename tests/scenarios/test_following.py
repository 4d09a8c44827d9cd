"""A scripted actor on its lane: one kernel does what its guide and its driver do apart, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.roads.bundled import load_map
from skidpad.scenarios.movement.motion import Guide
from skidpad.scenarios.movement.network import Network, Place
from skidpad.simulation.scripted import ActorDriver, Motion


@pytest.mark.parametrize("against", [False, True])
@pytest.mark.parametrize("name", ["straight", "figure8"])
def test_the_kernel_answers_as_guide_and_driver_do_apart(name, against):
    map = load_map(name)
    network, driver = Network(map, name), ActorDriver("saloon", 1.1)
    assert not network.even_forks  # the kernel goes straight on
    rng = np.random.default_rng(29)
    ends = 0
    for _ in range(200):
        lane = int(rng.choice(np.flatnonzero(map.arrays.drivable)))
        point = map.at(lane, rng.uniform(0.0, map.lanes.length[lane]))
        pose = point.pose.moved(left=rng.normal())
        if against:
            pose = type(pose)(pose.x, pose.y, pose.z, yaw=pose.yaw + np.pi)
        together, apart = (Guide(network, Place(pose, point), 0.0) for _ in range(2))
        x, y, yaw = pose.x, pose.y, pose.yaw + 0.1 * rng.normal()
        for _ in range(4):
            v, way = rng.uniform(0.0, 30.0), rng.uniform(-2.0, 15.0)
            x, y = x + float(way * np.cos(yaw)), y + float(way * np.sin(yaw))
            motion = Motion(x, y, yaw, float(v * np.cos(yaw)), float(v * np.sin(yaw)))
            told = rng.uniform(0.0, 30.0), *rng.normal(size=6)
            for guide in (together, apart):
                guide.v, guide.a, guide.dv, guide.da = floats_of(told[:4])
                guide.offset, guide.offset_rate, guide.offset_bend = floats_of(told[4:])
            expected = driver.command(motion, apart.demand(motion))
            assert together.command(motion, driver) == expected
            assert together.at_end == apart.at_end
            ends += apart.at_end
        assert together.base == apart.base
    assert ends > 0 or name == "figure8"


def floats_of(values):
    return [float(value) for value in values]


def test_a_lane_behind_which_nothing_is_drivable_is_no_fork(monkeypatch):
    monkeypatch.setattr(Network, "_exits", lambda self, lane: [])
    assert Network(load_map("town"), "town").even_forks == {}
