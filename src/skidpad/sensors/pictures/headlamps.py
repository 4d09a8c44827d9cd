"""The light that the ego's headlamps throw: the beam at a point, and on what a block shows."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.sensors.pictures.blocks import ONE, ZERO, H, U, W
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.raster.view import View

BEHIND_BY = 1e-3  # of a ray's length, so that rounding cannot bring a point before the lamps
HEADLAMP_X, HEADLAMP_Z = 1.75, 0.65  # m, in the ego's frame

_TWO, _THREE = np.float32(2.0), np.float32(3.0)
_BEAM_WIDTH = np.float32(2.6)  # 1 / tangent squared: half the light at 22 deg to the side
_BEAM_RANGE = np.float32(1.0 / 380.0)  # 1/m^2: a low beam lights some 40 m of road
_CUT_SLOPE = np.float32(42.0)  # the cut-off: half the light 1.4 deg above the lamp
_HIGH_RANGE = np.float32(1.0 / 3000.0)  # 1/m^2: a high beam lights some 110 m of road
_HIGH_SLOPE = np.float32(6.0)  # and falls to half 10 deg above the lamp: no cut-off, by eye
LAMP_X, LAMP_Z = np.float32(HEADLAMP_X), np.float32(HEADLAMP_Z)
_BEAM_POWER = np.float32(2.6)
_NEAR_LAMP, _LAMP_APART = np.float32(0.3), np.float32(1.2)  # m
_FARTHEST = np.float32(1e-6)


@inner_kernel
def beam_at(
    px: np.float32,
    py: np.float32,
    pz: np.float32,
    beam: np.float32,
    slope: np.float32,
    reach: np.float32,
) -> np.float32:
    """Returns the light of the beam at a point (m, lamps' frame): a soft cone that falls above its cut-off.

    beam, slope, reach: as by `beam_of`. 0 behind the lamps.
    """
    lead = px if px > _NEAR_LAMP else _NEAR_LAMP
    side = py / (lead + _LAMP_APART)
    rise = pz / lead * slope
    rise = rise if rise > ZERO else ZERO
    spread = ONE + _BEAM_WIDTH * side * side
    fall = ONE + (px * px + py * py) * reach
    lit: np.float32 = beam / (spread * spread * fall * fall * (ONE + rise * rise))
    return lit if px > ZERO else ZERO


@inner_kernel
def rise_of_beam(px: np.float32, onset: np.float32) -> np.float32:
    """Returns the share of the beam that has risen `px` m before the lamps; all of it for an onset of 0."""
    t = px / (onset if onset > ZERO else ONE)
    t = t if t < ONE else ONE
    t = t if onset > ZERO else ONE
    risen: np.float32 = t * t * (_THREE - _TWO * t)
    return risen


@inner_kernel
def beam_of(light: Lighting) -> tuple[np.float32, np.float32, np.float32]:
    """Returns power, slope of the cut-off and reach (1/m^2) of the ego's beam; power 0 where it is off."""
    beam = np.float32(light.headlights) * _BEAM_POWER
    slope = _HIGH_SLOPE if light.high else _CUT_SLOPE
    reach = _HIGH_RANGE if light.high else _BEAM_RANGE
    return beam, slope, reach


@kernel
def behind_lamps(
    view: View, v: np.float32, first: int, count: int, to_body: Floats32, before: np.float32
) -> bool:
    """Returns whether no point that a block can show lies before the lamps.

    before: m by which the camera stands before them. v: m down per m ahead of the block's row.
    """
    ahead = -np.inf
    for column in (first, first + count):
        u = (column - view.cx) / view.focal
        ahead = max(ahead, to_body[0, 0] * u + to_body[0, 1] * v + to_body[0, 2])
    return bool(ahead < -BEHIND_BY and before < 0.0)


@inner_kernel
def throw_light(
    v: np.float32,
    count: int,
    light: Lighting,
    to_body: Floats32,
    offset: Floats32,
    work: Floats32,
) -> None:
    """Writes the light of the ego's beam on a block's pixels into lane H of `work`."""
    beam, slope, reach = beam_of(light)
    onset = np.float32(light.onset)
    b00, b01, b02 = to_body[0, 0], to_body[0, 1], to_body[0, 2]
    b10, b11, b12 = to_body[1, 0], to_body[1, 1], to_body[1, 2]
    b20, b21, b22 = to_body[2, 0], to_body[2, 1], to_body[2, 2]
    o0, o1, o2 = offset[0] - LAMP_X, offset[1], offset[2] - LAMP_Z
    for x in range(count):
        u, w = work[U + x], work[W + x]
        z = ONE / (w if w > _FARTHEST else _FARTHEST)
        px = z * (b00 * u + b01 * v + b02) + o0
        py = z * (b10 * u + b11 * v + b12) + o1
        pz = z * (b20 * u + b21 * v + b22) + o2
        work[H + x] = beam_at(px, py, pz, beam, slope, reach) * rise_of_beam(px, onset)
