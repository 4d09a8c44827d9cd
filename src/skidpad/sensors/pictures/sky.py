"""Sky and sun of a picture, where a block of pixels shows nothing else."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.pictures.blocks import ONE, ZERO, B, G, R, U, W
from skidpad.sensors.pictures.lighting import Lighting

_TWO = np.float32(2.0)
_GLOW_SHARE, _DISC_SHARE = np.float32(0.25), np.float32(3.0)


@inner_kernel
def sky(v: np.float32, count: int, light: Lighting, up: Floats32, work: Floats32) -> None:
    """Writes the colour of the sky into `work` where a block shows nothing else.

    v: m down per m ahead of the block's row; up: (3,) camera axes.
    """
    hor_r, hor_g, hor_b = light.horizon[0], light.horizon[1], light.horizon[2]
    zen_r, zen_g, zen_b = light.zenith[0] - hor_r, light.zenith[1] - hor_g, light.zenith[2] - hor_b
    up0, up1, up2 = up[0], up[1], up[2]
    for x in range(count):
        u = work[U + x]
        per_ray = ONE / np.sqrt(u * u + v * v + ONE)
        climb = (u * up0 + v * up1 + up2) * per_ray
        climb = climb if climb > ZERO else ZERO
        climb = climb * (_TWO - climb)
        empty = work[W + x] <= ZERO
        work[R + x] = hor_r + climb * zen_r if empty else work[R + x]
        work[G + x] = hor_g + climb * zen_g if empty else work[G + x]
        work[B + x] = hor_b + climb * zen_b if empty else work[B + x]


@inner_kernel
def disc(v: np.float32, count: int, light: Lighting, sun: Floats32, work: Floats32) -> None:
    """Adds the sun and its glow to a block's sky in `work`.

    v: m down per m ahead of the block's row; sun: (3,) towards the sun in camera axes.
    """
    bright = np.float32(light.disc)
    sun_r, sun_g, sun_b = light.sun[0], light.sun[1], light.sun[2]
    sun0, sun1, sun2 = sun[0], sun[1], sun[2]
    for x in range(count):
        u = work[U + x]
        per_ray = ONE / np.sqrt(u * u + v * v + ONE)
        halo = (u * sun0 + v * sun1 + sun2) * per_ray
        halo = halo if halo > ZERO else ZERO
        halo = halo * halo
        halo = halo * halo
        halo = halo * halo
        halo = halo * halo
        wide = halo
        halo = halo * halo
        halo = halo * halo
        halo = halo * halo
        halo = halo * halo
        halo = halo * halo
        shine = bright * (wide * _GLOW_SHARE + halo * _DISC_SHARE)
        shine = shine if work[W + x] <= ZERO else ZERO
        work[R + x] += shine * sun_r
        work[G + x] += shine * sun_g
        work[B + x] += shine * sun_b
