"""Bloom around lamps, and their reflection on a wet road: light added to a finished picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.physics.optics import Air, air_depth
from skidpad.sensors.finish.lamps import Sources
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View

WHITE = np.float32(65025.0)  # a byte's square, of light 1
FARTHEST = 350.0  # m
CLEARANCE = 0.35  # m by which something must stand before a lamp to hide it
LEAST = 0.004  # light below which nothing is added
FAINT = 2e-5  # light that a black pixel of a streak does not show: one step of its byte
BLOOM, BLOOM_MOST = 0.16, 30.0  # m of the core's radius, px of the largest halo
LENS = 1.2  # px of the core, however far the lamp
F0 = 0.03  # reflectance of water at normal incidence
STREAK_WIDTH, STREAK_SHARE = 0.22, 1.5  # m, strength beside the bloom's
LONGEST = 6.0  # lengths of its fall after which a streak ends


@inner_kernel
def add_light(p: np.uint32, r: float, g: float, b: float) -> np.uint32:
    """Returns the packed pixel p with light r, g, b added (1: white); its bytes are square roots of light."""
    red, green, blue = unpack(p)
    red = min(np.sqrt(red * red + WHITE * np.float32(r)), np.float32(255.0))
    green = min(np.sqrt(green * green + WHITE * np.float32(g)), np.float32(255.0))
    blue = min(np.sqrt(blue * blue + WHITE * np.float32(b)), np.float32(255.0))
    return pack(red, green, blue)


@inner_kernel
def _visible_share(view: View, u: float, v: float, z: float, inverse: NDArray[np.float32]) -> float:
    """Returns the share of a lamp at (u, v) px, z m ahead, that nothing hides."""
    height, width = inverse.shape
    nearest = 1.0 / max(z - CLEARANCE, 0.1)
    free = 0
    for a in range(-1, 2):
        for b in range(-1, 2):
            row = min(max(int(v) + a, view.top), min(height, view.height) - 1)
            column = min(max(int(u) + b, 0), width - 1)
            free += inverse[row, column] < nearest
    return free / 9.0


@inner_kernel
def _halo(
    view: View, u: float, v: float, core: float, light: tuple[float, float, float],
    out: NDArray[np.uint32],
) -> None:  # fmt: skip
    """Adds a round bloom: light / (1 + (d / core)^2)^2, out to where it is too faint to see; core: px."""
    most = max(light)
    reach = min(core * np.sqrt(max(np.sqrt(most / LEAST) - 1.0, 0.0)), BLOOM_MOST)
    for row in range(max(int(v - reach), view.top), min(int(v + reach) + 1, view.height)):
        for column in range(max(int(u - reach), 0), min(int(u + reach) + 1, view.width)):
            d2 = (row + 0.5 - v) ** 2 + (column + 0.5 - u) ** 2
            edge = 1.0 - d2 / (reach * reach)
            if edge <= 0.0:
                continue
            f = 1.0 + d2 / (core * core)
            f = edge / (f * f)
            out[row, column] = add_light(out[row, column], f * light[0], f * light[1], f * light[2])


@inner_kernel
def _streak(
    view: View,
    place: tuple[float, float, float, float],
    light: tuple[float, float, float],
    wettable: NDArray[np.bool_],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Adds an upright streak on the road: place is column, row of its begin and of its middle, width; px."""
    u, begin, middle, wide = place
    tall = max(0.6 * (middle - begin), 4.0)
    reach, most = 2.6 * wide, max(light)
    left, right = max(int(u - reach), 0), min(int(u + reach) + 1, view.width)
    last = min(middle + LONGEST * tall, float(view.height))
    across = np.exp(-(((np.arange(left, max(left, right)) + 0.5 - u) / wide) ** 2))
    for row in range(max(int(begin), view.top), max(int(last), view.top)):
        off = abs(row + 0.5 - middle) / tall
        fall = np.exp(-off) * max(1.0 - off / LONGEST, 0.0)
        if fall * most < FAINT:
            continue
        for column in range(left, right):
            f = fall * across[column - left]
            k = key[row, column]
            if f * most < FAINT or (k >> 16) != 0 or not wettable[k & 255]:
                continue
            out[row, column] = add_light(out[row, column], f * light[0], f * light[1], f * light[2])


@inner_kernel
def _ahead(view: View, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Returns column, row and depth in m of a point; depth -1 less than 0.5 m ahead."""
    r, c = view.rotation, view.centre
    dx, dy, dz = x - c[0], y - c[1], z - c[2]
    depth = r[2, 0] * dx + r[2, 1] * dy + r[2, 2] * dz
    if depth < 0.5:
        return 0.0, 0.0, -1.0
    u = view.cx + view.focal * (r[0, 0] * dx + r[0, 1] * dy + r[0, 2] * dz) / depth
    v = view.cy + view.focal * (r[1, 0] * dx + r[1, 1] * dy + r[1, 2] * dz) / depth
    return u, v, depth


@kernel
def shine(
    view: View,
    sources: Sources,
    bloom: bool,
    wet: float,
    air: Air,
    wettable: NDArray[np.bool_],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Adds bloom and, on a road as wet as `wet` (0: none), reflections of all lamps in sight to `out`."""
    for i in range(sources.x.size):
        x, y, z = sources.x[i], sources.y[i], sources.z[i]
        u, v, depth = _ahead(view, x, y, z)
        if depth < 0.0 or depth > FARTHEST or not (-40.0 < u < view.width + 40.0):
            continue
        dx, dy, up = view.centre[0] - x, view.centre[1] - y, view.centre[2] - z
        far = np.sqrt(dx * dx + dy * dy + up * up)
        facing = (dx * sources.face_x[i] + dy * sources.face_y[i]) / far
        if facing <= 0.02:
            continue
        power = facing * np.exp(-air_depth(air, far, view.centre[2], -up))
        c = sources.colour[i]
        inside = 0.0 <= u < view.width and view.top <= v < view.height
        if inside:
            power *= _visible_share(view, u, v, depth, inverse)
        if power < LEAST:
            continue
        if bloom and inside:
            core = LENS + view.focal * BLOOM * (sources.size[i] / 0.11) / far
            _halo(view, u, v, core, (power * c[0], power * c[1], power * c[2]), out)
        if wet > 0.0:
            foot = _ahead(view, x, y, sources.ground[i])
            image = _ahead(view, x, y, 2.0 * sources.ground[i] - z)
            if foot[2] < 0.0 or image[2] < 0.0 or image[1] <= foot[1]:
                continue
            rise = (z - 2.0 * sources.ground[i] + view.centre[2]) / far
            grazing = 1.0 - min(max(rise, 0.0), 1.0)
            mirror = wet * STREAK_SHARE * power * (F0 + (1.0 - F0) * grazing**5)
            place = (u, foot[1], image[1], 1.2 + view.focal * STREAK_WIDTH / far)
            _streak(view, place, (mirror * c[0], mirror * c[1], mirror * c[2]), wettable, key, out)
