"""What makes the object sensors fast changes no bit of their readings."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside
from skidpad.sensors.object_level.boxes import Boxes
from skidpad.sensors.object_level.objects import ObjectSuite
from support.sensors import plain_objects
from support.sensors.cars import BUMPER, RADAR, ROOF, world

SLOPE = np.array([0.02, -0.01])


def barrier(*points, height=0.8):
    return Barrier(BarrierKind.GUARDRAIL, np.array(points, dtype=float), height)


def random_roadside(rng):
    """Stretches of rail all around, some of kilometres, some without length, and posts."""
    rails = []
    for _ in range(40):
        start = rng.uniform(-60.0, 120.0, 2)
        way = rng.normal(size=2) * rng.choice([0.5, 5.0, 60.0, 5000.0])
        rails.append(barrier((*start, 0.0), (*(start + way), rng.uniform(-1.0, 1.0))))
    rails.append(barrier((20.0, 1.0, 0.0), (20.0, 1.0, 0.0), (30.0, 1.0, 0.0)))
    posts = [
        Box(20, *rng.uniform(-20.0, 80.0, 2), 0.0, rng.uniform(-pi, pi), *rng.uniform(0.1, 3.0, 3))
        for _ in range(15)
    ]
    return Roadside(barriers=tuple(rails), boxes=tuple(posts))


def random_scene(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(0, 30))
    others = [
        (*rng.uniform((-10.0, -12.0), (120.0, 12.0)), 0.0, rng.uniform(-pi, pi)) for _ in range(n)
    ]
    if n > 3:  # two at one distance, one around the sensors, one that touches them
        others[1] = (*others[0][:2], 0.0, others[0][3] + 0.3)
        others[2] = (2.0, 0.3, 0.0, 0.4)
    table, states = world(*others)
    m = n + 1
    states.yaw[0], states.pitch[0], states.roll[0] = rng.normal(scale=(0.3, 0.03, 0.03))
    states.vx[:], states.vy[:] = rng.normal(scale=10.0, size=(2, m))
    states.yaw_rate[:] = rng.normal(scale=0.3, size=m)
    states.present[1:] = rng.random(n) > 0.1
    return table, states, random_roadside(rng)


def plain(table, states, suite, tick):
    """Readings of both cameras and the radar by the oracle."""
    t = table
    boxes = Boxes(states.x, states.y, states.z, states.yaw, t.length, t.width, t.height)
    seen = [
        plain_objects.see(
            states, boxes, suite.labels, mount, s.focal, s.width, s.height, suite.limit
        )
        for s, mount in suite.cameras
    ]
    radar = suite.antennas[0]
    return seen, plain_objects.cast_radar(
        radar, tick, boxes, states, suite.walls, suite.posts, SLOPE
    )


def assert_same(table, states, roadside, ticks, radar=RADAR):
    suite = ObjectSuite(roadside, table, [ROOF, BUMPER, radar], seed=5, dt=0.05)
    suite._radar.slope[:] = SLOPE
    hits = 0
    for tick in ticks:
        seen, echoes = plain(table, states, suite, tick)
        for (rows, labels), fast in zip(seen, suite.segments(states).values(), strict=True):
            now = np.column_stack((fast.u, fast.width, fast.top, fast.bottom, fast.depth))
            assert now.tobytes() == rows.tobytes(), f"a camera differs in tick {tick}"
            assert fast.label.tobytes() == labels.tobytes()
        radar = suite.radar(tick, states)
        now = np.column_stack((radar.range, radar.azimuth, radar.altitude, radar.velocity))
        assert now.tobytes() == echoes.tobytes(), f"the radar differs in tick {tick}"
        hits += len(echoes)
    return hits


@pytest.mark.parametrize("block", range(4))
def test_random_scenes_read_the_same(block):
    hits = sum(assert_same(*random_scene(1000 * block + k), range(3)) for k in range(200))
    assert hits > 15000


@pytest.mark.parametrize(
    "rails",
    [
        [barrier((2.0, 0.0, 0.0), (90.0, 0.0, 0.0), height=3.0)],  # the antenna stands on its line
        [barrier((-90.0, 1e-4, 0.0), (90.0, 1e-4, 0.0), height=3.0)],  # and almost on it
        [barrier((-2500.0, 1e-2, 0.0), (2500.0, -1e-2, 0.0), height=3.0)],  # 5 km, through it
        [
            barrier((-2500.0, 2.0, 0.0), (2500.0, 2.0, 0.0)),
            barrier((30.0, -9.0, 0.0), (30.0, 9.0, 0.0)),
        ],
        [
            barrier((10.0, -9.0, 0.0), (10.0, 9.0, 0.0)),
            barrier((10.0, -9.0, 0.0), (10.0, 9.0, 0.0)),
        ],
        [
            barrier((2.0, 0.0, 0.0), (2.0, 0.0, 0.0), (2.0, 3.0, 0.0))
        ],  # without length, at the antenna
    ],
)
def test_walls_at_the_antenna_and_of_kilometres(rails):
    table, states = world((40.0, 0.0, 0.0, 0.0), (40.0, 0.0, 0.0, 0.0), (2.0, 0.0, 0.0, 0.0))
    assert assert_same(table, states, Roadside(barriers=tuple(rails)), range(40)) > 0


def test_rays_that_look_sideways_are_compared_with_every_wall():
    wide = replace(RADAR, horizontal_fov_deg=178.0, vertical_fov_deg=4.0)
    assert sum(assert_same(*random_scene(k), range(3), wide) for k in range(100)) > 5000


def test_a_fault_of_one_bit_is_found(monkeypatch):
    table, states, roadside = random_scene(7)
    fast = ObjectSuite.radar

    def off_by_one_bit(*asked):
        points = fast(*asked)
        points.range[0] = np.nextafter(points.range[0], np.float32(np.inf))
        return points

    monkeypatch.setattr(ObjectSuite, "radar", off_by_one_bit)
    with pytest.raises(AssertionError, match="the radar differs in tick 0"):
        assert_same(table, states, roadside, range(3))


def test_a_reading_stays_as_it_was_when_the_next_one_is_taken():
    table, states, roadside = random_scene(7)
    suite = ObjectSuite(roadside, table, [ROOF, BUMPER, RADAR], seed=5, dt=0.05)
    first = suite.segments(states)["roof"].depth
    kept = first.copy()
    states.x[1:] += 5.0
    suite.segments(states)
    assert np.array_equal(first, kept)
