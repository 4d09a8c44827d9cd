"""What weather does to the five RGB feeds on top of the rendered scene (A-221 to A-230).

Noise is a pure function of (seed, sensor, tick, pixel): every row takes a stretch of one seeded
tile of normal deviates, beginning at a place that is hashed from sensor, tick and row (M-4).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from math import hypot
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.randomness import stream, stream_key
from skidpad.core.weather import Weather
from skidpad.sensors.noise import mixed, uniform
from skidpad.sensors.pictures.packing import pack, rounded, unpack

RAIN_SIGMA = 15.0  # grey levels at precipitation 100 (A-222, D-093)
RAIN_GREY = 0.5  # share of the grey value in rain
NIGHT_GAIN, NIGHT_LIFT, NIGHT_SIGMA = 0.60, 20.0, 20.0
GLASS_ROWS = 0.85  # upper share of the rows that is windscreen
PILLAR_WIDTH, PILLAR_HEIGHT = 0.18, 0.35  # shares of the image
LUMA = (0.299, 0.587, 0.114)  # of red, green, blue (ITU-R BT.601)
TILE = 1 << 18  # deviates, so that the tile stays in the second-level cache
TILE_UNIT = 32.0  # steps per standard deviation; +-127 steps cut the tails at 3.97 sigma
STREAKS = 420.0  # of rain per 800x600 image at precipitation 100, by eye
STREAK_LENGTH = 26.0  # px in an image of 600 rows

Packed = NDArray[np.uint32]  # (H, W) bytes red, green, blue, 255


class Calm(NamedTuple):
    """A share of the published effect, for people."""

    sigma: float  # grey levels, of all three colours alike
    grey: float  # 0 .. 1
    gain: float
    lift: float  # grey levels


@dataclass(frozen=True, slots=True)
class Degradation:
    """Strengths of the two published stages; both act in rain at night (A-224, D-094)."""

    rain_sigma: float  # grey levels
    grey: float  # 0 .. 1
    night: bool
    streaks: float  # 0 .. 1
    pillar: bool = True  # D-097
    share: float = 1.0  # of the whole effect: less is for people only
    glass: bool = True  # a cockpit hides the lowest rows; False: the camera is outside

    @property
    def calm(self) -> Calm:
        """Returns the share of both stages as one: their noises are independent, so variances add."""
        rain, night = self.share * self.rain_sigma, self.share if self.night else 0.0
        gain = 1.0 + night * (NIGHT_GAIN - 1.0)
        sigma = hypot(gain * rain, night * NIGHT_SIGMA)
        return Calm(sigma, self.share * self.grey, gain, night * NIGHT_LIFT)

    @property
    def any(self) -> bool:
        """Returns whether an image changes at all (A-225)."""
        return self.rain_sigma > 0.0 or self.night or self.streaks > 0.0


def degradation(weather: Weather, *, exclusive: bool = False) -> Degradation:
    """Returns the stages that act in a weather. exclusive: rain switches the night stage off (listing)."""
    rain = weather.precipitation / 100.0
    return Degradation(
        rain_sigma=RAIN_SIGMA * rain,
        grey=RAIN_GREY if rain > 0.0 else 0.0,
        night=weather.is_night and not (exclusive and rain > 0.0),
        streaks=rain,
    )


@lru_cache(maxsize=32)
def glass_mask(height: int, width: int, pillar: bool) -> NDArray[np.int32]:
    """Returns (H,) the first column of each row that weather degrades; `width` where none is (A-226, A-227).

    The pillar keeps pixels with y > (h_p / w_p) x + (0.85 H - h_p), x < w_p and y < 0.85 H.
    """
    y, x = np.mgrid[0:height, 0:width]
    bottom = GLASS_ROWS * height
    w, h = PILLAR_WIDTH * width, PILLAR_HEIGHT * height
    clean = y >= bottom
    if pillar:
        clean |= (y > (h / w) * x + (bottom - h)) & (x < w)
    first: NDArray[np.int32] = clean.sum(axis=1).astype(np.int32)
    first.setflags(write=False)
    return first


@lru_cache(maxsize=8)
def open_view(height: int) -> NDArray[np.int32]:
    """Returns (H,) zeros, as `glass_mask` of a camera outside of any cockpit: weather is everywhere."""
    first = np.zeros(height, dtype=np.int32)
    first.setflags(write=False)
    return first


def clear_of_weather(height: int, width: int, pillar: bool = True) -> NDArray[np.bool_]:
    """Returns (H, W) True where the picture stays clean: cockpit and pillar."""
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

    def apply(self, tick: int, image: Packed, rows: range | None = None) -> None:
        """Degrades an image (H, W) of packed bytes in place, or only some of its rows.

        It stays as it is where no stage acts. The same tick gives the same noise.
        """
        s = self.strength
        if not s.any:
            return
        height, width = image.shape
        rows = range(height) if rows is None else rows
        mask = glass_mask(height, width, s.pillar) if s.glass else open_view(height)
        if s.streaks > 0.0:
            count = int(STREAKS * s.streaks * height * width / 480_000.0)
            draw_streaks(self._keys[2], tick, count, s.night, mask, rows.start, rows.stop, image)
        if s.rain_sigma > 0.0 or s.night:
            if s.share < 1.0:
                soften(self._keys[1], tick, s.calm, self._tile, mask, rows.start, rows.stop, image)
                return
            degrade(
                self._keys, tick, s.rain_sigma, s.grey, s.night,
                self._tile, mask, rows.start, rows.stop, image,
            )  # fmt: skip


@kernel
def degrade(
    keys: NDArray[np.uint64],
    tick: int,
    rain_sigma: float,
    grey: float,
    night: bool,
    tile: NDArray[np.int8],
    first: NDArray[np.int32],
    first_row: int,
    end_row: int,
    image: Packed,
) -> None:
    """Degrades rows of an image in place: in rain noise, then grey; at night gain, lift, noise (A-228).

    Clipped once at the end. keys: of the stages; first: (H,) column of each row, as by `glass_mask`.
    """
    width = image.shape[1]
    room = np.uint64(tile.size - 3 * width)
    rain_unit = np.float32(rain_sigma / TILE_UNIT)
    night_unit = np.float32(NIGHT_SIGMA / TILE_UNIT if night else 0.0)
    gain = np.float32(NIGHT_GAIN if night else 1.0)
    lift = np.float32(NIGHT_LIFT if night else 0.0)
    share, kept = np.float32(grey), np.float32(1.0 - grey)
    wr, wg, wb = np.float32(LUMA[0]), np.float32(LUMA[1]), np.float32(LUMA[2])
    for y in range(first_row, end_row):
        count = width - first[y]
        if count <= 0:
            continue
        at = np.intp(mixed(keys[0], tick, y) % room)
        rain = tile[at : at + 3 * count]
        at = np.intp(mixed(keys[1], tick, y) % room)
        dark = tile[at : at + 3 * count]
        row = image[y, first[y] :]
        for x in range(count):
            r, g, b = unpack(row[x])
            r += rain_unit * np.float32(rain[x])
            g += rain_unit * np.float32(rain[x + count])
            b += rain_unit * np.float32(rain[x + 2 * count])
            luma = share * (wr * r + wg * g + wb * b)
            r = gain * (kept * r + luma) + lift + night_unit * np.float32(dark[x])
            g = gain * (kept * g + luma) + lift + night_unit * np.float32(dark[x + count])
            b = gain * (kept * b + luma) + lift + night_unit * np.float32(dark[x + 2 * count])
            row[x] = pack(rounded(r), rounded(g), rounded(b))


@kernel
def soften(
    key: np.uint64,
    tick: int,
    calm: Calm,
    tile: NDArray[np.int8],
    first: NDArray[np.int32],
    first_row: int,
    end_row: int,
    image: Packed,
) -> None:
    """Mixes rows of an image with grey, gain, lift and one noise for all colours, in place.

    Half the price of `degrade`. first: (H,) column of each row, as by `glass_mask`.
    """
    width = image.shape[1]
    room = np.uint64(tile.size - width)
    unit = np.float32(calm.sigma / TILE_UNIT)
    colour = np.float32(calm.gain * (1.0 - calm.grey))
    mix = np.float32(calm.gain * calm.grey)
    wr, wg, wb = (mix * np.float32(LUMA[0]), mix * np.float32(LUMA[1]), mix * np.float32(LUMA[2]))
    lift = np.float32(calm.lift)
    for y in range(first_row, end_row):
        count = width - first[y]
        at = np.intp(mixed(key, tick, y) % room)
        noise, row = tile[at : at + count], image[y, first[y] :]
        for x in range(count):
            r, g, b = unpack(row[x])
            added = wr * r + wg * g + wb * b + lift + unit * np.float32(noise[x])
            r, g, b = colour * r + added, colour * g + added, colour * b + added
            row[x] = pack(rounded(r), rounded(g), rounded(b))


@kernel
def draw_streaks(
    key: np.uint64,
    tick: int,
    count: int,
    night: bool,
    first: NDArray[np.int32],
    first_row: int,
    end_row: int,
    image: Packed,
) -> None:
    """Draws short slanted strokes of falling rain, brighter than what is behind them, into rows of `image`.

    count: of the whole image; first: (H,) column of each row, as by `glass_mask`.
    """
    height, width = image.shape
    light = 120.0 if night else 215.0
    for i in range(count):
        x = uniform(key, tick, 4 * i) * width
        y = uniform(key, tick, 4 * i + 1) * height
        length = int((0.4 + uniform(key, tick, 4 * i + 2)) * STREAK_LENGTH * height / 600.0) + 2
        strength = 0.10 + 0.22 * uniform(key, tick, 4 * i + 3)
        slant = 0.35 * (x / width - 0.5)
        for step in range(length):
            row, column = int(y) + step, int(x + slant * step)
            if first_row <= row < end_row and first[row] <= column and 0 <= column < width:
                pixel = np.int64(image[row, column])
                brighter = 0xFF000000
                for shift in (0, 8, 16):
                    old = float((pixel >> shift) & 255)
                    brighter |= int(old + strength * max(light - old, 0.0)) << shift
                image[row, column] = np.uint32(brighter)
