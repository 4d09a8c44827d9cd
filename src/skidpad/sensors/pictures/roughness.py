"""Unevenness of surfaces in colour pictures: noise by place in the world, stronger on some materials.

Only maps with generated scenery have it; on others the table is empty and nothing is computed.
Depth and classes know nothing of it. Strengths are chosen by eye.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from skidpad.core.arrays import Floats32
from skidpad.core.jit import inner_kernel
from skidpad.sensors.pictures.blocks import BLOCK, LANES, ONE, ZERO, B, G, R, U, W, end_of_run
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.raster.view import View

MORE_LANES = 3  # of the array of a block, behind those of shading
SIZE = 256  # texels of a tile's edge, a power of two
FINE, COARSE = 0.04, 1.0  # m, a texel of grains and one of patches


def _make_tiles() -> Floats32:
    """Returns (3 * SIZE * SIZE,) grains, then patches and tints in turn: mean 0, deviation a third."""
    rng = np.random.default_rng(20)
    tiles = np.empty((3, SIZE, SIZE), dtype=np.float32)
    coarse = (1.0, 4.0, 12.0, 28.0)
    for tile, widths in zip(tiles, ((0.0, 1.2, 3.0), coarse, coarse), strict=True):
        total = np.zeros((SIZE, SIZE))
        for width in widths:
            noise = rng.standard_normal((SIZE, SIZE))
            smooth = ndimage.gaussian_filter(noise, width, mode="wrap") if width else noise
            total += smooth / smooth.std()
        tile[:] = np.clip(total / (3.0 * total.std()), -1.0, 1.0)
    return np.concatenate([tiles[0].ravel(), np.stack(list(tiles[1:]), axis=-1).ravel()])


TILES = _make_tiles()

A, C, F = (np.intp((LANES + n) * BLOCK) for n in range(MORE_LANES))
_PATCHES, _TWO, _NEXT = np.uint64(SIZE * SIZE), np.uint64(2), np.uint64(1)
_SIZE, _PER_SIZE = np.float32(SIZE), np.float32(1.0 / SIZE)
_PER_FINE, _PER_COARSE = np.float32(1.0 / FINE), np.float32(1.0 / COARSE)
_LEAN_X, _LEAN_Y = np.float32(0.37), np.float32(0.91)  # m per m of height, so that walls vary too
_NEAR = np.float32(9.0)  # m beyond which grains fade
_FORE, _EVEN = np.float32(2.0), np.float32(0.30)  # m; rough ground is brighter at grazing angles
_SPREAD = np.float32(0.7)  # m by which grains blur the edges of patches
_FARTHEST = np.float32(1e-5)
_LEAST = np.float32(0.25)
_LOW = np.float32(0.02)  # climb of a ray per metre, below which veils are not drawn out further
_VEIL = np.float32(1.0 / 22.0)  # texels of a layer of veils per metre of its height
_SOFT = np.float32(6.0)  # veils reach their full strength this steeply above the horizon
_AROUND, _CLOSE = np.float32(0.16), np.float32(0.10)
_VEILED, _TINTED, _WARM = np.float32(0.20), np.float32(0.07), np.float32(0.06)
_HALF = np.float32(0.5)
_GREEN = np.float32(0.35)


@inner_kernel
def _texel(a: np.float32, b: np.float32) -> np.float32:
    """Returns the index of the texel at row a and column b of a tile that repeats."""
    i, j = np.floor(a), np.floor(b)
    i -= _SIZE * np.floor(i * _PER_SIZE)
    j -= _SIZE * np.floor(j * _PER_SIZE)
    index: np.float32 = i * _SIZE + j
    return index


@inner_kernel
def roughen(
    view: View, v: np.float32, count: int, keys: NDArray[np.int32], grain: Floats32, tiles: Floats32,
    work: Floats32,
) -> None:  # fmt: skip
    """Changes the colours of a block's surfaces in `work` by where in the world they lie.

    v: m down per m ahead of the block's row; grain: (256, 3) strengths by material; tiles: `TILES`.
    """
    r = view.rotation
    x_u, x_1 = np.float32(r[0, 0]), np.float32(r[1, 0]) * v + np.float32(r[2, 0])
    y_u, y_1 = np.float32(r[0, 1]), np.float32(r[1, 1]) * v + np.float32(r[2, 1])
    z_u, z_1 = np.float32(r[0, 2]), np.float32(r[1, 2]) * v + np.float32(r[2, 2])
    a_u, a_1 = x_u + _LEAN_X * z_u, x_1 + _LEAN_X * z_1
    b_u, b_1 = y_u + _LEAN_Y * z_u, y_1 + _LEAN_Y * z_1
    height = np.float32(view.centre[2])
    a_0 = np.float32(view.centre[0]) + _LEAN_X * height
    b_0 = np.float32(view.centre[1]) + _LEAN_Y * height
    x = 0
    while x < count:
        m, end = keys[x] & 255, end_of_run(keys, x)
        grains, patches, tints = grain[m, 0], grain[m, 1], grain[m, 2]
        run, size = work[x:], end - x
        x = end
        if patches == ZERO:
            continue
        for n in range(size):  # reading a tile may not stand in a loop that shall be vectorised
            u, w = run[U + n], run[W + n]
            z = ONE / (w if w > _FARTHEST else _FARTHEST)
            run[A + n], run[C + n] = a_0 + z * (a_u * u + a_1), b_0 + z * (b_u * u + b_1)
            run[F + n] = _texel(run[A + n] * _PER_FINE, run[C + n] * _PER_FINE)
        for n in range(size):
            run[F + n] = tiles[np.uint64(run[F + n])]
        for n in range(size):
            blur = run[F + n] * _SPREAD
            run[A + n] = _texel(
                (run[A + n] + blur) * _PER_COARSE, (run[C + n] - blur) * _PER_COARSE
            )
        for n in range(size):
            at = _PATCHES + _TWO * np.uint64(run[A + n])
            run[A + n] = tiles[at]
            run[C + n] = tiles[at + _NEXT]
        for n in range(size):
            fade = _NEAR * run[W + n]
            fade = fade if fade < ONE else ONE
            near = _FORE * run[W + n]
            near = _EVEN - near / (ONE + near)
            share = ONE + grains * fade * run[F + n] + patches * (run[A + n] + near)
            share = share if share > _LEAST else _LEAST
            hue = tints * run[C + n] * share
            run[R + n] *= share + hue
            run[G + n] *= share + _GREEN * hue
            run[B + n] *= share - hue


@inner_kernel
def vary_sky(
    view: View, v: np.float32, count: int, light: Lighting, sun: Floats32, tiles: Floats32,
    work: Floats32,
) -> None:  # fmt: skip
    """Changes a block's sky in `work`: brighter around the sun, thin veils, no two parts alike.

    v: m down per m ahead of the block's row; sun: (3,) towards the sun in camera axes. The share
    towards and away from the sun follows the shape of CIE's clear sky (ISO 15469) by eye.
    """
    r = view.rotation
    x_u, x_1 = np.float32(r[0, 0]), np.float32(r[1, 0]) * v + np.float32(r[2, 0])
    y_u, y_1 = np.float32(r[0, 1]), np.float32(r[1, 1]) * v + np.float32(r[2, 1])
    z_u, z_1 = np.float32(r[0, 2]), np.float32(r[1, 2]) * v + np.float32(r[2, 2])
    sun0, sun1, sun2 = sun[0], sun[1], sun[2]
    clear = np.float32(min(1.0, light.disc * 1.2))
    for x in range(count):
        u = work[U + x]
        up = z_u * u + z_1
        up = (up if up > _LOW else _LOW) * _VEIL
        work[A + x] = _texel((x_u * u + x_1) / up, (y_u * u + y_1) / up)
    for x in range(count):
        at = _PATCHES + _TWO * np.uint64(work[A + x])
        work[A + x] = tiles[at]
        work[C + x] = tiles[at + _NEXT]
    for x in range(count):
        u = work[U + x]
        ray = ONE / np.sqrt(u * u + v * v + ONE)
        up = (z_u * u + z_1) * ray
        high = up * _SOFT if up * _SOFT < ONE else ONE
        high = high if high > ZERO else ZERO
        toward = (u * sun0 + v * sun1 + sun2) * ray
        bright = ONE + clear * (_AROUND * toward + _CLOSE * toward * toward)
        veil = high * _VEILED * work[A + x]
        hue = high * _TINTED * work[C + x] + clear * _WARM * toward
        empty = work[W + x] <= ZERO
        work[R + x] *= bright + veil + hue if empty else ONE
        work[G + x] *= bright + veil if empty else ONE
        work[B + x] *= bright + veil * _HALF - hue if empty else ONE
