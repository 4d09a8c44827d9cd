"""Rain, snow and fog as a lidar meets them: how many drops of which size, and what they take and return.

Size spectra are exponential. Rain: Marshall and Palmer (1948), N0 8000 m^-3 mm^-1, slope
4.1 R^-0.21 mm^-1. Snow: Gunn and Marshall (1958), N0 7600 R^-0.87, slope 2.55 R^-0.48, R the water
equivalent in mm/h. Both read in the code of LISA (Kilic et al. 2021, velatkilic/LISA), as are the
reflectivity of a drop and its share of the beam. Fog's backscatter 0.046 / visibility: Hahner et al.
(2021, MartinHahner/LiDAR_fog_sim), after Rasshofer et al. (2011).
Valid: 0.5 to 100 mm/h of rain, 0.2 to 10 mm/h of snow, 905 nm, where a drop is far larger than the
wave and its extinction efficiency is 2.
"""

from __future__ import annotations

from math import pi
from typing import NamedTuple

SMALLEST_MM = 0.05  # of the drops that LISA draws
RAIN_INDEX, ICE_INDEX = 1.328, 1.3031  # of refraction at 905 nm, as in LISA
FOG_BACKSCATTER = 0.046  # 1/sr, over the visibility in m


class Drops(NamedTuple):
    """What falls: number per m^3 and mm of diameter is density exp(-slope D)."""

    density: float = 0.0  # m^-3 mm^-1
    slope: float = 1.0  # 1/mm
    reflectivity: float = 0.0  # of one drop, at normal incidence


def fresnel(index: float) -> float:
    """Returns the share of light that a surface of this index of refraction reflects at normal incidence."""
    return ((index - 1.0) / (index + 1.0)) ** 2


def rain_drops(rate: float) -> Drops:
    """Returns the drops of rain of `rate` mm/h; of density 0 where it does not rain."""
    if rate <= 0.0:
        return Drops()
    return Drops(8000.0, 4.1 * rate**-0.21, fresnel(RAIN_INDEX))


def snow_flakes(rate: float) -> Drops:
    """Returns the flakes of snowfall of `rate` mm/h of water; of density 0 where it does not snow."""
    if rate <= 0.0:
        return Drops()
    return Drops(7.6e3 * rate**-0.87, 2.55 * rate**-0.48, fresnel(ICE_INDEX))


def drop_extinction(drops: Drops) -> float:
    """Returns the extinction in 1/m: the integral of 2 pi/4 D^2 over all drops."""
    return pi * drops.density / drops.slope**3 * 1e-6
