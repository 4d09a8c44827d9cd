"""Against an independent model, inside its valid range (lateral acceleration below 5 m/s^2)."""

import numpy as np
import pytest

from vehicle_validation import ORACLE, brake, handbrake_turn, oracle, step_steer

pytest.importorskip("vehiclemodels")


@pytest.mark.parametrize("delta", [0.01, 0.03, -0.03])
def test_step_steer_against_the_drift_model(delta):
    ours, theirs = step_steer(20.0, delta), oracle(20.0, delta, 0.0, 2.5)
    assert abs(ours.yaw_rate[-1] * 20.0) < 5.0
    assert ours.yaw_rate[-1] == pytest.approx(theirs.yaw_rate[-1], rel=0.05)
    assert ours.yaw_rate[-1] == pytest.approx(20.0 * np.tan(delta) / ORACLE.wheelbase, rel=0.05)
    rise = [t.t[np.argmax(np.abs(t.yaw_rate) > 0.9 * abs(t.yaw_rate[-1]))] for t in (ours, theirs)]
    assert rise[0] == pytest.approx(rise[1], abs=0.1)


@pytest.mark.parametrize("v", [8.0, 15.0, 25.0])
def test_small_steer_at_other_speeds(v):
    delta = 1.5 / v**2 * ORACLE.wheelbase  # 1.5 m/s^2
    ours, theirs = step_steer(v, delta, 4.0), oracle(v, delta, 0.0, 4.0)
    assert ours.yaw_rate[-1] == pytest.approx(theirs.yaw_rate[-1], rel=0.05)


@pytest.mark.parametrize("deceleration", [4.0, 8.0])
def test_braking_against_the_drift_model(deceleration):
    ours = brake(100 / 3.6, deceleration, 9.0)
    theirs = oracle(100 / 3.6, 0.0, deceleration, 9.0)
    assert ours.v[-1] == pytest.approx(0.0, abs=1e-9)
    assert ours.x[-1] == pytest.approx(theirs.x[-1], rel=0.05)


def test_the_spin_of_the_figure_is_a_spin():
    trace = handbrake_turn(0.4, 50 / 3.6)
    assert abs(np.unwrap(trace.yaw)[-1]) > np.radians(100)
