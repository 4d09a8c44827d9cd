"""The sun in a picture for people: a disc, the bright sky about it, and the glare that it makes in the lens.

Where the sun is seen, the lens scatters its light over the whole picture, over what stands before the sky as
well, so that edges beside the sun are lost in it. Far from it the light falls with the square of the angle,
as in the formula of disability glare of Stiles and Holladay (CIE 31). Strengths are by eye, and so is the
width of the disc, which is that of an overexposed one. Clouds, fog and what stands before the sun dim it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Floats32
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.weather import Weather
from skidpad.physics.optics import sunlight
from skidpad.sensors.finish.fog import Fog, share_of_beam
from skidpad.sensors.pictures.lighting import Colour, Lighting
from skidpad.sensors.pictures.packing import pack, unpack
from skidpad.sensors.raster.view import View

DISC, DISC_POWER = 0.010, 9.0  # rad, radius of an overexposed disc (the sun's own is 0.0047); light
AUREOLE, AUREOLE_POWER = (
    0.045,
    0.85,
)  # rad at which half is left of the bright sky about it; light beside it
GLARE, GLARE_POWER = 0.14, 0.32  # the same of the glare
SUNNY = 5.0  # times the light of the sky that a sun of full strength has
LEAST = 0.01  # of it, below which no sun is drawn
PLACES = 5  # along and across the disc, at which it is looked whether anything hides it
_BYTE, _WHITE = np.float32(1.0 / 255.0), np.float32(255.0)
_ZERO, _ONE, _TWO = np.float32(0.0), np.float32(1.0), np.float32(2.0)


class Sun(NamedTuple):
    """The sun of one weather."""

    direction: Floats  # (3,) unit, towards it
    colour: Colour  # (3,) linear, times its strength; 0 where it is not seen


def sun_of(weather: Weather, light: Lighting, fog: Fog) -> Sun:
    """Returns the sun of a weather as it is seen through its clouds and fog."""
    beam, sky = sunlight(weather)
    strength = min(beam / (SUNNY * sky), 1.0) if sky > 0.0 else 0.0
    rise = max(float(light.sun_direction[2]), 1e-3)
    strength *= share_of_beam(fog, rise)
    seen = strength if strength > LEAST else 0.0
    colour = seen * light.sun / max(float(light.sun.max()), 1e-6)
    return Sun(light.sun_direction, colour.astype(np.float32))


@inner_kernel
def _seen_share(view: View, u: float, v: float, inverse: NDArray[np.float32]) -> float:
    """Returns the share of the disc at (u, v) px that lies in the picture and has nothing before it."""
    radius, seen = DISC * view.focal, 0
    for a in range(PLACES):
        for b in range(PLACES):
            row = int(np.floor(v + radius * (2.0 * a / (PLACES - 1) - 1.0)))
            column = int(np.floor(u + radius * (2.0 * b / (PLACES - 1) - 1.0)))
            inside = 0 <= row < inverse.shape[0] and 0 <= column < inverse.shape[1]
            if inside and inverse[row, column] <= 0.0:
                seen += 1
    return seen / (PLACES * PLACES)


@kernel
def draw_sun(view: View, sun: Sun, inverse: NDArray[np.float32], out: NDArray[np.uint32]) -> None:
    """Adds disc and aureole to the sky in the rows of a view's picture `out`, and glare to all of it."""
    toward = np.empty(3)
    for a in range(3):
        toward[a] = (
            view.rotation[a, 0] * sun.direction[0]
            + view.rotation[a, 1] * sun.direction[1]
            + view.rotation[a, 2] * sun.direction[2]
        )
    if toward[2] < 0.05:
        return
    u = view.cx + view.focal * toward[0] / toward[2]
    v = view.cy + view.focal * toward[1] / toward[2]
    share = np.float32(_seen_share(view, u, v, inverse))
    _add_sun(view, toward.astype(np.float32), sun.colour, share, inverse, out)


@inner_kernel
def _add_sun(
    view: View,
    toward: Floats32,
    colour: Colour,
    share: np.float32,
    inverse: NDArray[np.float32],
    out: NDArray[np.uint32],
) -> None:
    """Adds the sun's light by the angle from it; toward: (3,) camera axes; share: seen of its disc."""
    per, middle = np.float32(1.0 / view.focal), np.float32(0.5 - view.cx)
    disc, power = np.float32(1.0 / DISC**2), np.float32(DISC_POWER)
    aureole, about = np.float32(1.0 / AUREOLE**2), np.float32(AUREOLE_POWER)
    wide, glare = np.float32(1.0 / GLARE**2), share * np.float32(GLARE_POWER)
    red, green, blue = colour[0], colour[1], colour[2]
    t0, t1, t2 = toward[0], toward[1], toward[2]
    for row in range(view.top, view.height):
        v = np.float32(row + 0.5 - view.cy) * per
        depths, pixels = inverse[row], out[row]
        for x in range(pixels.size):
            u = (np.float32(x) + middle) * per
            square = _TWO - _TWO * (u * t0 + v * t1 + t2) / np.sqrt(u * u + v * v + _ONE)
            inside = _TWO - square * disc
            inside = inside if inside > _ZERO else _ZERO
            inside = inside if inside < _ONE else _ONE
            beside = about / (_ONE + square * aureole)
            sky = beside + power * inside if depths[x] <= _ZERO else _ZERO
            more = sky + glare / (_ONE + square * wide)
            r, g, b = unpack(pixels[x])
            r, g, b = r * _BYTE, g * _BYTE, b * _BYTE
            r, g, b = r * r + more * red, g * g + more * green, b * b + more * blue
            r, g, b = (
                (r if r < _ONE else _ONE),
                (g if g < _ONE else _ONE),
                (b if b < _ONE else _ONE),
            )
            pixels[x] = pack(np.sqrt(r) * _WHITE, np.sqrt(g) * _WHITE, np.sqrt(b) * _WHITE)
