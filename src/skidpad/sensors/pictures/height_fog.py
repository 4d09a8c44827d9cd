"""Fog that thins with height before the surfaces of a picture: `physics.optics.fog_share` by pixel."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.physics.camera import share_left
from skidpad.physics.optics import LEVEL, Air
from skidpad.sensors.pictures.blocks import ONE, ZERO, M, U, W

_FARTHEST = np.float32(1e-6)
_LEVEL = np.float32(LEVEL)


@inner_kernel
def thinned_fog(
    eye: np.float32, climb: np.float32, early: np.float32, fall: np.float32
) -> np.float32:
    """Returns the mean density of the fog on a way, 1 at the ground; without a branch, so loops vectorise.

    eye: m above the ground of the fog; climb: m, to the end of the way; early: share of the way before the
    fog begins; fall: 1/m, above 0, by which it thins.
    """
    per_fall = ONE / fall
    begin, end = eye + climb * (early if early < ONE else ONE), eye + climb
    a, b = begin if begin > ZERO else ZERO, end if end > ZERO else ZERO
    thin_a, thin_b = share_left(fall * a, ONE), share_left(fall * b, ONE)
    below_a = (ONE - thin_a) * per_fall if begin > ZERO else begin
    below_b = (ONE - thin_b) * per_fall if end > ZERO else end
    rise = end - begin
    level = abs(rise) < _LEVEL
    mean: np.float32 = thin_a if level else (below_b - below_a) / (_LEVEL if level else rise)
    return mean


@inner_kernel
def thin_fog(
    v: np.float32, count: int, air: Air, up: Floats32, height: float, work: Floats32
) -> None:
    """Writes the mean density of the fog before a block's pixels into lane M of `work`, 1 at the ground.

    v: m down per m ahead of the block's row; up: (3,) camera axes; height: m, of the camera.
    """
    up0, up1, up2 = up[0], up[1], up[2]
    eye, start = np.float32(height - air.ground), np.float32(air.fog_start)
    fall = np.float32(air.thinning)
    for x in range(count):
        u, w = work[U + x], work[W + x]
        z = ONE / (w if w > _FARTHEST else _FARTHEST)
        way = z * np.sqrt(u * u + v * v + ONE)
        climb = z * (up0 * u + up1 * v + up2)
        work[M + x] = thinned_fog(eye, climb, start / way, fall)
