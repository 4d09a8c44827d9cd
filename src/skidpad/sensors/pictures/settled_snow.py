"""Snow on what stands beside the road in pictures for people: it lies where a surface looks up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.pictures.blocks import GX, GY, ONE, ZERO, B, G, R, U, W, end_of_run
from skidpad.sensors.pictures.roughness import A, F

SHARE, STEEP = (
    0,
    1,
)  # columns: of a level surface that is covered, and by how much steeper than others it may be
NOTHING_SETTLES = np.zeros((0, 2), dtype=np.float32)
_STEEP, _PER = (
    np.float32(0.30),
    np.float32(1.0 / 0.45),
)  # share that a normal looks up, where snow begins to lie
_FAR = np.float32(40.0)  # m beyond which unevenness fades
_TWO, _THREE, _TINY = np.float32(2.0), np.float32(3.0), np.float32(1e-12)
_SNOW_R, _SNOW_G, _SNOW_B = np.float32(0.80), np.float32(0.83), np.float32(0.88)


@inner_kernel
def settle_snow(
    v: np.float32,
    count: int,
    keys: NDArray[np.int32],
    shares: Floats32,
    up: Floats32,
    grains: np.float32,
    work: Floats32,
) -> None:
    """Covers surfaces of the map in a block with snow, the more the more they look up.

    A pixel takes the least of itself and its neighbours along the row: on a ridge it has one slope of either
    face, which together may look up where neither does.
    Where it lies on steep things, as needles and leaves, it lies unevenly, by the grains in lane F of `work`.
    v: m down per m ahead of the block's row; shares: (256, 2) SHARE and STEEP by material; up: (3,) camera
    axes; grains: share of the unevenness that is drawn.
    """
    up0, up1, up2 = up[0], up[1], up[2]
    x = 0
    while x < count:
        k, end = keys[x], end_of_run(keys, x)
        share = shares[k & 255, SHARE] if (k >> 16) == 0 else ZERO
        steep = shares[k & 255, STEEP]
        uneven = grains if steep > ZERO else ZERO
        run, size = work[x:], end - x
        x = end
        if share <= ZERO:
            continue
        for n in range(size):
            u, gx, gy = run[U + n], run[GX + n], run[GY + n]
            gz = run[W + n] - u * gx - v * gy
            n_up = -(gx * up0 + gy * up1 + gz * up2) / np.sqrt(gx * gx + gy * gy + gz * gz + _TINY)
            t = (n_up - _STEEP + steep) * _PER
            t = t if t > ZERO else ZERO
            run[A + n] = t if t < ONE else ONE
        for n in range(size):
            t, before, after = run[A + n], run[A + max(n - 1, 0)], run[A + min(n + 1, size - 1)]
            t = t if t < before else before
            t = t if t < after else after
            fade = _FAR * run[W + n]
            t += uneven * t * run[F + n] * (fade if fade < ONE else ONE)
            t = t if t < ONE else ONE
            t = t if t > ZERO else ZERO
            cover = share * t * t * (_THREE - _TWO * t)
            run[R + n] += cover * (_SNOW_R - run[R + n])
            run[G + n] += cover * (_SNOW_G - run[G + n])
            run[B + n] += cover * (_SNOW_B - run[B + n])
