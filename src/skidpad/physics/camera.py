"""What weather and light do to a camera's picture, as numbers: exposure, glare, contrast, water, motion blur.

Exposure: EV100 = log2(100 N^2 / (t S)), and a sensor saturates at 1.2 2^EV100 cd/m^2 (ISO 12232, read in
documentation of Filament's camera model). Glare: 10 E / theta^2, the Stiles-Holladay law; its domain of 1 to
30 degrees is that of CIE 146:2002 (abstract), its factor 10 is the eye's, could not be read there and is
an assumption for a lens. Contrast: Koschmieder, as in `optics`. Drops: all that a moving glass sweeps
up stay where they hit until a wiper passes, each as a half sphere of its own volume; those that hit at
random cover 1 - exp(-area) of the glass (Poisson). Film: that of `radio`, which runs down by its weight.
Motion blur: the motion field of a pinhole camera, f (Z V - V_z P) / Z^2, over the time of exposure.
What could not be compared with measurements, which is all but exposure, is an assumption.
"""

from __future__ import annotations

from math import exp, hypot, log2

import numpy as np

from skidpad.core.errors import require_range
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.weather import Weather
from skidpad.physics.droplets import drop_extinction, rain_drops
from skidpad.physics.optics import transmission
from skidpad.physics.radio import radome_film
from skidpad.physics.spray import spray_extinction

SATURATION = 1.2  # cd/m^2 at EV100 0
GLARE = 10.0  # degrees squared per sr: of the eye, an assumption for a lens
GLARE_FROM, GLARE_TO = 1.0, 30.0  # deg
SPREAD = 2.0 ** (1.0 / 3.0)  # diameter of a half sphere over that of a sphere of its volume
ONE, HALF, SIXTH, SIXTEENTH = (np.float32(x) for x in (1.0, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 16.0))
NO_LIGHT = np.float32(60.0)  # nepers, of which no step of a byte is left
LENS_HEIGHT = 0.03  # m, of the glass before a lens: an assumption


def exposure_value(f_number: float, time: float, iso: float) -> float:
    """Returns EV100 of an aperture, a time of exposure in s and a sensitivity."""
    return log2(100.0 * f_number * f_number / (time * iso))


def saturation_luminance(ev100: float) -> float:
    """Returns the luminance in cd/m^2 from which on a picture is white."""
    return float(SATURATION * 2.0**ev100)


def exposed_share(luminance: float, ev100: float) -> float:
    """Returns the linear value of a pixel, 0 to 1, of a surface of `luminance` cd/m^2."""
    return min(max(luminance / saturation_luminance(ev100), 0.0), 1.0)


def veiling_luminance(illuminance: float, angle_deg: float) -> float:
    """Returns the luminance in cd/m^2 that a light adds to a picture's point.

    Args:
        illuminance: of the light at the lens, lux.
        angle_deg: between the light and the point, 1 to 30.

    Raises:
        ConfigError: the angle is outside the law's domain.
    """
    require_range("angle_deg", angle_deg, GLARE_FROM, GLARE_TO)
    return GLARE * illuminance / (angle_deg * angle_deg)


def contrast_at(contrast: float, weather: Weather, distance: float) -> float:
    """Returns the contrast of an object against its background, seen through `distance` m of air."""
    return contrast * transmission(weather, distance)


@inner_kernel
def share_left(depth: np.float32, curved: np.float32) -> np.float32:
    """Returns the share of light left behind an optical depth, for pictures: no call, so loops vectorise.

    curved: 1 for exp(-depth), to 1e-4; 0 for the law of the published pictures, (1 + depth / 16)^-16,
    which lets up to 0.017 more through. Beyond NO_LIGHT nothing counts: numbers would get too small for
    a processor to be quick with them.
    """
    part = (depth if depth < NO_LIGHT else NO_LIGHT) * SIXTEENTH
    more = curved * part * (HALF + SIXTH * part)
    left: np.float32 = ONE / (ONE + part * (ONE + more))
    left *= left
    left *= left
    left *= left
    left *= left
    return left


def veiled_contrast(contrast: float, background: float, veil: float) -> float:
    """Returns a contrast after a veil of light is added to object and background; cd/m^2."""
    return contrast * background / (background + veil)


def wetted_share(rain_mm_h: float, speed: float, seconds: float) -> float:
    """Returns the share of an upright glass under drops, `seconds` after a wiper passed; speed: m/s."""
    section = 0.5 * drop_extinction(rain_drops(rain_mm_h))  # 1/m, of the drops in a volume
    return 1.0 - exp(-section * SPREAD * SPREAD * max(speed, 0.0) * seconds)


def lens_film(rain_mm_h: float, speed: float) -> float:
    """Returns the mean depth in m of the film that runs down the glass before a lens; speed: m/s."""
    return radome_film(rain_mm_h, speed, LENS_HEIGHT)


def spray_transmission(density: float, depth: float) -> float:
    """Returns the share of light left behind `depth` m of spray of `density` kg/m^3."""
    return exp(-spray_extinction(density) * depth)


def motion_blur(
    focal: float,
    time: float,
    point: tuple[float, float, float],
    velocity: tuple[float, float, float],
) -> float:
    """Returns how far a point moves in a picture while it is exposed, in the unit of `focal`.

    Args:
        focal: focal length, px.
        time: of exposure, s.
        point: m, right, down and forward of the camera.
        velocity: m/s of the point seen from the camera, in the same axes.
    """
    x, y, z = point
    u = focal * (z * velocity[0] - velocity[2] * x) / (z * z)
    v = focal * (z * velocity[1] - velocity[2] * y) / (z * z)
    return hypot(u, v) * time
