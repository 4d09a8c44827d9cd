"""Spray behind vehicles in colour pictures: what clouds take of the light, and the sky that they scatter.

The clouds are those of the lidar (`ranging/clouds`), with the extinction of `physics.spray`; along each
pixel's ray it is summed up, as `camera.spray_transmission` has it for one density. A cloud has
the colour into which the ground fades in fog: an assumption. Pictures show its mean: no grain.
"""

from __future__ import annotations

from math import cos, inf, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.physics.camera import share_left
from skidpad.sensors.pictures.lighting import Colour
from skidpad.sensors.pictures.packing import pack, rounded, unpack
from skidpad.sensors.ranging.clouds import THIN
from skidpad.sensors.raster.view import View

NEAR = 0.1  # m before a camera, from which on a corner's place in the picture is told
LEAST = 2e-3  # of depth: a quarter of a step of a byte


@kernel
def veil_by_spray(
    view: View,
    clouds: Floats,
    inverse: NDArray[np.float32],
    colour: Colour,
    out: NDArray[np.uint32],
) -> None:
    """Fades the rows of a view in `out` (H, W) behind clouds (k, 8) into a colour, in linear light.

    A cloud: x, y, z of the middle of the rear at the road, yaw, length, half width, height in m,
    extinction in 1/m at its begin. inverse: (H, W) 1/m of depth, 0: nothing is met. colour: (3,).
    """
    rows, width = view.height - view.top, out.shape[1]
    depth = np.zeros((rows, width), dtype=np.float32)
    reached = np.zeros(rows, dtype=np.bool_)
    for c in range(len(clouds)):
        _add_depth(view, clouds[c], inverse, depth, reached)
    one, byte, least = np.float32(1.0), np.float32(1.0 / 255.0), np.float32(LEAST)
    white, red, green, blue = np.float32(255.0), colour[0], colour[1], colour[2]
    for row in range(rows):
        if not reached[row]:
            continue
        pixels, taus = out[view.top + row], depth[row]
        for x in range(pixels.size):
            left = share_left(taus[x], one)
            veil = one - left
            r, g, b = unpack(pixels[x])
            r, g, b = r * byte, g * byte, b * byte
            r = np.sqrt(r * r * left + veil * red)
            g = np.sqrt(g * g * left + veil * green)
            b = np.sqrt(b * b * left + veil * blue)
            r, g, b = (r if r < one else one), (g if g < one else one), (b if b < one else one)
            veiled = pack(rounded(r * white), rounded(g * white), rounded(b * white))
            pixels[x] = veiled if taus[x] > least else pixels[x]


@inner_kernel
def _add_depth(
    view: View,
    cloud: Floats,
    inverse: NDArray[np.float32],
    depth: NDArray[np.float32],
    reached: NDArray[np.bool_],
) -> None:
    """Adds the optical depth of one cloud up to what is seen, by pixel of the view's rows.

    Simpson's rule along the ray: a cloud thins out to 1 / 6, so it is within 0.4 %. No branch in the loop
    over a row, so that it vectorises.
    """
    length, half, high = np.float32(cloud[4]), np.float32(cloud[5]), np.float32(cloud[6])
    cy, sy, r = cos(cloud[3]), sin(cloud[3]), view.rotation
    ox, oy = view.centre[0] - cloud[0], view.centre[1] - cloud[1]
    back, left = np.float32(-(ox * cy + oy * sy)), np.float32(oy * cy - ox * sy)
    up = np.float32(view.centre[2] - cloud[2])
    first_x, last_x, first_row, last_row = _frame(view, cloud, cy, sy, depth.shape[1])
    none, one, four, much = np.float32(0.0), np.float32(1.0), np.float32(4.0), np.float32(1e6)
    thins = np.float32(THIN / cloud[4])
    sixth, mid = np.float32(cloud[7] / 6.0), np.float32(0.5)
    per, centre = np.float32(1.0 / view.focal), np.float32(first_x + 0.5 - view.cx)
    gone_u, aside_u = (
        np.float32(-(r[0, 0] * cy + r[0, 1] * sy)),
        np.float32(r[0, 1] * cy - r[0, 0] * sy),
    )
    rise_u = np.float32(r[0, 2])
    for row in range(first_row, last_row):
        v = (row + 0.5 - view.cy) / view.focal
        wx, wy = r[1, 0] * v + r[2, 0], r[1, 1] * v + r[2, 1]  # per m of depth
        gone_v, aside_v = np.float32(-(wx * cy + wy * sy)), np.float32(wy * cy - wx * sy)
        rise_v, square = np.float32(r[1, 2] * v + r[2, 2]), np.float32(v * v + 1.0)
        seen, sums = inverse[row, first_x:last_x], depth[row - view.top, first_x:last_x]
        reached[row - view.top] = True
        for x in range(sums.size):
            u = (np.float32(x) + centre) * per
            gone, aside, rise = gone_u * u + gone_v, aside_u * u + aside_v, rise_u * u + rise_v
            gone = _away(gone)
            aside, rise = _away(aside), _away(rise)
            far = one / seen[x] if seen[x] > none else much
            a, b = -back / gone, (length - back) / gone
            c, d = -up / rise, (high - up) / rise
            e, f = (-half - left) / aside, (half - left) / aside
            low = _more(_more(_less(a, b), _less(c, d)), _more(_less(e, f), none))
            far = _less(_less(_more(a, b), _more(c, d)), _less(_more(e, f), far))
            way = _more(far - low, none)
            begin, further = thins * (back + gone * low), thins * gone * way
            middle, end = begin + mid * further, begin + further
            inside = share_left(_more(begin, none), one) + share_left(_more(end, none), one)
            inside += four * share_left(_more(middle, none), one)
            stretch = np.sqrt(u * u + square)  # m of ray per m of depth
            sums[x] += sixth * inside * way * stretch if way > none else none


@inner_kernel
def _away(w: np.float32) -> np.float32:
    """Returns a number that is not zero."""
    small = np.float32(1e-6)
    return small if -small < w < small else w


@inner_kernel
def _less(a: np.float32, b: np.float32) -> np.float32:
    """Returns the smaller one of two numbers."""
    return a if a < b else b


@inner_kernel
def _more(a: np.float32, b: np.float32) -> np.float32:
    """Returns the larger one of two numbers."""
    return a if a > b else b


@inner_kernel
def _frame(
    view: View, cloud: Floats, cy: float, sy: float, width: int
) -> tuple[int, int, int, int]:
    """Returns from and to which column and row a cloud lies; all of them where it reaches the camera."""
    r = view.rotation
    low_x, high_x, low_y, high_y = inf, -inf, inf, -inf
    ahead = 0
    for k in range(8):
        back = cloud[4] if k & 1 else 0.0
        left = cloud[5] if k & 2 else -cloud[5]
        x = cloud[0] - back * cy - left * sy - view.centre[0]
        y = cloud[1] - back * sy + left * cy - view.centre[1]
        z = cloud[2] + (cloud[6] if k & 4 else 0.0) - view.centre[2]
        forward = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
        if forward < NEAR:
            continue
        ahead += 1
        u = view.cx + view.focal * (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z) / forward
        v = view.cy + view.focal * (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z) / forward
        low_x, high_x = min(low_x, u), max(high_x, u)
        low_y, high_y = min(low_y, v), max(high_y, v)
    if ahead == 0:
        return 0, 0, 0, 0
    if ahead < 8:
        return 0, width, view.top, view.height
    return (
        max(int(min(low_x, width)), 0),
        min(max(int(high_x) + 1, 0), width),
        max(int(min(low_y, view.height)), view.top),
        min(max(int(high_y) + 1, 0), view.height),
    )
