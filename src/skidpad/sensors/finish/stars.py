"""Stars in the clear night sky of a picture for people: at fixed places drawn by seed, of no catalogue."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.randomness import stream
from skidpad.core.weather import Weather
from skidpad.sensors.finish.glow import add_light
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.raster.view import View

COUNT = 1400  # above the horizon; some 2000 are bright enough for the eye in a dark place
LOWEST = 0.05  # of a star's climb: those below drown in haze
BRIGHTEST = 1.0  # light of the brightest, by eye
LEAST = 0.02  # of starlight, below which none is drawn
DUSK = -6.0  # deg of sun at the end of civil twilight, when the first stars are seen
DARK = -12.0  # and of nautical twilight
# light of the lamps of towns in the night sky, by eye; 1 is a white surface at noon
GLOW_AT_HORIZON = np.array([0.042, 0.033, 0.027], dtype=np.float32)
GLOW_OVERHEAD = np.array([0.003, 0.003, 0.005], dtype=np.float32)


def _scatter() -> Floats:
    """Returns (COUNT, 4) directions, evenly over the sky, and light: few are bright."""
    rng = stream(0, "stars")
    up = rng.uniform(LOWEST, 1.0, COUNT)
    turn = rng.uniform(0.0, 2.0 * np.pi, COUNT)
    flat = np.sqrt(1.0 - up * up)
    # each magnitude has three times as many stars as the brighter one, and 0.4 of its light
    light = np.maximum(BRIGHTEST * rng.uniform(0.0, 1.0, COUNT) ** 4.0, 0.04)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), up, light], axis=1)


STARS = _scatter()


def light_night(light: Lighting) -> Lighting:
    """Returns the light of a weather with the glow of towns in its night sky, brightest at the horizon."""
    return light._replace(
        horizon=light.horizon + np.float32(light.lamps) * GLOW_AT_HORIZON,
        zenith=light.zenith + np.float32(light.lamps) * GLOW_OVERHEAD,
    )


def starlight_of(weather: Weather) -> float:
    """Returns the share of the stars' light that is seen: at night, between clouds that bring no rain."""
    dark = float(np.clip((weather.sun_altitude_deg - DUSK) / (DARK - DUSK), 0.0, 1.0))
    share = dark * max(1.0 - weather.cloudiness / 60.0, 0.0)
    return share if share > LEAST and weather.precipitation == 0.0 else 0.0


@kernel
def draw_stars(
    view: View, stars: Floats, share: float, inverse: NDArray[np.float32], out: NDArray[np.uint32]
) -> None:
    """Adds the stars to the sky in the rows of a view's picture `out`, `share` of their light."""
    r = view.rotation
    for i in range(stars.shape[0]):
        x, y, z = stars[i, 0], stars[i, 1], stars[i, 2]
        depth = r[2, 0] * x + r[2, 1] * y + r[2, 2] * z
        if depth < 0.05:
            continue
        u = view.cx + view.focal * (r[0, 0] * x + r[0, 1] * y + r[0, 2] * z) / depth
        v = view.cy + view.focal * (r[1, 0] * x + r[1, 1] * y + r[1, 2] * z) / depth
        if u < 0.0 or u >= view.width or v < view.top or v >= view.height:
            continue
        row, column = int(v), int(u)
        if inverse[row, column] <= 0.0:
            lit = share * stars[i, 3]
            out[row, column] = add_light(out[row, column], lit, lit, lit)
