"""Where a radar looks: directions drawn anew each tick (M-9), the same at both sensor levels (M-3)."""

from __future__ import annotations

from math import pi, radians, tan
from typing import NamedTuple

import numpy as np

from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.maths.randomness import stream_key
from skidpad.core.specs import RadarSpec
from skidpad.sensors.noise import uniform


class Beam(NamedTuple):
    """The cone of one radar, with its own random stream."""

    key: np.uint64
    rays: int  # per tick
    half_width: float  # tangent of half the horizontal field of view
    half_height: float


def beam_of(spec: RadarSpec, seed: int, dt: float) -> Beam:
    """The beam of a radar in a run."""
    return Beam(
        key=np.uint64(stream_key(seed, "radar", spec.id)),
        rays=max(1, round(spec.points_per_second * dt)),
        half_width=tan(radians(spec.horizontal_fov_deg) / 2),
        half_height=tan(radians(spec.vertical_fov_deg) / 2),
    )


@inner_kernel
def direction(beam: Beam, tick: int, ray: int) -> tuple[float, float]:
    """Tangents right and down of one ray: uniform angle and uniform radius in the elliptic cone.

    The radius is uniform, so directions crowd at the axis, as CARLA documents for its radar.
    """
    angle = 2.0 * pi * uniform(beam.key, tick, 2 * ray)
    radius = uniform(beam.key, tick, 2 * ray + 1)
    right = beam.half_width * radius * np.cos(angle)
    return right, beam.half_height * radius * np.sin(angle)
