"""Mirror images that a radar sees in rails, walls and the road: by hand, and by a second route."""

from dataclasses import replace
from math import atan2, hypot, pi, radians, sin, sqrt

import numba
import numpy as np
import pytest
from scipy.optimize import minimize

from skidpad.core.vocabulary import ActorKind
from skidpad.physics import mirrors as physics
from skidpad.physics.optics import RADAR_GHZ
from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside, Shape
from skidpad.sensors.physical_radar.mirrors import mirrors_of, reflect
from skidpad.sensors.physical_radar.radar import PhysicalRadar
from support.sensors.cars import RADAR, world

K = 2.0 * pi * RADAR_GHZ * 1e9 / 299_792_458.0
RAIL_Y = 10.0
WIDE = replace(RADAR, horizontal_fov_deg=120.0)


def rail(kind=BarrierKind.GUARDRAIL, y=RAIL_Y, height=1.2):
    return Barrier(kind, np.array([[0.0, y, 0.0], [80.0, y, 0.0]]), height)


def person(x, y, *others, roadside=None, multipath=True, ticks=30, speed=(-3.0, 0.0)):
    """Detections of all ticks of a person beside a rail, who moves unlike it, and of cars."""
    table, states = world((x, y, 0.0, 0.0), *others)
    n = 1 + len(others)
    kind = np.array([ActorKind.CAR, ActorKind.PEDESTRIAN, *[ActorKind.CAR] * len(others)], np.uint8)
    small = np.ones(n + 1)
    small[1] = 0.1 / 4.5
    table = replace(table, kind=kind, length=4.5 * small, width=1.8 * small)
    states.vx[1], states.vy[1] = speed
    beside = roadside or Roadside(barriers=(rail(),))
    radar = PhysicalRadar(WIDE, beside, table, 1, multipath=multipath)
    return np.concatenate([np.column_stack(radar.measure(k, states)) for k in range(ticks)])


def near(rows, distance, azimuth):
    """Rows about a place, 0.5 m in range and 1 degree across."""
    return rows[(abs(rows[:, 0] - distance) < 0.5) & (abs(rows[:, 1] - azimuth) < radians(1.0))]


def test_a_person_beside_a_rail_has_the_three_images_of_the_labels():
    rows = person(20.0, 1.0)
    ahead, left, image = 18.0, 1.0, 2.0 * RAIL_Y - 1.0
    d, far = hypot(ahead, left), hypot(ahead, image)
    direct, mirror = atan2(left, ahead), atan2(image, ahead)
    assert len(near(rows, d, direct)) > 20
    assert len(near(rows, (d + far) / 2.0, direct)) > 10  # second order, type 1
    assert len(near(rows, (d + far) / 2.0, mirror)) > 10  # second order, type 2
    assert len(near(rows, far, mirror)) > 10  # third order, type 2
    off = person(20.0, 1.0, multipath=False)
    assert not len(near(off, far, mirror))


def test_images_move_as_the_lengths_of_their_ways_change():
    vx, vy, dt = -6.0, 1.5, 1e-4

    def lengths(x, y):
        return hypot(x, y), hypot(x, 2.0 * RAIL_Y - y)

    (d0, f0), (d1, f1) = lengths(18.0, 1.0), lengths(18.0 + vx * dt, 1.0 + vy * dt)
    rows = person(20.0, 1.0, speed=(vx, vy))
    mirror = atan2(2.0 * RAIL_Y - 1.0, 18.0)
    third = near(rows, f0, mirror)
    assert np.mean(third[:, 3]) == pytest.approx((f1 - f0) / dt, abs=0.05)
    second = near(rows, (d0 + f0) / 2.0, mirror)
    assert np.mean(second[:, 3]) == pytest.approx((d1 - d0 + f1 - f0) / 2.0 / dt, abs=0.05)


@pytest.mark.parametrize("turn", [0.0, 0.3, -1.0])
def test_a_mirror_is_met_where_the_way_is_shortest(turn):
    c, s = np.cos(turn), np.sin(turn)
    points = np.array([[-9.0, 4.0], [30.0, 4.0]]) @ np.array([[c, s], [-s, c]])
    barrier = Barrier(BarrierKind.GUARDRAIL, np.column_stack([points, np.zeros(2)]), 3.0)
    mirrors = mirrors_of(Roadside(barriers=(barrier,)))
    origin = np.array([c * 1.0, s * 1.0, 1.0])
    point = (c * 20.0 + s * 2.0, s * 20.0 - c * 2.0, 0.5)
    found = reflect.py_func(mirrors, 0, origin, point, 5.0 + 0j, K)

    def length(at):
        on = np.array([*(points[0] + at[0] * (points[1] - points[0])), at[1]])
        return np.linalg.norm(on - origin) + np.linalg.norm(on - point)

    best = minimize(length, [0.5, 0.7])
    assert np.linalg.norm(found.way) == pytest.approx(best.fun, rel=1e-6)
    on = points[0] + best.x[0] * (points[1] - points[0])
    assert np.array(found.foot) + origin == pytest.approx([*on, best.x[1]], abs=1e-3)
    assert found.power == physics.RAIL_SHARE


def test_there_is_no_image_beyond_an_end_below_or_on_the_other_side_of_a_mirror():
    mirrors = mirrors_of(Roadside(barriers=(rail(height=0.75),)))
    origin, steel = np.array([2.0, 0.0, 1.0]), 1.0 + 0j
    assert reflect.py_func(mirrors, 0, origin, (20.0, 1.0, 0.2), steel, K).power > 0.0
    assert reflect.py_func(mirrors, 0, origin, (20.0, 1.0, 1.0), steel, K).power == 0.0  # over it
    assert reflect.py_func(mirrors, 0, origin, (20.0, 12.0, 0.2), steel, K).power == 0.0
    assert reflect.py_func(mirrors, 0, origin, (200.0, 1.0, 0.2), steel, K).power == 0.0


def test_a_car_in_a_leg_hides_the_image():
    far, mirror = hypot(18.0, 19.0), atan2(19.0, 18.0)
    assert len(near(person(20.0, 1.0), far, mirror)) > 10
    # the second leg goes from the rail at x 11.5 to the person
    assert not len(near(person(20.0, 1.0, (15.75, 5.5, 0.0, 0.0)), far, mirror))


def test_houses_and_walls_mirror_and_fences_and_small_boxes_do_not():
    house = Box(1, 40.0, 10.0, 0.0, 0.2, 12.0, 8.0, 6.0, shape=Shape.BLOCK)
    post = Box(1, 40.0, 10.0, 0.0, 0.2, 0.3, 0.3, 6.0)
    wall, fence = rail(BarrierKind.WALL), rail(BarrierKind.FENCE)
    mirrors = mirrors_of(Roadside(barriers=(fence, wall, rail()), boxes=(house, post)))
    assert mirrors.rail.tolist() == [True, False, False, False, False, False]
    corner = np.array([40.0 + 6.0 * np.cos(0.2) + 4.0 * sin(0.2), 10.0 + 6.0 * sin(0.2)])
    corner[1] -= 4.0 * np.cos(0.2)
    assert [mirrors.walls.x0[2], mirrors.walls.y0[2]] == pytest.approx(corner.tolist())


def test_reflection_by_hand():
    across, within = physics.fresnel_across.py_func, physics.fresnel_within.py_func
    smooth = physics.smooth_share.py_func
    assert across(4.0 + 0j, 1.0) == pytest.approx((1.0 - 2.0) / (1.0 + 2.0))
    assert within(4.0 + 0j, 1.0) == pytest.approx((4.0 - 2.0) / (4.0 + 2.0))
    assert within(4.0 + 0j, 1.0 / sqrt(5.0)) == pytest.approx(0.0, abs=1e-12)  # Brewster
    assert abs(across(4.0 + 0j, 1e-6)) == pytest.approx(1.0, abs=1e-5)
    assert smooth(1e-3, 0.5, 2.0 * pi / 4e-3) == pytest.approx(np.exp(-0.5 * (pi / 2.0) ** 2))
    # eta'' = 17.98 sigma / f, sigma = 0.0462 77^0.7822 = 1.381 S/m
    assert physics.concrete_permittivity(77.0) == pytest.approx(5.24 - 0.3225j, abs=1e-3)


def test_concrete_of_another_revision_mirrors_alike():
    # not used: buildingMaterialPermittivity of MATLAB R2021a prints 5.31 and 0.19305 S/m at 9 GHz
    other = 5.31 - 17.975j * 0.19305 / 9.0
    for sine in (0.05, 0.2, 0.5, 1.0):
        one = abs(physics.fresnel_across.py_func(physics.concrete_permittivity(9.0), sine))
        assert one == pytest.approx(abs(physics.fresnel_across.py_func(other, sine)), rel=0.02)


def test_the_road_gives_the_lobes_of_two_rays():
    @numba.njit
    def gain(near, far, sine):
        return physics.two_ray_gain(near, far, sine, K)

    # at grazing angles Gamma is -1: 16 sin^4(k h_a h_t / d); compared with Gamma's own size
    high, low = 0.3, 0.2
    for distance in (40.0, 60.0, 90.0, 130.0):
        near, far = hypot(distance, high - low), hypot(distance, high + low)
        closed = 16.0 * sin(K * high * low / distance) ** 4
        assert gain(near, far, (high + low) / far) == pytest.approx(closed, rel=0.15, abs=0.3)
    steps = np.linspace(20.0, 150.0, 400)
    all_of = [gain(hypot(d, 0.2), hypot(d, 1.8), 1.8 / hypot(d, 1.8)) for d in steps]
    assert 0.0 <= min(all_of) < 0.5
    assert 8.0 < max(all_of) <= 16.0


def test_without_the_switch_nothing_mirrors():
    table, states = world((40.0, 0.0, 0.0, 0.0), (60.0, 3.0, 0.0, 0.2))
    beside = Roadside(barriers=(rail(y=4.0),))
    off, on = (PhysicalRadar(RADAR, beside, table, 1, multipath=m) for m in (False, True))
    rows = [np.column_stack(r.measure(3, states)) for r in (off, on)]
    behind = [np.sum(r[:, 0] * np.sin(r[:, 1]) > 6.0) for r in rows]
    assert behind[0] == 0
    assert behind[1] > 0
