"""What weather does to the five RGB feeds on top of the rendered scene (A-221 to A-230).

Noise is a pure function of (seed, sensor, tick, pixel): every row takes a stretch of one seeded
tile of normal deviates, beginning at a place that is hashed from sensor, tick and row (M-4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import NDArray

from skidpad.core.jit import kernel
from skidpad.core.randomness import stream, stream_key
from skidpad.core.weather import Weather
from skidpad.sensors.noise import mixed, uniform

RAIN_SIGMA = 15.0  # grey levels at precipitation 100 (A-222, D-093)
RAIN_GREY = 0.5  # share of the grey value in rain
NIGHT_GAIN, NIGHT_LIFT, NIGHT_SIGMA = 0.60, 20.0, 20.0
GLASS_ROWS = 0.85  # upper share of the rows that is windscreen
PILLAR_WIDTH, PILLAR_HEIGHT = 0.18, 0.35  # shares of the image
TILE = 1 << 18  # deviates, so that the tile stays in the second-level cache
TILE_UNIT = 32.0  # steps per standard deviation; +-127 steps cut the tails at 3.97 sigma
STREAKS = 420.0  # of rain per 800x600 image at precipitation 100, by eye
STREAK_LENGTH = 26.0  # px in an image of 600 rows

Image = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Degradation:
    """Strengths of the two published stages; both act in rain at night (A-224, D-094)."""

    rain_sigma: float  # grey levels
    grey: float  # 0 .. 1
    night: bool
    streaks: float  # 0 .. 1
    pillar: bool = True  # D-097

    @property
    def any(self) -> bool:
        """Whether an image changes at all (A-225)."""
        return self.rain_sigma > 0.0 or self.night or self.streaks > 0.0


def degradation(weather: Weather, *, exclusive: bool = False) -> Degradation:
    """The stages that act in a weather. exclusive: rain switches the night stage off (listing)."""
    rain = weather.precipitation / 100.0
    return Degradation(
        rain_sigma=RAIN_SIGMA * rain,
        grey=RAIN_GREY if rain > 0.0 else 0.0,
        night=weather.is_night and not (exclusive and rain > 0.0),
        streaks=rain,
    )


@lru_cache(maxsize=32)
def glass_mask(height: int, width: int, pillar: bool) -> NDArray[np.int32]:
    """(H,) first column of each row that weather degrades; `width` where none is (A-226, A-227).

    The pillar keeps pixels with y > (h_p / w_p) x + (0.85 H - h_p), x < w_p and y < 0.85 H.
    """
    first = np.zeros(height, dtype=np.int32)
    bottom = GLASS_ROWS * height
    first[ceil(bottom) :] = width
    if pillar:
        w, h = PILLAR_WIDTH * width, PILLAR_HEIGHT * height
        for y in range(ceil(bottom)):
            edge = (y - (bottom - h)) * w / h  # columns left of it are pillar
            first[y] = max(0, ceil(min(edge, w)))
    first.setflags(write=False)
    return first


def clear_of_weather(height: int, width: int, pillar: bool = True) -> NDArray[np.bool_]:
    """(H, W) True where the picture stays clean: cockpit and pillar."""
    return np.arange(width) < glass_mask(height, width, pillar)[:, None]


class CameraNoise:
    """The degradation of one camera."""

    def __init__(self, id: str, seed: int, strength: Degradation) -> None:
        self.strength = strength
        self._keys = np.array(
            [stream_key(seed, "camera", id, stage) for stage in ("rain", "night", "streaks")],
            dtype=np.uint64,
        )
        if strength.rain_sigma > 0.0 or strength.night:
            deviates = stream(seed, "camera", id, "tile").standard_normal(TILE)
            self._tile = np.clip(np.rint(deviates * TILE_UNIT), -127, 127).astype(np.int8)
        else:
            self._tile = np.zeros(1, dtype=np.int8)

    def apply(self, tick: int, image: Image) -> None:
        """Degrade an image (H, W, 3) in place."""
        s = self.strength
        if not s.any:
            return
        height, width, _ = image.shape
        mask = glass_mask(height, width, s.pillar)
        if s.streaks > 0.0:
            count = int(STREAKS * s.streaks * height * width / 480_000.0)
            draw_streaks(self._keys[2], tick, count, s.night, mask, image)
        if s.rain_sigma > 0.0 or s.night:
            degrade(self._keys, tick, s.rain_sigma, s.grey, s.night, self._tile, mask, image)


@kernel
def degrade(
    keys: NDArray[np.uint64],
    tick: int,
    rain_sigma: float,
    grey: float,
    night: bool,
    tile: NDArray[np.int8],
    first: NDArray[np.int32],
    image: Image,
) -> None:
    """Rain: noise, then mix with grey. Night: gain, lift, noise. Clip once at the end (A-228)."""
    height, width, _ = image.shape
    room = np.uint64(tile.size - 3 * width)
    rain_unit = np.float32(rain_sigma / TILE_UNIT)
    night_unit = np.float32(NIGHT_SIGMA / TILE_UNIT)
    gain, lift = np.float32(NIGHT_GAIN), np.float32(NIGHT_LIFT)
    share = np.float32(grey)
    kept = np.float32(1.0 - grey)
    low, high, half = np.float32(0.0), np.float32(255.0), np.float32(0.5)
    wr, wg, wb = np.float32(0.299), np.float32(0.587), np.float32(0.114)
    for y in range(height):
        if first[y] >= width:
            continue
        at = np.intp(mixed(keys[0], tick, y) % room)
        rain = tile[at : at + 3 * width]
        at = np.intp(mixed(keys[1], tick, y) % room)
        dark = tile[at : at + 3 * width]
        for x in range(first[y], width):
            r = np.float32(image[y, x, 0]) + rain_unit * np.float32(rain[3 * x])
            g = np.float32(image[y, x, 1]) + rain_unit * np.float32(rain[3 * x + 1])
            b = np.float32(image[y, x, 2]) + rain_unit * np.float32(rain[3 * x + 2])
            luma = share * (wr * r + wg * g + wb * b)
            r, g, b = kept * r + luma, kept * g + luma, kept * b + luma
            if night:
                r = gain * r + lift + night_unit * np.float32(dark[3 * x])
                g = gain * g + lift + night_unit * np.float32(dark[3 * x + 1])
                b = gain * b + lift + night_unit * np.float32(dark[3 * x + 2])
            image[y, x, 0] = np.uint8(min(max(r + half, low), high))
            image[y, x, 1] = np.uint8(min(max(g + half, low), high))
            image[y, x, 2] = np.uint8(min(max(b + half, low), high))


@kernel
def draw_streaks(
    key: np.uint64, tick: int, count: int, night: bool, first: NDArray[np.int32], image: Image
) -> None:
    """Short slanted strokes of falling rain, brighter than what is behind them."""
    height, width, _ = image.shape
    light = 120.0 if night else 215.0
    for i in range(count):
        x = uniform(key, tick, 4 * i) * width
        y = uniform(key, tick, 4 * i + 1) * height
        length = int((0.4 + uniform(key, tick, 4 * i + 2)) * STREAK_LENGTH * height / 600.0) + 2
        strength = 0.10 + 0.22 * uniform(key, tick, 4 * i + 3)
        slant = 0.35 * (x / width - 0.5)
        for step in range(length):
            row, column = int(y) + step, int(x + slant * step)
            if 0 <= row < height and first[row] <= column and 0 <= column < width:
                for c in range(3):
                    old = float(image[row, column, c])
                    image[row, column, c] = np.uint8(old + strength * max(light - old, 0.0))
