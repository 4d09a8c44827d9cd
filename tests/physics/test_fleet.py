import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.physics.fleet import Fleet
from skidpad.physics.types import EGO_TYPE, vehicle_type, vehicle_types
from skidpad.physics.tyre import RELAXATION_RADII

EGO = vehicle_type(EGO_TYPE)
DT = 0.05


def command(throttle=0.0, brake=0.0, steer=0.0, handbrake=False, reverse=False, n=1):
    return np.tile(np.array([throttle, brake, steer, float(handbrake), float(reverse)]), (n, 1))


def fleet(v=0.0, types=(EGO,), **options):
    f = Fleet(types, DT, **options)
    for i in range(len(types)):
        f.place(i, Pose(0.0, 10.0 * i), v)
    return f


def drive(f, seconds, mu=0.9, grade=0.0, **inputs):
    n = len(f)
    for _ in range(round(seconds / DT)):
        f.step(command(n=n, **inputs), np.full((n, 4), mu), grade=np.full(n, grade))


def stopping_distance(v, mu, **options):
    f = fleet(v, **options)
    for _ in range(4000):
        drive(f, DT, mu, brake=1.0)
        if f.states.vx[0] == 0.0:
            return float(f.states.x[0])
    raise AssertionError("never stopped")


@pytest.mark.parametrize("kmh", [50, 80, 100])
@pytest.mark.parametrize("mu", [0.8, 0.4, 0.15])
def test_anti_lock_stop_against_theory(kmh, mu):
    # m dv/dt = -mu m g - d v^2 integrates to (m / 2d) ln(1 + d v^2 / (mu m g)).
    v, drag, mass = kmh / 3.6, 0.5 * 1.225 * EGO.drag_area, EGO.mass
    theory = mass / (2 * drag) * np.log1p(drag * v * v / (mu * mass * 9.80665))
    assert stopping_distance(v, mu) == pytest.approx(theory, rel=0.04)


@pytest.mark.parametrize("mu", [0.8, 0.4, 0.15])
def test_locked_wheels_slide_further(mu):
    theory = (100 / 3.6) ** 2 / (2 * 9.80665 * mu)
    locked = stopping_distance(100 / 3.6, mu, anti_lock=False)
    assert 1.02 < locked / theory < 1.13
    assert locked > stopping_distance(100 / 3.6, mu)


def test_halving_mu_doubles_the_distance_and_distance_grows_with_speed_squared():
    assert stopping_distance(20.0, 0.4) / stopping_distance(20.0, 0.8) == pytest.approx(2, rel=0.05)
    ratio = stopping_distance(80 / 3.6, 0.8) / stopping_distance(40 / 3.6, 0.8)
    assert ratio == pytest.approx(4, rel=0.05)


@pytest.mark.parametrize("anti_lock", [True, False])
@pytest.mark.parametrize("mu", [0.9, 0.15])
def test_ten_milliseconds_are_fine_enough(mu, anti_lock):
    coarse = stopping_distance(27.8, mu, anti_lock=anti_lock)
    fine = stopping_distance(27.8, mu, anti_lock=anti_lock, substep=0.001)
    assert coarse == pytest.approx(fine, rel=0.03)


def test_every_type_brakes_and_accelerates():
    types = tuple(vehicle_types().values())
    f = fleet(0.0, types)
    drive(f, 10.0, throttle=1.0)
    assert (f.states.vx > 12.0).all()
    assert (np.abs(f.states.vy) < 1e-9).all()
    drive(f, 15.0, brake=1.0)
    assert (f.states.vx == 0.0).all()


def test_left_steer_turns_left_and_mirrored_input_mirrors_the_motion():
    left, right = fleet(15.0), fleet(15.0)
    drive(left, 3.0, steer=0.08, throttle=0.3)
    drive(right, 3.0, steer=-0.08, throttle=0.3)
    assert left.states.yaw[0] > 0.3
    assert left.states.y[0] > 0.0
    assert left.states.roll[0] > 0.0  # leans outwards: left side up
    for name in ("y", "yaw", "vy", "yaw_rate", "ay", "roll"):
        mirrored = -getattr(right.states, name)
        assert getattr(left.states, name) == pytest.approx(mirrored, abs=1e-9)
    for name in ("x", "vx", "ax", "pitch"):
        assert getattr(left.states, name) == pytest.approx(getattr(right.states, name), abs=1e-9)


def test_motion_does_not_depend_on_where_and_whither():
    here, there = fleet(15.0), fleet()
    there.place(0, Pose(500.0, -300.0, yaw=2.0), 15.0)
    drive(here, 2.0, steer=0.1)
    drive(there, 2.0, steer=0.1)
    dx, dy = there.states.x[0] - 500.0, there.states.y[0] + 300.0
    c, s = np.cos(2.0), np.sin(2.0)
    assert here.states.x[0] == pytest.approx(c * dx + s * dy, abs=1e-8)
    assert here.states.y[0] == pytest.approx(-s * dx + c * dy, abs=1e-8)


def test_slow_circle_is_ackermann():
    # At walking pace the rear axle's centre turns on the circle L / tan(delta), a little wider as
    # the car understeers.
    f = fleet(2.0)
    drive(f, 8.0, steer=0.2, throttle=0.12)
    radius_rear = EGO.wheelbase / np.tan(f.wheels.steer[0])
    radius_rear += EGO.understeer * f.speed(0) ** 2 / f.wheels.steer[0]
    assert 1.0 < f.speed(0) < 4.0
    assert f.speed(0) / f.states.yaw_rate[0] == pytest.approx(radius_rear, rel=0.02)


def test_braking_dives_and_a_hill_tilts():
    f = fleet(25.0)
    drive(f, 1.0, brake=0.6)
    assert f.states.ax[0] < -5.0
    assert f.states.pitch[0] > 0.01  # nose down
    g = fleet(20.0)
    drive(g, 0.5, grade=0.06, throttle=0.4)
    assert g.states.pitch[0] < -0.05


@pytest.mark.parametrize("kmh", [50, 100])
@pytest.mark.parametrize("mu", [0.9, 0.4, 0.15])
def test_handbrake_spins_the_car_when_it_turns_and_not_when_straight(kmh, mu):
    turning = fleet(kmh / 3.6)
    drive(turning, 0.5, mu, steer=0.02)
    heading = unwrapped = float(turning.states.yaw[0])
    for _ in range(400):
        drive(turning, DT, mu, steer=0.02, handbrake=True)
        step = (turning.states.yaw[0] - heading + np.pi) % (2 * np.pi) - np.pi
        unwrapped, heading = unwrapped + step, float(turning.states.yaw[0])
    assert abs(unwrapped) > np.radians(100)
    straight = fleet(kmh / 3.6)
    drive(straight, 40.0, mu, handbrake=True)
    assert abs(straight.states.yaw[0]) < 1e-9
    assert straight.states.vx[0] == 0.0


@pytest.mark.parametrize("brakes", [{"brake": 0.5}, {"handbrake": True}])
def test_a_braked_car_stands_on_a_hill(brakes):
    f = fleet(1.0)
    drive(f, 5.0, grade=0.06, **brakes)
    x = float(f.states.x[0])
    drive(f, 60.0, grade=0.06, **brakes)
    assert f.states.x[0] == x
    assert f.states.vx[0] == 0.0
    drive(f, 2.0, grade=0.06)
    assert f.states.vx[0] < -0.5


def test_ice_is_too_slippery_for_the_hill():
    f = fleet(0.0)
    drive(f, 5.0, mu=0.05, grade=0.12, brake=1.0)
    assert f.states.vx[0] < -1.0


def test_reverse():
    f = fleet(0.0)
    drive(f, 3.0, throttle=0.4, reverse=True)
    assert f.states.vx[0] < -2.0
    assert f.speed(0) == pytest.approx(f.states.vx[0])
    assert f.gear(0, reverse=True) == -1


def test_energy_never_grows_when_coasting():
    f = fleet(30.0)
    drive(f, 1.0, steer=0.3, mu=0.4)
    p = f.params

    def energy():
        s = f.states
        c, sn, d = np.cos(s.yaw[0]), np.sin(s.yaw[0]), p.x_cog[0] * s.yaw_rate[0]
        vx, vy = s.vx[0] - d * sn, s.vy[0] + d * c
        spin = 0.5 * p.wheel_inertia[0] * float((f.wheels.omega[0] ** 2).sum())
        body = p.mass[0] * (vx**2 + vy**2) + p.yaw_inertia[0] * s.yaw_rate[0] ** 2
        return 0.5 * float(body) + spin

    def stored():  # in tyres bent sideways: half of stiffness, relaxation length and slip squared
        stiffness = np.repeat(p.stiffness[0], 2) * f.wheels.load[0]
        length = RELAXATION_RADII * p.wheel_radius[0]
        return 0.5 * length * float((stiffness * f.wheels.slip_y[0] ** 2).sum())

    before, bent = energy(), stored()
    rng = np.random.default_rng(3)
    for _ in range(400):
        drive(f, DT, mu=0.4, steer=float(rng.uniform(-1, 1)))
        after = energy()
        assert after <= before * (1 + 1e-6) + bent
        before, bent = after, stored()


@pytest.mark.parametrize("seed", [1, 2])
def test_random_inputs_stay_finite_and_bounded(seed):
    rng = np.random.default_rng(seed)
    types = tuple(vehicle_types().values()) * 5
    f = fleet(20.0, types)
    n = len(types)
    for _ in range(400):
        inputs = np.column_stack(
            [rng.random(n), rng.random(n), rng.uniform(-1, 1, n), rng.random((n, 2)) < 0.2]
        )
        mu, slope = rng.uniform(0.02, 1.5, (n, 4)), rng.uniform(-0.15, 0.15, (2, n))
        for _ in range(5):
            f.step(inputs, mu, slope[0], slope[1])
    for column in f.states[:11]:
        assert np.isfinite(column).all()
    assert (np.hypot(f.states.vx, f.states.vy) < 90.0).all()
    assert (np.abs(f.states.yaw_rate) < 8.0).all()
    assert np.isfinite(f.wheels.omega).all()
    assert (f.wheels.load >= 0.0).all()


def cog_velocity(f):
    s, d = f.states, f.params.x_cog * f.states.yaw_rate
    return np.array([s.vx - d * np.sin(s.yaw), s.vy + d * np.cos(s.yaw)])


@pytest.mark.parametrize("mu", [0.1, 0.5, 1.0])
def test_acceleration_stays_inside_the_friction_circle(mu):
    rng = np.random.default_rng(7)
    f = fleet(30.0, tuple(vehicle_types().values()) * 3)
    n = len(f)
    largest = np.zeros(n)
    for _ in range(200):
        inputs = np.column_stack(
            [rng.random(n), rng.random(n), rng.uniform(-1, 1, n), np.zeros((n, 2))]
        )
        before = cog_velocity(f)
        f.step(inputs, np.full((n, 4), mu))
        v = np.hypot(*before)
        a = np.hypot(*(cog_velocity(f) - before)) / DT
        drag = f.params.drag * v**2 / f.params.mass
        rolling = v > 1.0  # coming to rest is no matter of friction
        assert (a[rolling] <= (mu * 9.80665 + drag)[rolling] * (1 + 1e-9)).all()
        largest = np.maximum(largest, np.where(rolling, a, 0.0))
    assert (largest > 0.6 * min(mu, 0.7) * 9.80665).all()


@pytest.mark.req("B-032", "B-033", "B-064", "B-067")
def test_each_wheel_scales_mu_by_its_own_friction_once():
    f = fleet(10.0)
    f.tire_friction[0] = [3.5, 1.75, 7.0, 3.5]
    for _ in range(3):
        drive(f, DT, mu=0.4)
        assert f.mu[0] == pytest.approx([0.4, 0.2, 0.8, 0.4])


def test_split_mu_pulls_to_the_gripping_side():
    f = fleet(25.0)
    for _ in range(20):
        f.step(command(brake=1.0), np.array([[0.9, 0.1, 0.9, 0.1]]))
    assert f.states.yaw_rate[0] > 0.05


def test_what_is_not_present_stays():
    f = fleet(10.0, (EGO, EGO))
    f.states.present[1] = False
    drive(f, 1.0)
    assert f.states.x[0] > 9.0
    assert f.states.x[1] == 0.0


def test_an_impulse_conserves_momentum_and_turns():
    f = fleet(0.0)
    p = f.params
    point = (float(p.x_cog[0]) - 1.0, 0.0)
    f.apply_impulse(0, (0.0, 5000.0), point)
    s = f.states
    vy_cog = s.vy[0] + s.yaw_rate[0] * p.x_cog[0]
    assert p.mass[0] * vy_cog == pytest.approx(5000.0)
    assert p.yaw_inertia[0] * s.yaw_rate[0] == pytest.approx(-5000.0)


def test_same_inputs_same_bytes():
    runs = []
    for _ in range(2):
        f = fleet(20.0, (EGO, vehicle_type("truck")))
        drive(f, 5.0, mu=0.3, steer=0.2, throttle=0.5)
        runs.append(b"".join(column.tobytes() for column in f.states))
    assert runs[0] == runs[1]


def test_a_gentle_turn_hardly_depends_on_the_step():
    ends = []
    for substep in (0.001, 0.01):
        f = fleet(20.0, substep=substep)
        drive(f, 2.0, steer=0.05, throttle=0.2)
        ends.append((f.states.y[0], f.states.yaw[0], f.states.yaw_rate[0]))
    assert ends[1] == pytest.approx(ends[0], rel=0.03)
