"""Unevenness of surfaces in colour pictures: noise by place in the world, stronger on some materials.

Only maps with generated scenery have it; on others the table is empty and nothing is computed.
Depth and classes know nothing of it. Strengths are chosen by eye.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from skidpad.core.arrays import Floats, Floats32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.pictures.blocks import (
    BLOCK,
    GX,
    GY,
    LANES,
    ONE,
    ZERO,
    B,
    G,
    R,
    T,
    U,
    W,
    end_of_run,
)
from skidpad.sensors.pictures.lane_wear import soften_border
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.grain import (
    BENEATH,
    GRAINS,
    GRAZING,
    NEAR,
    PATCHES,
    REPAIRS,
    TEXEL,
    TINTS,
)

MORE_LANES = 3  # of the array of a block, behind those of shading
SIZE, COARSE_SIZE = 256, 512  # texels of the edges of the tiles of grains and of patches
COARSE = 0.3  # m, a texel of patches; that of grains is the material's
RECTANGLES = 420  # rectangles in a tile, which cover about a fifth of it
EDGE = 0.9  # texels, the standard deviation of what softens their edges
OCTAVES = (4, 8, 32, 64)  # texels from one value of the noise to the next
NO_TILES = np.zeros(0, dtype=np.int8)


@cache
def make_tiles() -> NDArray[np.int8]:
    """Returns the noise of all surfaces in 127ths: grains, then patches, tints, repairs, 0 by texel.

    Mean 0, deviation a third; repairs: rectangles, 0 where there are none.
    """
    rng = np.random.default_rng(20)
    fine = [rng.standard_normal((SIZE, SIZE)) for _ in range(3)]
    fine[1:] = [
        ndimage.gaussian_filter(fine[n], width, mode="wrap") for n, width in ((1, 1.2), (2, 3.0))
    ]
    coarse = np.zeros((COARSE_SIZE, COARSE_SIZE, 4), dtype=np.int8)
    for n in range(2):
        coarse[..., n] = _quantize([_smooth_noise(rng, step) for step in OCTAVES])
    coarse[..., 2] = _lay_repairs(rng)
    return np.concatenate([_quantize(fine).ravel(), coarse.ravel()])


def _smooth_noise(rng: np.random.Generator, step: int) -> Floats:
    """Returns (COARSE_SIZE, COARSE_SIZE) smooth noise that repeats, from values `step` texels apart."""
    n = COARSE_SIZE // step
    few = ndimage.gaussian_filter(rng.standard_normal((n, n)), 0.7, mode="wrap")
    noise: Floats = ndimage.zoom(few, step, order=3, mode="grid-wrap", grid_mode=True)
    return noise


def _quantize(octaves: Sequence[Floats]) -> NDArray[np.int8]:
    """Returns the sum of octaves of equal strength as bytes: three standard deviations are 127."""
    total = sum((octave / octave.std() for octave in octaves), np.zeros_like(octaves[0]))
    shares = np.clip(total / (3.0 * total.std()), -1.0, 1.0)
    result: NDArray[np.int8] = np.round(127.0 * shares).astype(np.int8)
    return result


def _lay_repairs(rng: np.random.Generator) -> NDArray[np.int8]:
    """Returns (COARSE_SIZE, COARSE_SIZE) how much darker (below 0) or paler repaired rectangles are.

    Their edges are soft, as grains would tear a hard one (`_SPREAD`).
    """
    tile = np.zeros((COARSE_SIZE, COARSE_SIZE))
    for _ in range(RECTANGLES):
        sizes = rng.permutation([rng.integers(12, 48), rng.integers(6, 14)])
        row, column = rng.integers(0, COARSE_SIZE, 2)
        rows, columns = (
            (at + np.arange(n)) % COARSE_SIZE for at, n in zip((row, column), sizes, strict=True)
        )
        tile[np.ix_(rows, columns)] = rng.choice((-127, -90, -50, 60))
    soft: NDArray[np.int8] = ndimage.gaussian_filter(tile, EDGE, mode="wrap").astype(np.int8)
    return soft


A, C, F = (np.intp((LANES + n) * BLOCK) for n in range(MORE_LANES))
_PATCHES, _STEP = np.uint64(SIZE * SIZE), np.uint64(4)
_TINT, _REPAIR = np.uint64(1), np.uint64(2)
_SIZE, _COARSE_SIZE = np.float32(SIZE), np.float32(COARSE_SIZE)
_PER_BYTE = np.float32(1.0 / 127.0)
_PER_COARSE = np.float32(1.0 / COARSE)
_LEAN_X, _LEAN_Y = np.float32(0.37), np.float32(0.91)  # m per m of height, so that walls vary too
_WIDE = np.float32(2.5)  # px of a texel of grains, from which on one of half its size is taken
_FORE, _EVEN = np.float32(3.0), np.float32(0.42)  # m; rough ground is brighter at grazing angles
_SPREAD = np.float32(0.35)  # m by which grains blur the edges of patches
_FARTHEST = np.float32(1e-5)
_LEAST = np.float32(0.35)
_LOW = np.float32(0.02)  # climb of a ray per metre, below which veils are not drawn out further
_VEIL = np.float32(1.0 / 70.0)  # texels of a layer of veils per metre of its height
_SOFT = np.float32(6.0)  # veils reach their full strength this steeply above the horizon
_AROUND, _CLOSE, _DEEP = np.float32(0.26), np.float32(0.26), np.float32(0.32)
_VEILED, _TINTED, _WARM = np.float32(0.28), np.float32(0.11), np.float32(0.08)
_HALF, _TWO, _FOUR, _EIGHT = np.float32(0.5), np.float32(2.0), np.float32(4.0), np.float32(8.0)
_COOL = np.float32(0.14)  # of what grazing light adds: it comes from the sky, not from the sun
_GREEN = np.float32(0.35)
_TINY = np.float32(1e-12)
# of a wet road's water, by place
_FILM, _UNEVEN, _DRIEST = np.float32(0.75), np.float32(0.9), np.float32(0.3)
# of the dark beneath: on what stands upright, per climb
_SIDE, _STEEPLY = np.float32(0.45), np.float32(1.4)
_TURNED = np.float32(0.55)  # by which grains of leaves turn them up or down
_SHEEN = np.float32(0.5)  # of rough ground towards the sun's image, by eye


@inner_kernel
def _texel(a: np.float32, b: np.float32, size: np.float32) -> np.float32:
    """Returns the index of the texel at row a and column b of a tile of `size` texels that repeats."""
    per_size = ONE / size
    i, j = np.floor(a), np.floor(b)
    i -= size * np.floor(i * per_size)
    j -= size * np.floor(j * per_size)
    index: np.float32 = i * size + j
    return index


@inner_kernel
def roughen(
    view: View, v: np.float32, count: int, keys: NDArray[np.int32], table: Floats32, grain: Floats32,
    tiles: NDArray[np.int8], clear: np.float32, wet: np.float32, up: Floats32, mirrored: Floats32,
    work: Floats32,
) -> None:  # fmt: skip
    """Changes the colours of a block's surfaces in `work` by where they lie and how they lie to the sun.

    v: m down per m ahead of the block's row; clear, wet: of 1, light of the sun's disc and water on the road;
    up, mirrored: (3,) camera axes, the latter towards the sun's image below the ground; table: colours as in
    `gather`; grain, tiles: `grain_table`, `make_tiles`. Near the camera grains are finer, so that no texel
    is seen as a square.
    """
    r = view.rotation
    x_u, x_1 = np.float32(r[0, 0]), np.float32(r[1, 0]) * v + np.float32(r[2, 0])
    y_u, y_1 = np.float32(r[0, 1]), np.float32(r[1, 1]) * v + np.float32(r[2, 1])
    z_u, z_1 = np.float32(r[0, 2]), np.float32(r[1, 2]) * v + np.float32(r[2, 2])
    a_u, a_1 = x_u + _LEAN_X * z_u, x_1 + _LEAN_X * z_1
    b_u, b_1 = y_u + _LEAN_Y * z_u, y_1 + _LEAN_Y * z_1
    sun0, sun1, sun2 = mirrored[0], mirrored[1], mirrored[2]
    sheen, height = clear * _SHEEN, np.float32(view.centre[2])
    a_0 = np.float32(view.centre[0]) + _LEAN_X * height
    b_0 = np.float32(view.centre[1]) + _LEAN_Y * height
    x, begin, focal = 0, 0, np.float32(view.focal)
    while x < count:
        m, end = keys[x] & 255, end_of_run(keys, x)
        grains, patches = grain[m, GRAINS], grain[m, PATCHES]
        tints, repairs = grain[m, TINTS], grain[m, REPAIRS]
        graze, texel, reach = grain[m, GRAZING], grain[m, TEXEL], grain[m, NEAR]
        per_patch, per_repair = patches * _PER_BYTE, repairs * _PER_BYTE
        if x > 0:
            soften_border(focal, begin, x, end, keys, table, work)
        run, size, begin = work[x:], end - x, x
        x = end
        if patches == ZERO:
            continue
        wide, per = focal * texel / _WIDE, ONE / texel
        for n in range(size):  # reading a tile may not stand in a loop that shall be vectorised
            u, w = run[U + n], run[W + n]
            z = ONE / (w if w > _FARTHEST else _FARTHEST)
            run[A + n], run[C + n] = a_0 + z * (a_u * u + a_1), b_0 + z * (b_u * u + b_1)
            fine = per if w * wide < ONE else _TWO * per
            fine = fine if w * wide < _TWO else _FOUR * per
            fine = fine if w * wide < _FOUR else _EIGHT * per
            run[F + n] = _texel(run[A + n] * fine, run[C + n] * fine, _SIZE)
        for n in range(size):
            run[F + n] = _PER_BYTE * tiles[np.uint64(run[F + n])]
        for n in range(size):
            blur = run[F + n] * _SPREAD
            run[A + n] = _texel(
                (run[A + n] + blur) * _PER_COARSE, (run[C + n] - blur) * _PER_COARSE, _COARSE_SIZE
            )
        for n in range(size):
            at = _PATCHES + _STEP * np.uint64(run[A + n])
            run[A + n] = per_patch * tiles[at] + per_repair * tiles[at + _REPAIR]
            run[C + n] = _PER_BYTE * tiles[at + _TINT]
        for n in range(size):
            fade = reach * run[W + n]
            fade = fade if fade < ONE else ONE
            near = _FORE * run[W + n]
            near = _EVEN - near / (ONE + near)
            u = run[U + n]
            toward = (u * sun0 + v * sun1 + sun2) / np.sqrt(u * u + v * v + ONE)
            toward = toward if toward > ZERO else ZERO
            toward *= toward
            toward *= toward
            near += sheen * toward * toward
            grazing = graze * near
            share = ONE + grains * fade * run[F + n] + run[A + n] + grazing
            share = share if share > _LEAST else _LEAST
            hue = tints * run[C + n] * share - _COOL * grazing
            run[R + n] *= share + hue
            run[G + n] *= share + _GREEN * hue
            run[B + n] *= share - hue
        if wet > ZERO:
            for n in range(size):  # water stands where patches are dark
                film = _FILM - _UNEVEN * run[A + n]
                film = film if film > _DRIEST else _DRIEST
                run[T + n] *= film if film < ONE else ONE
        if grain[m, BENEATH] > ZERO:
            _dim_beneath(v, size, grain[m, BENEATH], up, run)


@inner_kernel
def _dim_beneath(
    v: np.float32, size: int, beneath: np.float32, up: Floats32, run: Floats32
) -> None:
    """Takes light from a run's surfaces, up to `beneath`, the more they look down, unevenly as leaves do.

    up: (3,) camera axes. Lane F of the run has its grains.
    """
    up0, up1, up2 = up[0], up[1], up[2]
    for n in range(size):
        u, gx, gy = run[U + n], run[GX + n], run[GY + n]
        gz = run[W + n] - u * gx - v * gy
        n_up = -(gx * up0 + gy * up1 + gz * up2) / np.sqrt(gx * gx + gy * gy + gz * gz + _TINY)
        down = _SIDE - _STEEPLY * n_up - _TURNED * run[F + n]
        down = down if down > ZERO else ZERO
        left = ONE - beneath * (down if down < ONE else ONE)
        run[R + n] *= left
        run[G + n] *= left
        run[B + n] *= left


@inner_kernel
def vary_sky(
    view: View, v: np.float32, count: int, light: Lighting, sun: Floats32, tiles: NDArray[np.int8],
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
    clear, dome = np.float32(min(1.0, light.disc * 1.2)), np.float32(light.dome)
    for x in range(count):
        u = work[U + x]
        up = z_u * u + z_1
        up = ((up if up > _LOW else _LOW) + dome * np.sqrt(u * u + v * v + ONE)) * _VEIL
        work[A + x] = _texel((x_u * u + x_1) / up, (y_u * u + y_1) / up, _COARSE_SIZE)
    for x in range(count):
        at = _PATCHES + _STEP * np.uint64(work[A + x])
        work[A + x] = _PER_BYTE * tiles[at]
        work[C + x] = _PER_BYTE * tiles[at + _TINT]
    for x in range(count):
        u = work[U + x]
        ray = ONE / np.sqrt(u * u + v * v + ONE)
        up = (z_u * u + z_1) * ray
        high = up * _SOFT if up * _SOFT < ONE else ONE
        high = high if high > ZERO else ZERO
        toward = (u * sun0 + v * sun1 + sun2) * ray
        bright = ONE + clear * (_AROUND * toward + _CLOSE * toward * toward - _DEEP * up)
        veil = high * _VEILED * work[A + x]
        hue = high * _TINTED * work[C + x] + clear * _WARM * toward
        empty = work[W + x] <= ZERO
        work[R + x] *= bright + veil + hue if empty else ONE
        work[G + x] *= bright + veil if empty else ONE
        work[B + x] *= bright + veil * _HALF - hue if empty else ONE
