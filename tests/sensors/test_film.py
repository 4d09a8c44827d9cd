"""Film, gamma and white balance: neutral by default, and moved the documented way."""

import numpy as np
import pytest

from skidpad.sensors.pictures.film import (
    Film,
    daylight_colour,
    film_curve,
    grade,
    replace_levels,
    tone_table,
    white_balance,
)
from skidpad.sensors.pictures.packing import pack

LEVELS = np.arange(256)


def test_by_default_no_level_changes():
    assert np.array_equal(tone_table(Film(), 2.2), LEVELS.astype(np.float32))


def test_the_curve_keeps_grey_and_rises():
    light = np.geomspace(1e-4, 1e3, 400)
    for film in (Film(), Film(slope=0.6), Film(toe=0.3), Film(shoulder=0.5), Film(toe=0.9)):
        shown = film_curve(film, light)
        assert (np.diff(shown) > -1e-9).all()
    assert film_curve(Film(), np.array([0.18]))[0] == pytest.approx(0.18, abs=1e-6)
    assert film_curve(Film(), np.array([1e4]))[0] == pytest.approx(1.04, abs=1e-3)


@pytest.mark.parametrize(
    ("film", "dark", "bright"),
    [
        (Film(slope=1.0), -1, +1), (Film(slope=0.7), +1, -1),  # contrast
        (Film(toe=0.8), -1, 0), (Film(toe=0.3), +1, 0),  # darker shadows
        (Film(black_clip=0.05), -1, 0), (Film(shoulder=0.8), 0, +1),
    ],
)  # fmt: skip
def test_settings_of_the_film_move_shadows_and_lights(film, dark, bright):
    moved = tone_table(film, 2.2) - LEVELS
    assert np.sign(np.round(moved[50], 1)) == dark
    if bright:
        assert np.sign(np.round(moved[215], 1)) == bright


def test_gamma_is_the_exponent_that_encodes_light():
    """Encoding by 1 / gamma in place of 1 / 2.2: the same light, seen as pow(light, 1 / gamma)."""
    for gamma in (1.0, 1.8, 2.6):
        table = tone_table(Film(), gamma)
        light = (LEVELS / 255.0) ** 2.2
        assert np.abs(table - 255.0 * light ** (1.0 / gamma)).max() < 1e-3
    assert tone_table(Film(), 2.6)[100] > 100 > tone_table(Film(), 1.8)[100]


def test_light_of_the_temperature_becomes_white():
    """The chromaticities of standard light D50 and D75 (CIE 15) are those of the formula."""
    for temperature, x, y in ((5003.0, 0.3457, 0.3585), (7504.0, 0.2990, 0.3149)):
        found = daylight_colour(temperature / (1.4388 / 1.438))
        assert found == pytest.approx((x, y), abs=2e-4)
    to_xyz = np.array(
        [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    )
    x, y = daylight_colour(9000.0)
    bluish = np.linalg.inv(to_xyz) @ np.array([x / y, 1.0, (1.0 - x - y) / y])
    seen = white_balance(9000.0, 0.0) @ bluish
    assert np.ptp(seen) / seen.mean() < 0.01


def test_a_high_temperature_is_warm_and_a_tint_magenta():
    grey = np.full(3, 0.3)
    warm, cold = white_balance(9000.0, 0.0) @ grey, white_balance(3000.0, 0.0) @ grey
    assert warm[0] > warm[2]
    assert cold[0] < cold[2]
    red, green, blue = white_balance(6500.0, 0.5) @ grey
    assert green < min(red, blue)
    assert white_balance(6500.0, 0.0) == pytest.approx(np.eye(3), abs=2e-3)


def test_grading_is_the_table_and_the_matrix():
    row = np.array([pack(float(k), float(k), float(255 - k)) for k in LEVELS], dtype=np.uint32)
    picture = np.stack([row, row])
    same = picture.copy()
    grade(np.eye(3, dtype=np.float32), LEVELS.astype(np.float32), same)
    assert np.array_equal(same, picture)
    for film in (Film(), Film(slope=1.0, toe=0.3)):
        graded, replaced = picture.copy(), picture.copy()
        grade(np.eye(3, dtype=np.float32), tone_table(film, 1.8), graded)
        levels = np.rint(tone_table(film, 1.8)).astype(np.uint8)
        replace_levels(levels, replaced.view(np.uint8).reshape(2, 256, 4))
        assert np.array_equal(graded, replaced)
    halved = picture.copy()
    matrix = np.diag([0.25, 1.0, 1.0]).astype(np.float32)
    grade(matrix, LEVELS.astype(np.float32), halved)
    red, green = (halved.view(np.uint8).reshape(2, 256, 4)[0, :, k].astype(int) for k in (0, 1))
    assert np.abs(red - LEVELS / 2.0).max() <= 0.51  # a quarter of the light is half the level
    assert np.array_equal(green, LEVELS)
