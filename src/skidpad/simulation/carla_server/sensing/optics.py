"""The optics of a client's camera: its lens, and what is done to colours after the light is on the sensor.

In Unreal's order: motion blur, bloom, fringes, white balance, film and gamma, then the lens, which CARLA's
cameras have as a material over the finished picture. Attributes that have their default values change no byte
and cost nothing.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.specs import CameraSpec
from skidpad.sensors.pictures.bloom import add_bloom
from skidpad.sensors.pictures.film import (
    GAMMA,
    Film,
    grade,
    replace_levels,
    tone_table,
    white_balance,
)
from skidpad.sensors.pictures.fringes import fringes_of, split_colours
from skidpad.sensors.pictures.lens_distortion import LensShape, resample, source_pixels
from skidpad.sensors.pictures.motion_blur import FRAME, smear
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.view import View
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.sensing.motion import Memory
from skidpad.simulation.carla_server.sensing.settings import PostSettings, Settings
from skidpad.simulation.carla_server.sensing.surroundings import Pictured

MOTION_BLUR = (
    0.45,
    0.35,
)  # intensity and percent of the width: by default pictures are of one moment
BLOOM = 0.675  # by default nothing shines beside itself
NEUTRAL = (6500.0, 0.0)  # K and tint: by default no colour changes
ANY = 1e6  # of coefficients that CARLA's documentation gives no range


class Lens:
    """The lens of one camera."""

    def __init__(self, actor: Actor, spec: CameraSpec) -> None:
        """WireError for values outside the ranges of CARLA's documentation."""
        read = Settings(actor)
        shape = LensShape(
            read.number("lens_circle_falloff", 5.0, 0.0, 10.0),
            read.number("lens_circle_multiplier", 0.0, 0.0, 10.0),
            read.number("lens_k", -1.0, -ANY, ANY),
            read.number("lens_kcube", 0.0, -ANY, ANY),
            read.number("lens_x_size", 0.08, 0.0, 1.0),
            read.number("lens_y_size", 0.08, 0.0, 1.0),
        )
        self._source = source_pixels(shape, spec.width, spec.height) if shape.bends else None
        self._bent: NDArray[Any] | None = None

    def bend(self, picture: NDArray[Any]) -> NDArray[Any]:
        """Returns a picture (H, W) as the lens shows it: the same array, or one that the next call fills."""
        if self._source is None:
            return picture
        if self._bent is None:
            self._bent = np.empty_like(picture)
        resample(self._source, picture, self._bent)
        return self._bent


class MotionBlur:
    """Motion blur of one camera."""

    def __init__(self, actor: Actor, spec: CameraSpec) -> None:
        """WireError for values that no camera has."""
        read = PostSettings(actor)
        given = (
            read.number("motion_blur_intensity", MOTION_BLUR[0], 0.0, 1.0),
            read.number("motion_blur_max_distortion", MOTION_BLUR[1], 0.0, 100.0),
        )
        self._exposed, self._longest = FRAME * given[0], 0.01 * spec.width * given[1]
        self._acts = given != MOTION_BLUR and min(given) > 0.0
        self._memory = Memory()

    def apply(
        self, scene: Pictured, view: View, drawn: Pass, dt: float, rgb: NDArray[np.uint32]
    ) -> None:
        """Blurs a picture (H, W), packed, in place; dt: s since the last one."""
        if self._acts:
            flow = self._memory.since(scene, view, drawn)
            smear(flow, self._exposed / dt, self._longest, rgb.copy(), rgb)


class Fringing:
    """Chromatic aberration of one camera."""

    def __init__(self, actor: Actor, spec: CameraSpec) -> None:
        """WireError for values outside the ranges of Unreal's documentation."""
        read = PostSettings(actor)
        intensity = read.number("chromatic_aberration_intensity", 0.0, 0.0, 100.0)
        start = read.number("chromatic_aberration_offset", 0.0, 0.0, 1.0)
        self._acts = intensity > 0.0 and start < 1.0
        if self._acts:
            self._fringes = fringes_of(intensity, start, spec.width, spec.height)
            self._plain = np.empty((spec.height, spec.width), dtype=np.uint32)

    def apply(self, rgb: NDArray[np.uint32]) -> None:
        """Splits the colours of a picture (H, W), packed, in place."""
        if self._acts:
            self._plain[:] = rgb
            split_colours(self._fringes, self._plain, rgb)


class ColourGrading:
    """White balance, film and gamma of one camera."""

    def __init__(self, actor: Actor) -> None:
        """WireError for values that no camera has."""
        read = PostSettings(actor)
        film = Film(
            read.number("slope", Film().slope, 0.01, 2.0),
            read.number("toe", Film().toe, 0.0, 1.0),
            read.number("shoulder", Film().shoulder, 0.0, 1.0),
            read.number("black_clip", Film().black_clip, 0.0, 1.0),
            read.number("white_clip", Film().white_clip, 0.0, 1.0),
        )
        gamma = read.number("gamma", GAMMA, 0.1, 10.0)
        balance = (
            read.number("temp", NEUTRAL[0], 1000.0, 25_000.0),
            read.number("tint", NEUTRAL[1], -1.0, 1.0),
        )
        self._acts = film != Film() or gamma != GAMMA or balance != NEUTRAL
        self._table = tone_table(film, gamma)
        self._levels = np.rint(self._table).astype(np.uint8)
        self._matrix: Floats32 | None = None  # None: white stays as it is
        if balance != NEUTRAL:
            self._matrix = white_balance(*balance).astype(np.float32)

    def apply(self, rgb: NDArray[np.uint32]) -> None:
        """Changes the colours of a picture (H, W), packed, in place."""
        if not self._acts:
            return
        if self._matrix is None:
            replace_levels(self._levels, rgb.view(np.uint8).reshape(*rgb.shape, 4))
        else:
            grade(self._matrix, self._table, rgb)


class ColourOptics:
    """All that happens to the colours of one camera before its lens bends the picture."""

    def __init__(self, actor: Actor, spec: CameraSpec) -> None:
        """WireError for values that no camera has."""
        self._blur, self._fringing = MotionBlur(actor, spec), Fringing(actor, spec)
        self._grading = ColourGrading(actor)
        self._bloom = PostSettings(actor).number("bloom_intensity", BLOOM, 0.0, 8.0)

    def apply(
        self, scene: Pictured, view: View, drawn: Pass, dt: float, rgb: NDArray[np.uint32]
    ) -> None:
        """Changes a painted picture (H, W), packed, in place; dt: s since the last one."""
        self._blur.apply(scene, view, drawn, dt, rgb)
        if self._bloom not in (0.0, BLOOM):
            add_bloom(self._bloom, rgb)
        self._fringing.apply(rgb)
        self._grading.apply(rgb)
