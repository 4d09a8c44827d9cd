"""Against an independent model, inside its valid range (lateral acceleration below 5 m/s^2)."""

import csv
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from vehicle_validation import ORACLE, brake, handbrake_turn, oracle, rises, step_steer

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


def test_the_yaw_rate_rises_on_water_snow_and_ice_as_in_the_drift_model_and_as_the_page_says():
    """Softer tyres answer later; with the dry stiffness, the default, no road changes the rise."""
    rows = rises()
    for row in rows:
        assert row["rise_here_s"] == pytest.approx(row["rise_drift_model_s"], rel=0.1)
        assert row["yaw_rate_here_rad_s"] == pytest.approx(
            row["yaw_rate_drift_model_rad_s"], rel=0.03
        )
        assert row["rise_here_dry_stiffness_s"] == rows[0]["rise_here_s"]
    by_stiffness = sorted(rows, key=lambda row: row["stiffness"])
    assert all(a["rise_here_s"] > b["rise_here_s"] for a, b in pairwise(by_stiffness))
    page = Path(__file__).parents[2] / "docs" / "step-steer.csv"
    with page.open(encoding="utf-8") as file:
        published = list(csv.DictReader(file))
    for row, said in zip(rows, published, strict=True):
        assert row["surface"] == said["surface"]
        assert row["rise_here_s"] == pytest.approx(float(said["rise_here_s"]), abs=0.02)
        assert row["rise_drift_model_s"] == pytest.approx(
            float(said["rise_drift_model_s"]), abs=0.02
        )
