"""The lens of CARLA's cameras: its equation by hand, against a calibration by others, and values kept."""

import numpy as np
import pytest

from skidpad.sensors.pictures.fringes import BLUE, GREEN, RED, fringes_of, split_colours
from skidpad.sensors.pictures.lens_distortion import LensShape, resample, source_of, source_pixels

DEFAULTS = LensShape(5.0, 0.0, -1.0, 0.0, 0.08, 0.08)
LEADERBOARD = DEFAULTS._replace(falloff=3.0, multiplier=3.0)  # of its agent_wrapper.py


def bent(shape, picture):
    out = np.empty_like(picture)
    resample(source_pixels(shape, picture.shape[1], picture.shape[0]), picture, out)
    return out


def test_the_defaults_move_no_pixel():
    assert not DEFAULTS.bends
    assert not LEADERBOARD._replace(x_size=0.0, y_size=0.0).bends
    numbers = np.arange(800 * 600).reshape(600, 800)
    assert np.array_equal(source_pixels(DEFAULTS, 800, 600), numbers)


def test_the_equation_by_hand():
    """At the middle of the right edge r is 0.08, f 0.92 and the mask (3 sqrt(0.08)) cubed, 0.611."""
    x, y = source_of(LEADERBOARD, np.array([1.0, 1.0, -0.5]), np.array([0.0, 1.0, 0.0]))
    assert x[0] == pytest.approx(1.0 - 2.0 * 0.61094 * 0.08 * 0.92, abs=1e-4)
    assert y[0] == 0.0
    mask = (3.0 * 0.4) ** 3  # in the corner r is 0.16 and f 0.84
    assert x[1] == y[1] == pytest.approx(1.0 - 2.0 * mask * 0.08 * 0.84, abs=1e-4)
    assert x[2] == pytest.approx(-0.5 + 2.0 * (1.5 * 0.08**0.5) ** 3 * 0.02 * 0.98, abs=1e-5)


def test_kcube_and_each_size_act_as_the_equation_says():
    at = np.array([0.8]), np.array([0.6])
    plain_x, _ = source_of(LEADERBOARD, *at)
    stronger, _ = source_of(LEADERBOARD._replace(kcube=2.0), *at)
    assert stronger < plain_x  # f grows, so it moves farther inwards
    only_x, only_y = source_of(LEADERBOARD._replace(y_size=0.0), *at)
    assert only_y == 0.6
    assert plain_x < only_x < 0.8


def test_a_calibration_by_others_agrees():
    """OpenDriveLab/ThinkTwice calibrated the leaderboard's lens on CARLA 0.9.10: 1600 x 900, 150 degrees.

    A radial polynomial cannot follow this lens, whose edges move with x and y apart, so corners and the
    mean of the edges are compared.
    """
    focal, k1, k2, k3 = 214.35935394, 0.00888296, -0.00130899, 0.00028834
    straight = np.linspace(0.0, 4.0, 4001)  # tangents of rays
    square = straight**2
    shown = straight * (1.0 + square * (k1 + square * (k2 + square * k3)))  # OpenCV's model
    places = np.array([[1.0, 1.0], [1.0, 0.0], [0.0, 1.0]])
    radius = np.linalg.norm(places * (800.0, 450.0), axis=1) / focal
    theirs = np.interp(radius, shown, straight) / radius
    x, y = source_of(LEADERBOARD, *places.T)
    ours = np.array([x[0], x[1], y[2]])
    assert ours[0] == pytest.approx(theirs[0], abs=0.02)
    assert ours[1:].mean() == pytest.approx(theirs[1:].mean(), abs=0.03)


def test_straight_lines_bend_by_the_equation_within_a_pixel():
    """Each point of the bent line lies where the equation, solved for it, puts the straight one."""
    width, height, column = 640, 480, 500
    picture = np.zeros((height, width), dtype=np.uint32)
    picture[:, column:] = 1
    edges = bent(LEADERBOARD, picture).argmax(axis=1)  # the first pixel right of the line
    assert edges.max() - edges.min() > 10
    for row in range(0, height, 40):
        y = np.full(4000, (2.0 * row + 1.0) / height - 1.0)
        x = np.linspace(0.0, 1.0, 4000)
        from_x, _ = source_of(LEADERBOARD, x, y)
        met = x[np.searchsorted(from_x, 2.0 * column / width - 1.0)]
        assert abs(edges[row] - 0.5 * width * (met + 1.0)) <= 1.0


def test_the_picture_is_mirrored_with_its_scene_and_no_value_is_made_up():
    rng = np.random.default_rng(3)
    picture = rng.integers(0, 2**32, (60, 80), dtype=np.uint32)
    shown = bent(LEADERBOARD, picture)
    assert np.isin(shown, picture).all()
    assert np.array_equal(bent(LEADERBOARD, picture[:, ::-1].copy()), shown[:, ::-1])
    wide = bent(LEADERBOARD._replace(k=400.0), picture)  # places beyond the picture show its edge
    assert np.isin(wide, picture).all()


def test_fringes_move_red_and_green_by_their_wavelength():
    """A white square: its right edge is red first, by 0.7 % of the way from the middle per 100 nm."""
    picture = np.full((100, 800), 0xFF000000, dtype=np.uint32)
    picture[:, 100:700] = 0xFFFFFFFF
    out = np.empty_like(picture)
    split_colours(fringes_of(2.0, 0.0, 800, 100), picture, out)
    colours = out.view(np.uint8).reshape(100, 800, 4)[50, :, :3]
    widths = (colours.astype(float) ** 2 / 255.0**2).sum(axis=0)  # linear, so edges count in part
    for width, wavelength in ((widths[0], RED), (widths[1], GREEN)):
        share = 2.0 * 0.00007 * (wavelength - BLUE)
        assert width == pytest.approx(600.0 / (1.0 - share), abs=0.2)
    assert widths[2] == 600.0
    inner = fringes_of(2.0, 0.8, 800, 100)
    assert inner.red_x[150] == 150.0  # within the start nothing moves
    assert inner.red_x[799] == pytest.approx(fringes_of(2.0, 0.0, 800, 100).red_x[799], abs=0.05)
