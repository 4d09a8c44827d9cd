"""Water between a lidar and what it measures: on the ground, and as drops on its window.

Ground: flat water over a surface that spreads light evenly. Light enters by Fresnel's equations, is spread,
leaves the same way, and what meets the water from below is thrown back once more:
    rho_wet / rho = T^2 / (n^2 (1 - rho r)),  r = 1 - (1 - R) / n^2,
T for unpolarised light at the angle of incidence, R = 0.066 of evenly spread light. 1 / n^2 is the wider
cone into which light leaves water. The parts are those of the wet ground of Hahner et al. (2022,
SysCV/LiDAR_snow_sim, `phy_equations.py`), which leaves the cone out; the share of ground under water is
theirs: film over 1.2 mm of texture. Window: what dirt or drops cover is lost, on each of both ways. Dirt and
drops are taken as opaque and small beside the beam. No measured loss could be read, so both are
assumptions. Valid: still films to 2 mm, incidence up to 89 degrees.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.physics.camera import wetted_share

INDEX = 1.328  # of water at 905 nm
DIFFUSE = 0.066  # share of evenly spread light that water reflects
TEXTURE_MM = 1.2  # film that covers all of the ground (Hahner et al. 2022: pavement depth)


def water_transmission(cosine: Floats, index: float = INDEX) -> Floats:
    """Returns the share of unpolarised light that enters water, by the cosine of incidence (Fresnel)."""
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / index**2)
    across = (cosine - index * inside) / (cosine + index * inside)
    along = (index * cosine - inside) / (index * cosine + inside)
    transmitted: Floats = 1.0 - 0.5 * (across**2 + along**2)
    return transmitted


def wet_ground(reflectivity: float, cosine: Floats) -> Floats:
    """Returns what water leaves of a ground's reflectivity, by the cosine of incidence."""
    below = 1.0 - (1.0 - DIFFUSE) / INDEX**2  # of light that meets the water from below
    left = water_transmission(cosine) ** 2 / (INDEX**2 * (1.0 - reflectivity * below))
    return np.asarray(left, dtype=np.float64)


def water_cover(film_mm: float) -> float:
    """Returns the share of the ground that a film covers."""
    return min(max(film_mm / TEXTURE_MM, 0.0), 1.0)


def window_loss(dirt: float, rain_mm_h: float, speed: float, stay: float) -> float:
    """Returns the share of power left after both ways through a window.

    Args:
        dirt: share of the window that dirt covers.
        rain_mm_h: of the weather.
        speed: m/s of the sensor.
        stay: s that drops stay.
    """
    clear = (1.0 - dirt) * (1.0 - wetted_share(rain_mm_h, speed, stay))
    return clear * clear
