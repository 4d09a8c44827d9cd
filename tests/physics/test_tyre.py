import numpy as np
import pytest

from skidpad.physics.tyre import SLIDE_SHARE, brush_curve, brush_secant


def brush_by_integration(sigma, n=20_000):
    """Bristles deflect along the patch until the parabolic pressure lets them slide."""
    x = (np.arange(n) + 0.5) / n  # from the leading edge, patch length 1
    pressure = 6.0 * x * (1.0 - x)  # times mu Fz
    elastic = 6.0 * sigma * x  # 3 sigma mu Fz in total if nothing slid: 3 sigma = 6 sigma / 2
    return float(np.minimum(elastic, pressure).mean())


@pytest.mark.parametrize("sigma", [0.05, 0.3, 0.5, 0.8, 0.99])
def test_curve_against_the_bristles(sigma):
    assert brush_curve(sigma) == pytest.approx(brush_by_integration(sigma), abs=1e-4)


def test_peak_and_fall_off():
    sigma = np.linspace(0.0, 60.0, 6001)
    force = np.array([brush_curve(s) for s in sigma])
    assert force.max() == brush_curve(1.0) == 1.0
    assert (np.diff(force[sigma <= 1.0]) > 0).all()
    assert (np.diff(force[sigma >= 1.0]) < 0).all()
    assert force[-1] == pytest.approx(SLIDE_SHARE, abs=2e-3)
    assert np.abs(np.diff(force)).max() < 0.031  # no jumps: steepest at the origin, slope 3


@pytest.mark.parametrize("sigma", [1e-9, 0.2, 0.7, 1.0, 1.5, 10.0])
def test_secant_is_force_over_slip(sigma):
    assert 3.0 * sigma * brush_secant(sigma) == pytest.approx(brush_curve(sigma), rel=1e-12)


def test_stiffness_at_the_origin():
    assert brush_secant(0.0) == 1.0
