"""Film, gamma and white balance of a finished picture, as Unreal's post-process settings describe them.

Film: Unreal's filmic curve per colour, without its changes of gamut (FilmToneMap of its shader TonemapCommon,
as published in ports of it). Pictures here have no such curve, so what a picture shows counts as the result
of the default curve: the light before it is found, and the wanted curve is laid over that. White balance:
light of the colour temperature and tint becomes white, by Bradford's chromatic adaptation to D65, as in
Unreal's WhiteBalance; daylight from 4000 K on (CIE), below it a black body (Krystek 1985). Gamma: 2.2 leaves
a picture as it is.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Bytes, Floats, Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.pictures.packing import pack, rounded, unpack

GREY = 0.18  # that the curve keeps
GAMMA = 2.2  # of today's pictures
LEAST, MOST = 1e-6, 1e4  # linear light that the curve is inverted for
STEPS = 4096
LAST = 255
ZERO, ONE = np.float32(0.0), np.float32(1.0)
WHITE, TOP = np.float32(LAST), np.float32(LAST - 1)
D65 = (0.31270, 0.32900)
WARM = 4000.0  # K, below which white is that of a black body
TINT = 0.05  # of u and v, at a tint of 1
BRADFORD = np.array(
    [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]
)
SRGB_TO_XYZ = np.array(
    [
        [0.4123908, 0.3575843, 0.1804808],
        [0.2126390, 0.7151687, 0.0721923],
        [0.0193308, 0.1191948, 0.9505322],
    ]
)  # IEC 61966-2-1


class Film(NamedTuple):
    """Unreal's settings of the filmic curve, with its defaults."""

    slope: float = 0.88
    toe: float = 0.55
    shoulder: float = 0.26
    black_clip: float = 0.0
    white_clip: float = 0.04


def film_curve(film: Film, light: Floats) -> Floats:
    """Returns what the film shows of linear light > 0, 0 to 1 and a little beyond."""
    slope, toe, shoulder, black, white = film
    toe_scale, shoulder_scale = 1.0 + black - toe, 1.0 + white - shoulder
    if toe > 0.8:
        toe_match = (1.0 - toe - GREY) / slope + np.log10(GREY)
    else:
        b = (GREY + black) / toe_scale - 1.0
        toe_match = np.log10(GREY) - 0.5 * np.log((1.0 + b) / (1.0 - b)) * toe_scale / slope
    straight_match = (1.0 - toe) / slope - toe_match
    shoulder_match = shoulder / slope - straight_match
    log = np.log10(light)
    straight = slope * (log + straight_match)
    with np.errstate(over="ignore"):
        low = -black + 2.0 * toe_scale / (
            1.0 + np.exp(-2.0 * slope / toe_scale * (log - toe_match))
        )
        high = (1.0 + white) - 2.0 * shoulder_scale / (
            1.0 + np.exp(2.0 * slope / shoulder_scale * (log - shoulder_match))
        )
    low = np.where(log < toe_match, low, straight)
    high = np.where(log > shoulder_match, high, straight)
    t = np.clip((log - toe_match) / (shoulder_match - toe_match), 0.0, 1.0)
    t = 1.0 - t if shoulder_match < toe_match else t
    t = t * t * (3.0 - 2.0 * t)
    found: Floats = low + t * (high - low)
    return found


def tone_table(film: Film, gamma: float) -> Floats32:
    """Returns (256,) the grey level, 0 to 255, that each grey level of a picture becomes."""
    level = np.arange(LAST + 1) / LAST
    if film != Film():
        light = np.geomspace(LEAST, MOST, STEPS)
        shown = np.square(level)  # as `blocks.develop` encodes light
        before = np.interp(shown, film_curve(Film(), light), light)
        level = np.sqrt(np.clip(film_curve(film, before), 0.0, 1.0))
    return np.asarray(LAST * level ** (GAMMA / gamma), dtype=np.float32)


def white_balance(temperature: float, tint: float) -> Floats:
    """Returns (3, 3) what linear red, green and blue are multiplied by; K, tint -1 to 1."""
    x, y = _white_point(temperature)
    if tint != 0.0:
        x, y = _beside(x, y, temperature, tint)
    cone = np.diag((BRADFORD @ _xyz(*D65)) / (BRADFORD @ _xyz(x, y)))
    adapt = np.linalg.inv(BRADFORD) @ cone @ BRADFORD
    found: Floats = np.linalg.inv(SRGB_TO_XYZ) @ adapt @ SRGB_TO_XYZ
    return found


def _white_point(temperature: float) -> tuple[float, float]:
    """Returns the chromaticity x, y of light of a colour temperature in K."""
    return black_body(temperature) if temperature < WARM else daylight_colour(temperature)


def daylight_colour(temperature: float) -> tuple[float, float]:
    """Returns x, y of daylight of 4000 to 25 000 K (CIE 15); its scale of temperature is that of 1931."""
    t = 1.4388 / 1.438 * temperature
    if t <= 7000.0:
        x = 0.244063 + (0.09911e3 + (2.9678e6 - 4.6070e9 / t) / t) / t
    else:
        x = 0.237040 + (0.24748e3 + (1.9018e6 - 2.0064e9 / t) / t) / t
    return x, -3.0 * x * x + 2.87 * x - 0.275


def black_body_uv(t: float) -> tuple[float, float]:
    """Returns u, v (CIE 1960) of a black body of 1000 to 15 000 K (Krystek 1985)."""
    u = (0.860117757 + 1.54118254e-4 * t + 1.28641212e-7 * t * t) / (
        1.0 + 8.42420235e-4 * t + 7.08145163e-7 * t * t
    )
    v = (0.317398726 + 4.22806245e-5 * t + 4.20481691e-8 * t * t) / (
        1.0 - 2.89741816e-5 * t + 1.61456053e-7 * t * t
    )
    return u, v


def black_body(temperature: float) -> tuple[float, float]:
    """Returns x, y of a black body's light."""
    return _xy(*black_body_uv(temperature))


def _beside(x: float, y: float, temperature: float, tint: float) -> tuple[float, float]:
    """Returns x, y moved towards green, whose light is then white, so that a tint > 0 gives magenta."""
    u, v = black_body_uv(temperature)
    shift = tint * TINT / np.hypot(u, v)
    (moved_x, moved_y), (plain_x, plain_y) = _xy(u - shift * v, v + shift * u), _xy(u, v)
    return x + moved_x - plain_x, y + moved_y - plain_y


def _xy(u: float, v: float) -> tuple[float, float]:
    """Returns x, y (CIE 1931) of u, v (CIE 1960)."""
    below = 2.0 * u - 8.0 * v + 4.0
    return 3.0 * u / below, 2.0 * v / below


def _xyz(x: float, y: float) -> Floats:
    """Returns X, Y, Z of a chromaticity, Y being 1."""
    return np.array([x / y, 1.0, (1.0 - x - y) / y])


@inner_kernel
def _look_up(light: np.float32, table: Floats32) -> np.float32:
    """Returns what a table of grey levels makes of linear light."""
    level = np.sqrt(light if light > ZERO else ZERO) * WHITE
    level = level if level < WHITE else WHITE
    k = np.int32(level if level < TOP else TOP)
    found: np.float32 = table[k] + (level - np.float32(k)) * (table[k + 1] - table[k])
    return found


@kernel
def grade(matrix: Floats32, table: Floats32, out: NDArray[np.uint32]) -> None:
    """Applies a white balance, (3, 3), and a table of grey levels, (256,), to a picture `out`, packed."""
    inverse = ONE / (WHITE * WHITE)
    for y in range(out.shape[0]):
        row = out[y]
        for x in range(row.size):
            r, g, b = unpack(row[x])
            r, g, b = r * r * inverse, g * g * inverse, b * b * inverse
            red = matrix[0, 0] * r + matrix[0, 1] * g + matrix[0, 2] * b
            green = matrix[1, 0] * r + matrix[1, 1] * g + matrix[1, 2] * b
            blue = matrix[2, 0] * r + matrix[2, 1] * g + matrix[2, 2] * b
            red, green, blue = _look_up(red, table), _look_up(green, table), _look_up(blue, table)
            row[x] = pack(rounded(red), rounded(green), rounded(blue))


@kernel
def replace_levels(levels: Bytes, out: Bytes) -> None:
    """Replaces red, green and blue of a picture `out` (H, W, 4) by what `levels` (256,) has for each."""
    for y in range(out.shape[0]):
        row = out[y]
        for x in range(row.shape[0]):
            row[x, 0] = levels[row[x, 0]]
            row[x, 1] = levels[row[x, 1]]
            row[x, 2] = levels[row[x, 2]]
