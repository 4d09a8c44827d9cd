"""Drops of rain on the glass before a camera, between two strokes of a wiper.

Which drops hit is `droplets`; that they stay, and how wide they lie, is `camera.wetted_share`: a Poisson
field of half spheres, so the mean of what they cover in pictures is that function's value. Each is out of
focus by the lens's aperture and shows the scene upside down: sky below, ground above. Distance of the
glass, aperture and time between strokes are assumptions; no picture was compared. Valid: 0.5 to 100 mm/h.
"""

from __future__ import annotations

from math import exp, hypot, log
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.randomness import stream_key
from skidpad.core.specs import CameraSpec
from skidpad.physics.camera import SPREAD
from skidpad.physics.droplets import Drops, rain_drops
from skidpad.sensors.noise import uniform
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.packing import pack, rounded, unpack
from skidpad.sensors.raster.view import View

GLASS, APERTURE = 0.05, 0.002  # m, from the lens to the glass; across the lens
WIPE = 2.0  # s between two strokes
LEAST_MM, MOST_MM = 0.2, 6.0  # of diameter: smaller drops cover a hundredth, larger ones are rare
MOST = 8192  # drops in a picture
GROUND = 0.12  # albedo of the ground that a drop shows
INVERSE = np.float32(1.0 / 255.0)


class Glass(NamedTuple):
    """The glass before one camera, in pixels and per metre of way."""

    focal: float  # px
    margin: float  # px around the picture where drops can lie that reach into it
    blur: float  # px, radius of a point out of focus
    rate: float  # drops per m of way, on all of the glass
    slope: float  # 1/mm, of their diameters


def glass_of(camera: CameraSpec, focal: float, drops: Drops) -> Glass:
    """Returns the glass of a camera in a rain."""
    blur = 0.5 * focal * APERTURE / GLASS
    margin = 0.5 * focal * SPREAD * MOST_MM * 1e-3 / GLASS + blur
    size = (camera.width + 2.0 * margin) * (camera.height + 2.0 * margin) * (GLASS / focal) ** 2
    number = drops.density / drops.slope * exp(-drops.slope * LEAST_MM)
    return Glass(focal, margin, blur, number * size, drops.slope)


class LensDrops:
    """The drops before one camera; `move` every tick."""

    def __init__(self, camera: CameraSpec, seed: int, rain_mm_h: float, dt: float) -> None:
        self._camera, self._drops, self._dt = camera, rain_drops(rain_mm_h), dt
        self._key = np.uint64(stream_key(seed, "camera", camera.id, "drops"))
        self._period = max(round(WIPE / dt), 1)
        self.stroke, self.swept = -1, 0.0  # number of the last stroke, m of way since

    def change(self, rain_mm_h: float) -> None:
        """Rain is another from the next tick on; the glass stays as wet as it is."""
        self._drops = rain_drops(rain_mm_h)

    def move(self, tick: int, speed: float) -> None:
        """Sweeps up the rain of one tick, or wipes; speed: m/s."""
        stroke = tick // self._period
        self.swept = self.swept + speed * self._dt if stroke == self.stroke else 0.0
        self.stroke = stroke

    def draw(self, view: View, light: Lighting, image: NDArray[np.uint32]) -> None:
        """Draws the drops into the rows of a view's picture (H, W), in place."""
        if self.swept <= 0.0 or self._drops.density <= 0.0:
            return
        glass = glass_of(self._camera, float(view.focal), self._drops)
        sky = light.exposure * 0.5 * (light.zenith + light.horizon)
        sun = max(float(light.sun_direction[2]), 0.0) * light.sun
        ground = light.exposure * GROUND * (light.sky + sun)
        rows = view.height - view.top
        work = np.zeros((3, rows, image.shape[1]), dtype=np.float32)
        work[0] = 1.0
        cover_glass(glass, self._key, self.stroke, self.swept, view.top, image.shape[0], work)
        show_drops(work, sky.astype(np.float32), ground.astype(np.float32), view.top, image)


@kernel
def cover_glass(
    glass: Glass, key: np.uint64, stroke: int, swept: float, top: int, height: int, work: Floats32
) -> None:
    """Lays all drops of a stroke over rows of a picture, one after the other.

    Args:
        glass: before the camera.
        key: of its random numbers.
        stroke: number of the wiper's stroke.
        swept: m of way since.
        top: first row.
        height: rows of the whole picture.
        work: (3, rows, width) what is left of the picture, what drops show of the sky, and of the ground.
    """
    rows, width = work.shape[1], work.shape[2]
    way = 0.0
    for n in range(MOST):
        way -= log(1.0 - uniform(key, stroke, 4 * n)) / glass.rate
        if way > swept:
            break
        size = LEAST_MM - log(1.0 - uniform(key, stroke, 4 * n + 1)) / glass.slope
        radius = 0.5 * glass.focal * SPREAD * min(size, MOST_MM) * 1e-3 / GLASS
        x = uniform(key, stroke, 4 * n + 2) * (width + 2.0 * glass.margin) - glass.margin
        y = uniform(key, stroke, 4 * n + 3) * (height + 2.0 * glass.margin) - glass.margin
        inner, outer = abs(radius - glass.blur), radius + glass.blur
        # a disc out of focus: full inside, falling to the rim, its area that of the sharp disc
        full = 3.0 * radius * radius / (inner * inner + inner * outer + outer * outer)
        for row in range(max(int(y - outer), top), min(int(y + outer) + 2, top + rows)):
            dy = row + 0.5 - y
            if abs(dy) >= outer:
                continue
            half = np.sqrt(outer * outer - dy * dy)
            upper = np.float32(min(max(0.5 + 0.5 * dy / outer, 0.0), 1.0))  # of sky: it lies below
            for column in range(max(int(x - half), 0), min(int(x + half) + 2, width)):
                off = hypot(column + 0.5 - x, dy)
                a = np.float32(full * min(max((outer - off) / (outer - inner), 0.0), 1.0))
                left = np.float32(1.0) - a
                work[0, row - top, column] *= left
                work[1, row - top, column] = work[1, row - top, column] * left + a * upper
                rest = a * (np.float32(1.0) - upper)
                work[2, row - top, column] = work[2, row - top, column] * left + rest


@kernel
def show_drops(
    work: Floats32, sky: Floats32, ground: Floats32, top: int, image: NDArray[np.uint32]
) -> None:
    """Mixes what drops show into rows of a picture, in linear light. work: as by `cover_glass`."""
    for row in range(work.shape[1]):
        for column in range(work.shape[2]):
            left = work[0, row, column]
            if left >= np.float32(1.0):
                continue
            up, down = work[1, row, column], work[2, row, column]
            r, g, b = unpack(image[top + row, column])
            r, g, b = r * INVERSE, g * INVERSE, b * INVERSE
            r = np.sqrt(r * r * left + up * sky[0] + down * ground[0]) * np.float32(255.0)
            g = np.sqrt(g * g * left + up * sky[1] + down * ground[1]) * np.float32(255.0)
            b = np.sqrt(b * b * left + up * sky[2] + down * ground[2]) * np.float32(255.0)
            image[top + row, column] = pack(rounded(r), rounded(g), rounded(b))
