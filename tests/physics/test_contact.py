from math import pi

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis.strategies import floats
from shapely.affinity import rotate, translate

from skidpad.core.kernels.jit import kernel
from skidpad.core.states import ActorStates
from skidpad.physics import contact, segments
from skidpad.physics.contact import CONTACT_LAW, Contacts, bodies, resolve_contacts
from skidpad.physics.segments import static_segments
from support.examples import examples

DT = 0.05

NOTHING = static_segments(np.empty((0, 4)), np.empty(0), np.empty(0))
RAIL = static_segments(np.array([[-500.0, 0.0, 500.0, 0.0]]), np.zeros(1), np.full(1, 0.8))


@kernel
def find_contacts(states, bodies, rails, dt, out):
    return contact.find_contacts(states, bodies, rails, dt, out)


@kernel
def candidates(lines, x, y, reach, out):
    return segments.candidates(lines, x, y, reach, out)


def cars(*rows):
    """Cars 4 m by 2 m, 1250 kg: rows of x, y, yaw, vx, vy."""
    n = len(rows)
    states = ActorStates.empty(n)
    for i, (x, y, yaw, vx, vy) in enumerate(rows):
        states.x[i], states.y[i], states.yaw[i] = x, y, yaw
        states.vx[i], states.vy[i] = vx, vy
    states.present[:] = True
    size = np.ones(n)
    b = bodies(4 * size, 2 * size, 1.5 * size, 1250 * size, 1800 * size, 0.3 * size)
    return states, b


def resolve(states, b, segments=NOTHING):
    out = Contacts.room()
    return resolve_contacts(states, b, segments, CONTACT_LAW, DT, out), out


def momenta(states, b):
    """Linear momentum, angular momentum about the origin, and kinetic energy."""
    c, s = np.cos(states.yaw), np.sin(states.yaw)
    m, inertia = 1 / b.inverse_mass, 1 / b.inverse_inertia
    vx = states.vx - states.yaw_rate * b.x_cog * s
    vy = states.vy + states.yaw_rate * b.x_cog * c
    x, y = states.x + b.x_cog * c, states.y + b.x_cog * s
    spin = (m * (x * vy - y * vx) + inertia * states.yaw_rate).sum()
    energy = 0.5 * (m * (vx**2 + vy**2) + inertia * states.yaw_rate**2).sum()
    return np.array([(m * vx).sum(), (m * vy).sum(), spin]), float(energy)


def outline(states, i):
    box = translate(rotate(shapely.box(-2, -1, 2, 1), states.yaw[i], (0, 0), use_radians=True))
    return translate(box, states.x[i], states.y[i])


@settings(max_examples=examples(200))
@given(floats(-5, 5), floats(-5, 5), floats(-pi, pi), floats(-pi, pi))
def test_boxes_touch_exactly_when_polygons_do(x, y, yaw_a, yaw_b):
    states, b = cars((0, 0, yaw_a, 0, 0), (x, y, yaw_b, 0, 0))
    shared = outline(states, 0).intersection(outline(states, 1))
    out = Contacts.room()
    found = find_contacts(states, b, NOTHING, DT, out)
    if shared.area > 1e-6:
        assert found == 1
        assert shared.buffer(1e-6).contains(shapely.Point(out.x[0], out.y[0]))
        # Moving i by the depth along the normal parts them, moving by less does not.
        for share, touching in ((1.001, 0), (0.95, 1)):
            moved = states.copy()
            moved.x[0] += share * out.depth[0] * out.nx[0]
            moved.y[0] += share * out.depth[0] * out.ny[0]
            assert find_contacts(moved, b, NOTHING, DT, Contacts.room()) == touching
    elif outline(states, 0).distance(outline(states, 1)) > 1e-6:
        assert found == 0


@settings(max_examples=examples(200))
@given(floats(-3.5, 3.5), floats(-2, 2), floats(-pi, pi), floats(-30, 30), floats(-30, 30))
def test_impulses_conserve_momentum_and_never_make_energy(x, y, yaw, vx, vy):
    states, b = cars((0, 0, 0, 10, 0), (x, y, yaw, vx, vy))
    states.yaw_rate[:] = [0.3, -0.5]
    before, energy = momenta(states, b)
    still = states.copy()
    count, out = resolve(states, b)
    for name in ("x", "y"):  # momentum is compared at the places of the impact
        getattr(states, name)[:] = getattr(still, name)
    after, energy_after = momenta(states, b)
    assert after == pytest.approx(before, abs=1e-5)
    assert energy_after <= energy * (1 + 1e-9)
    assert (out.impulse[:count] >= 0).all()


def test_head_on_with_equal_cars():
    states, b = cars((0, 0, 0, 10, 0), (3.9, 0, pi, -10, 0))
    count, out = resolve(states, b)
    assert count == 1
    assert out.v_closing[0] == pytest.approx(20.0)
    e = 0.1 + 0.3 * np.exp(-20 / 2)
    assert states.vx == pytest.approx([-10 * e, 10 * e])
    assert out.impulse[0] == pytest.approx(1250 * 10 * (1 + e))
    assert (out.nx[0], out.ny[0]) == pytest.approx((-1.0, 0.0))
    assert states.x[1] - states.x[0] == pytest.approx(3.99)


def test_mirrored_crash_is_mirrored():
    one, b = cars((0, 0, 0, 20, 0), (3.0, 1.5, 0.4, 5, -3))
    two, _ = cars((0, 0, 0, 20, 0), (3.0, -1.5, -0.4, 5, 3))
    resolve(one, b)
    resolve(two, b)
    assert one.yaw_rate == pytest.approx(-two.yaw_rate)
    assert one.vy == pytest.approx(-two.vy)
    assert one.vx == pytest.approx(two.vx)


@pytest.mark.parametrize("angle", [0.1, 0.6, pi / 2])
@pytest.mark.parametrize("v", [10.0, 40.0])
def test_a_guardrail_throws_the_car_back(angle, v):
    states, b = cars((0, 0.5, -angle, v * np.cos(angle), -v * np.sin(angle)))
    count, out = resolve(states, b, RAIL)
    assert count == 1
    assert (out.j[0], out.segment[0]) == (-1, 0)
    assert out.ny[0] == pytest.approx(1.0)
    touching = states.vy[0] + states.yaw_rate[0] * (out.x[0] - 0.0)
    assert touching > 0.0
    assert outline(states, 0).bounds[1] > -0.02
    assert np.hypot(states.vx[0], states.vy[0]) < v


def test_a_fast_car_does_not_tunnel_through_the_rail():
    states, b = cars((0, 3.0, -pi / 2, 0, -60.0))
    for _ in range(10):
        states.y[:] += states.vy * DT
        resolve(states, b, RAIL)
    assert states.y[0] > 0.0


@settings(max_examples=examples(200))
@given(floats(0.02, 0.6), floats(5, 45), floats(0, 2), floats(0, 0.02))
def test_a_rail_in_pieces_throws_a_car_back_as_one_piece_does(angle, v, shift, bend):
    """Where two pieces meet nothing sticks out: no joint is an end that stops the nose.

    bend: turn in rad from piece to piece; the whole turn of the few pieces in reach is less than 5 degrees.
    """
    turn = bend * (np.arange(-30, 31))
    x = np.cumsum(2.0 * np.cos(turn)) + shift
    y = np.cumsum(2.0 * np.sin(turn))
    x, y = x - x[30], y - y[30]
    ends = np.column_stack([x[:-1], y[:-1], x[1:], y[1:]])
    pieces = static_segments(ends, np.zeros(60), np.full(60, 0.8))
    car = (-3.0, 1.05 + 2 * abs(np.sin(angle)) - v * DT * np.sin(angle), -angle)
    speeds = (v * np.cos(angle), -v * np.sin(angle))
    (whole, b), (parted, _) = cars((*car, *speeds)), cars((*car, *speeds))
    resolve(whole, b, RAIL)
    found, out = resolve(parted, b, pieces)
    assume(found)
    square = np.abs(out.nx[:found])
    assert (square < 0.15).all()  # no normal along the rail
    if bend == 0.0:
        assert found == 1
        for column in ("x", "y", "vx", "vy", "yaw_rate"):
            assert getattr(parted, column) == pytest.approx(getattr(whole, column), abs=1e-9)


def test_a_corner_of_a_building_stops_the_nose():
    """Its walls meet, but at a right angle: the corner sticks into the front."""
    wall = np.array(
        [[3.0, 0.0, 5.0, 2.0], [5.0, 2.0, 7.0, 0.0], [7.0, 0.0, 5.0, -2.0], [5.0, -2.0, 3.0, 0.0]]
    )
    corner = static_segments(wall - [1.05, 0.0, 1.05, 0.0], np.zeros(4), np.ones(4))
    states, b = cars((0, 0, 0, 10, 0))
    count, out = resolve(states, b, corner)
    assert count
    assert out.nx[:count] == pytest.approx(-1.0)
    assert states.vx[0] < 0.0


def test_end_of_a_rail_stops_the_nose():
    post = static_segments(np.array([[3.9, 0.0, 20.0, 0.0]]), np.zeros(1), np.ones(1))
    ahead, b = cars((2.0, 0.0, 0.0, 15.0, 0.0))
    count, out = resolve(ahead, b, post)
    assert count == 1
    assert out.nx[0] == pytest.approx(-1.0)
    assert ahead.vx[0] < 0.0


def test_cars_eight_metres_above_each_other_never_touch():
    states, b = cars((0, 0, 0, 10, 0), (1, 0, pi / 2, 0, 10))
    states.z[1] = 8.0
    assert resolve(states, b)[0] == 0
    states.z[1] = 1.0
    assert resolve(states, b)[0] == 1
    high, b = cars((0, 0.5, 0, 10, 0))
    high.z[0] = 8.0
    assert resolve(high, b, RAIL)[0] == 0


def test_absent_and_immovable_actors():
    states, b = cars((0, 0, 0, 10, 0), (3, 0, 0, 0, 0), (6, 0, 0, 0, 0))
    states.present[1] = False
    assert resolve(states, b)[0] == 0
    states.present[1] = True
    b.inverse_mass[1] = b.inverse_inertia[1] = 0.0
    count, _ = resolve(states, b)
    assert count == 2
    assert states.vx[1] == 0.0
    assert states.x[1] == 3.0


def test_contacts_come_in_order_and_do_not_depend_on_other_cars():
    rng = np.random.default_rng(5)
    rows = np.column_stack(
        [rng.uniform(-30, 30, (60, 2)), rng.uniform(-3, 3, 60), np.zeros((60, 2))]
    )
    states, b = cars(*rows)
    out = Contacts.room()
    count = find_contacts(states, b, NOTHING, DT, out)
    pairs = list(zip(out.i[:count].tolist(), out.j[:count].tolist(), strict=True))
    expected = [
        (i, j)
        for i in range(60)
        for j in range(i + 1, 60)
        if outline(states, i).intersects(outline(states, j))
    ]
    assert pairs == sorted(pairs) == expected
    assert len(pairs) > 20


def test_grid_finds_what_a_scan_finds():
    rng = np.random.default_rng(6)
    start = rng.uniform(-300, 300, (500, 2))
    lines = np.hstack([start, start + rng.uniform(-60, 60, (500, 2))])
    lines[7, 2:] = lines[7, :2]  # no length, never found
    rails = static_segments(lines, np.zeros(500), np.ones(500))
    near = np.empty(500, dtype=np.int64)
    for x, y in rng.uniform(-320, 320, (50, 2)):
        count = candidates(rails, x, y, 10.0, near)
        low, high = np.minimum(lines[:, :2], lines[:, 2:]), np.maximum(lines[:, :2], lines[:, 2:])
        hit = (low <= [x + 10, y + 10]).all(1) & (high >= [x - 10, y - 10]).all(1)
        hit[7] = False
        assert near[:count].tolist() == np.flatnonzero(hit).tolist()
