"""Shadows under and beside vehicles and furniture, over a finished picture: for people only (R-13).

A pixel of the ground knows where it lies: its inverse depth says so. Near a body's outline it gets
less of the sky, and where the body stands between it and the sun, less of the sun. Depth and
classes stay as they are. Strengths are chosen by eye.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.weather import Weather
from skidpad.physics.camera import share_left
from skidpad.physics.optics import Air, sunlight
from skidpad.sensors.finish.casters import Bodies
from skidpad.sensors.finish.fog import Fog, share_of_beam
from skidpad.sensors.finish.outline import MOST, spans
from skidpad.sensors.pictures.blocks import BLOCK, ONE, ZERO
from skidpad.sensors.pictures.height_fog import thinned_fog
from skidpad.sensors.pictures.lighting import Colour, Lighting
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import ASPHALTS, FIELDS, MATERIALS, Material

GROUND = (
    *ASPHALTS,
    Material.SHOULDER,
    Material.MARKING,
    Material.SIDEWALK,
    Material.GRASS,
    Material.EMBANKMENT,
    Material.MEDIAN,
    *FIELDS,
)
REACH = 90.0  # m; farther shadows are a pixel or two
CONTACT, CONTACT_DARK = 0.5, 0.62  # m around the outline, share of light lost below the body
EDGE = 0.25  # m, how soft the sun's shadow ends beside the body
SUN_WIDE = 0.0093  # rad, the sun's angular diameter: m by which an edge widens per m of its way
LONGEST = 45.0  # m from a body at which the sun's shadow has faded
FADING = 0.5  # share of LONGEST over which it fades
ROUNDED = 0.85  # of half the width of a crown: the radius of its shadow
SUN_DARK = 0.9  # share of the sun's light that a body keeps away
ROUGH = 0.25  # added to the sine of the sun's altitude: blades and grains look towards a low sun; by eye
NO_SUN = 0.02  # share of the light below which the sun casts no shadow that is seen
LEVEL = 1.2  # m above or below, beyond which the ground is another road's
SLACK, SLOPE = 0.15, 0.05  # m and m per m by which the ground may lie off the body's own height
FAR_SLOPE = 0.015  # the same along a shadow
MOST_SHIFT = 8.0  # m by which ground that lies higher or lower moves the end of a shadow
NARROWER = 0.94  # of its box is the outline of a body that casts a shadow: edges are rounded
LANES = 6  # of a block: m from the camera, m along the ray, share left beside bodies, share of the sun hidden
X, Y, Z, WAY, TOUCHED, HIDDEN = (np.intp(n * BLOCK) for n in range(LANES))
FAR_OFF = np.float32(1e6)  # m of height of what is no ground
LEAST_INVERSE = np.float32(1e-5)


class Shade(NamedTuple):
    """How light falls in one weather."""

    sun_x: float  # m of shadow per m of height, away from the sun
    sun_y: float
    sun: Colour  # (3,) share of the light that comes from the sun's direction, by colour
    air: Air  # between a shadow and the eye
    haze: Colour  # (3,) what the air puts in place of the light that it keeps away, of 255^2
    curved: float  # as in `Lighting`


def shade_of(weather: Weather, light: Lighting, fog: Fog) -> Shade:
    """Returns where shadows fall, and how dark they are: as much as the sun adds to the light of the sky.

    What fog and rain above keep from the sun's beam comes from the whole sky. Shadows are as blue as the
    sky is bluer than the sun.
    """
    direction = light.sun_direction
    up = max(float(direction[2]), 0.05)
    beam, sky = sunlight(weather)
    beam *= max(float(direction[2]), 0.0) + ROUGH
    sun = beam * share_of_beam(fog, up)
    sky += beam - sun
    of_sun, of_sky = (c / max(float(c.mean()), 1e-6) for c in (light.sun, light.sky))
    share = sun * of_sun / np.maximum(sun * of_sun + sky * of_sky, 1e-6)
    x, y = -float(direction[0]) / up, -float(direction[1]) / up
    haze = light.horizon * np.float32(light.exposure * 255.0**2)
    return Shade(x, y, share.astype(np.float32), light.air, haze, light.curved)


GROUND_MASK = np.zeros(MATERIALS, dtype=np.bool_)  # by material: shadows are seen on it
GROUND_MASK[list(GROUND)] = True


class _Cast(NamedTuple):
    """One body and the end of its shadow, in the body's axes."""

    c: float
    s: float
    half_l: float
    half_w: float
    begin_x: float  # m by which the shadow begins beside the body: it hangs
    begin_y: float
    end_x: float
    end_y: float
    way_x: float  # unit, away from the sun
    way_y: float
    per_m: float  # m of shadow per m of height
    half_across: float  # of the strip that the shadow covers
    round: bool
    sun: float  # share of the sun that the body hides; 0: it casts no shadow


@inner_kernel
def _cast_of(bodies: Bodies, i: int, shade: Shade) -> _Cast:
    """Returns the shadow of body i: its rectangle, the throw along its axes in m and its darkness."""
    c, s = np.cos(bodies.yaw[i]), np.sin(bodies.yaw[i])
    throw = np.hypot(shade.sun_x, shade.sun_y)
    lift = bodies.lift[i]
    tall = min(bodies.height[i], LONGEST / max(throw, 1e-6))
    unit = 1.0 / max(throw, 1e-6)
    way_x = unit * (c * shade.sun_x + s * shade.sun_y)
    way_y = unit * (c * shade.sun_y - s * shade.sun_x)
    seen = shade.sun[0] + shade.sun[1] + shade.sun[2] > 3.0 * NO_SUN
    dark = SUN_DARK * bodies.dense[i] if seen and lift * throw < LONGEST else 0.0
    half_l, half_w = 0.5 * bodies.length[i], 0.5 * bodies.width[i]
    return _Cast(
        c, s, half_l, half_w, lift * throw * way_x, lift * throw * way_y,
        tall * throw * way_x, tall * throw * way_y, way_x, way_y, throw,
        half_l * abs(way_y) + half_w * abs(way_x), bodies.round[i], dark,
    )  # fmt: skip


@inner_kernel
def _corners(bodies: Bodies, i: int, cast: _Cast, out: Floats) -> None:
    """Writes (16, 3) corners of what a shadow can darken: the body's footprint and the shadow's end."""
    size = cast.half_l + cast.half_w
    length = np.hypot(cast.end_x, cast.end_y) if cast.sun > 0.0 else 0.0
    hangs = bodies.lift[i] > CONTACT
    k = 0
    for end in range(2):
        far = float(end) if cast.sun > 0.0 else 0.0
        begin = 1.0 if hangs else far
        slack = min(SLACK + SLOPE * size + FAR_SLOPE * far * length, LEVEL)
        shift = far * min(slack * cast.per_m, MOST_SHIFT)
        for a in (-1.0, 1.0):
            for b in (-1.0, 1.0):
                lx = a * (cast.half_l + CONTACT) + begin * cast.begin_x + far * cast.end_x
                ly = b * (cast.half_w + CONTACT) + begin * cast.begin_y + far * cast.end_y
                for side in (-1.0, 1.0):
                    x, y = lx - side * shift * cast.way_x, ly - side * shift * cast.way_y
                    out[k, 0] = bodies.x[i] + cast.c * x - cast.s * y
                    out[k, 1] = bodies.y[i] + cast.s * x + cast.c * y
                    out[k, 2] = bodies.z[i] - bodies.lift[i] + side * slack
                    k += 1


@inner_kernel
def _outside(lx: float, ly: float, half_l: float, half_w: float) -> float:
    """Returns the distance in m to a box's outline, negative inside."""
    qx, qy = abs(lx) - half_l, abs(ly) - half_w
    if qx <= 0.0 or qy <= 0.0:
        return float(max(qx, qy))
    return float(np.sqrt(qx * qx + qy * qy))


@inner_kernel
def _beyond_shadow(cast: _Cast, lx: float, ly: float) -> float:
    """Returns the m to the outline that the box sweeps to the end of its shadow, negative inside.

    A swept box is bounded by its own two directions and by that of the way; beyond a corner the
    largest of the three is a little less than the distance.
    """
    px = lx - cast.begin_x - 0.5 * cast.end_x
    py = ly - cast.begin_y - 0.5 * cast.end_y
    if cast.round:
        return _beyond_disc(cast, px, py)
    half_l, half_w = NARROWER * cast.half_l, NARROWER * cast.half_w
    along = abs(px) - half_l - 0.5 * abs(cast.end_x)
    aside = abs(py) - half_w - 0.5 * abs(cast.end_y)
    way = np.sqrt(cast.end_x * cast.end_x + cast.end_y * cast.end_y)
    if way < 1e-6:
        return float(max(along, aside))
    nx, ny = -cast.end_y / way, cast.end_x / way
    across = abs(nx * px + ny * py) - half_l * abs(nx) - half_w * abs(ny)
    return float(max(along, aside, across))


@inner_kernel
def _beyond_disc(cast: _Cast, px: float, py: float) -> float:
    """Returns the m to the outline that a disc sweeps, negative inside; (px, py): from its middle."""
    square = cast.end_x * cast.end_x + cast.end_y * cast.end_y
    along = (px * cast.end_x + py * cast.end_y) / max(square, 1e-9)
    along = min(max(along, -0.5), 0.5)
    dx, dy = px - along * cast.end_x, py - along * cast.end_y
    return float(np.sqrt(dx * dx + dy * dy) - ROUNDED * min(cast.half_l, cast.half_w))


@inner_kernel
def _contact_at(cast: _Cast, lx: float, ly: float) -> float:
    """Returns the share of the light that reaches the ground beside a body, at (lx, ly) in its axes."""
    near = (CONTACT - _outside(lx, ly, cast.half_l, cast.half_w)) / (1.6 * CONTACT)
    near = min(max(near, 0.0), 1.0)
    return float(1.0 - CONTACT_DARK * near * near)


@inner_kernel
def _hidden_at(cast: _Cast, lx: float, ly: float, h: float) -> float:
    """Returns the share of the sun that the body hides from a place `h` m above its foot.

    The place is moved along the light down to the height of the foot, where the shadow is known.
    """
    along = max(lx * cast.way_x + ly * cast.way_y, 0.0)
    left = (LONGEST - along) / (FADING * LONGEST)
    edge = EDGE + SUN_WIDE * along
    across = abs(lx * cast.way_y - ly * cast.way_x) - cast.half_across
    if left <= 0.0 or across > 0.5 * edge:
        return 0.0
    shift = h * cast.per_m
    beyond = _beyond_shadow(cast, lx + shift * cast.way_x, ly + shift * cast.way_y)
    dark = min((0.5 * edge - beyond) / edge, 1.0)
    return float(cast.sun * max(dark, 0.0) * min(left, 1.0))


@inner_kernel
def _place_block(
    view: View,
    row: int,
    begin: int,
    count: int,
    ground: NDArray[np.bool_],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    lanes: Floats32,
) -> None:
    """Writes where the ground of a block of a row lies, in m from the camera, to `lanes`, as yet bright."""
    r, per = view.rotation, np.float32(1.0 / view.focal)
    v = np.float32(row + 0.5 - view.cy) * per
    x_u, x_1 = np.float32(r[0, 0]), np.float32(r[1, 0]) * v + np.float32(r[2, 0])
    y_u, y_1 = np.float32(r[0, 1]), np.float32(r[1, 1]) * v + np.float32(r[2, 1])
    z_u, z_1 = np.float32(r[0, 2]), np.float32(r[1, 2]) * v + np.float32(r[2, 2])
    middle = np.float32(begin + 0.5 - view.cx)
    depths, keys = inverse[row, begin : begin + count], key[row, begin : begin + count]
    for x in range(count):
        u = (np.float32(x) + middle) * per
        w = depths[x]
        z = ONE / (w if w > LEAST_INVERSE else LEAST_INVERSE)
        lanes[X + x], lanes[Y + x], lanes[Z + x] = (
            z * (x_u * u + x_1),
            z * (y_u * u + y_1),
            z * (z_u * u + z_1),
        )
        lanes[WAY + x] = z * np.sqrt(u * u + v * v + ONE)
        lanes[TOUCHED + x], lanes[HIDDEN + x] = ONE, ZERO
    for x in range(count):
        k = keys[x]
        if (k >> 16) != 0 or not ground[k & 255]:
            lanes[Z + x] = FAR_OFF


@inner_kernel
def _darken(
    view: View, bodies: Bodies, i: int, cast: _Cast, first: int, end: int, lanes: Floats32
) -> bool:
    """Lowers TOUCHED and raises HIDDEN of a block's pixels first to end - 1 by one body; whether it did."""
    ox, oy = view.centre[0] - bodies.x[i], view.centre[1] - bodies.y[i]
    oz = np.float32(view.centre[2] - bodies.z[i] + bodies.lift[i])
    x0, y0 = np.float32(cast.c * ox + cast.s * oy), np.float32(cast.c * oy - cast.s * ox)
    c, s, level = np.float32(cast.c), np.float32(cast.s), np.float32(LEVEL)
    touches, most, did = bodies.lift[i] <= CONTACT, np.float32(cast.sun), False
    near_l, near_w = np.float32(cast.half_l + CONTACT), np.float32(cast.half_w + CONTACT)
    way_x, way_y, longest = np.float32(cast.way_x), np.float32(cast.way_y), np.float32(LONGEST)
    half = np.float32(cast.half_across + 0.5 * (EDGE + SUN_WIDE * LONGEST))
    size = np.float32(cast.half_l + cast.half_w + MOST_SHIFT)
    for x in range(first, end):
        h = lanes[Z + x] + oz
        if abs(h) > level:
            continue
        lx, ly = c * lanes[X + x] + s * lanes[Y + x] + x0, c * lanes[Y + x] - s * lanes[X + x] + y0
        if touches and abs(lx) < near_l and abs(ly) < near_w:
            lanes[TOUCHED + x] *= np.float32(_contact_at(cast, lx, ly))
            did = True
        along, across = lx * way_x + ly * way_y, abs(lx * way_y - ly * way_x)
        if across < half and -size < along < longest and lanes[HIDDEN + x] < most:
            dark = np.float32(_hidden_at(cast, lx, ly, h))
            if dark > lanes[HIDDEN + x]:
                lanes[HIDDEN + x] = dark
                did = True
    return did


@inner_kernel
def _dim(value: np.float32, veil: np.float32, left: np.float32) -> np.float32:
    """Returns a byte whose light, but for the veil of the air, is dimmed to a share. veil: of 255^2."""
    ground = value * value - veil
    ground = ground if ground > ZERO else ZERO
    dimmed: np.float32 = np.sqrt(value * value - ground * (ONE - left))
    return dimmed


@inner_kernel
def _dim_block(
    shade: Shade, height: float, count: int, lanes: Floats32, pixels: NDArray[np.uint32]
) -> None:
    """Takes from a block's pixels the light that shadows keep from the ground; what the air adds stays.

    Their bytes are square roots of light. height: m, of the camera.
    """
    eye, fall = np.float32(height - shade.air.ground), np.float32(shade.air.thinning)
    fog, start = np.float32(shade.air.fog), np.float32(shade.air.fog_start)
    rain, curved = np.float32(shade.air.rain), np.float32(shade.curved)
    red, green, blue = shade.sun[0], shade.sun[1], shade.sun[2]
    haze_r, haze_g, haze_b = shade.haze[0], shade.haze[1], shade.haze[2]
    for x in range(count):
        way = lanes[WAY + x]
        foggy = (way - start if way > start else ZERO) * fog
        foggy *= thinned_fog(eye, lanes[Z + x], start / way, fall) if fall > ZERO else ONE
        lost = ONE - share_left(foggy + way * rain, curved)
        touched, dark = lanes[TOUCHED + x], lanes[HIDDEN + x]
        r, g, b = unpack(pixels[x])
        r = _dim(r, lost * haze_r, touched * (ONE - dark * red))
        g = _dim(g, lost * haze_g, touched * (ONE - dark * green))
        b = _dim(b, lost * haze_b, touched * (ONE - dark * blue))
        pixels[x] = pack(r, g, b)


@kernel
def cast_shadows(
    view: View,
    bodies: Bodies,
    shade: Shade,
    ground: NDArray[np.bool_],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Darkens the ground in the rows of a view's picture `out`, packed as by `shade`, row by row.

    Where several bodies hide the sun, the one that hides most of it counts.
    """
    n, height, width = bodies.x.size, out.shape[0], out.shape[1]
    corners, points = np.empty((16, 3)), np.empty((MOST, 2))
    ring = np.empty(2 * MOST, dtype=np.int64)
    columns = np.empty((n, height, 2), dtype=np.int64)
    rows = np.zeros((n, 2), dtype=np.int64)
    lanes = np.empty(LANES * BLOCK, dtype=np.float32)
    casts = [_cast_of(bodies, i, shade) for i in range(n)]
    for i in range(n):
        far = np.hypot(bodies.x[i] - view.centre[0], bodies.y[i] - view.centre[1]) > REACH
        if not far and bodies.present[i]:
            _corners(bodies, i, casts[i], corners)
            rows[i, 0], rows[i, 1] = spans(view, corners, points, ring, columns[i])
    for row in range(view.top, view.height):
        for begin in range(0, width, BLOCK):
            count, place, dim = min(BLOCK, width - begin), True, False
            for i in range(n):
                if not rows[i, 0] <= row < rows[i, 1]:
                    continue
                a = max(columns[i, row, 0] - begin, 0)
                b = min(columns[i, row, 1] - begin, count)
                if a >= b:
                    continue
                if place:
                    _place_block(view, row, begin, count, ground, inverse, key, lanes)
                    place = False
                dim |= _darken(view, bodies, i, casts[i], a, b, lanes)
            if dim:
                _dim_block(shade, view.centre[2], count, lanes, out[row, begin : begin + count])
