"""Kinds of fog as a lidar meets them: extinction and backscatter of drops of two spectra at 905 nm.

Drops: n(r) ~ r^a exp(-b r), r in um (Silverman and Sprague). Heavy advection fog has a 3 and b 0.3, heavy
radiation fog a 6 and b 1.5; moderate ones b 0.375 and 3.0. Read in `fogSD_SS.m` (Z. Yin, 2022); the advection
fogs are those of Rasshofer et al. (2011) in LISA (velatkilic/LISA, `atmos_models.py`, modes of 10 and 8 um).
Ratios are Mie sums over these spectra (`radio.mie_efficiencies`; water 1.333 at 550 nm, 1.328 at 905 nm);
the tests compute them again. Moderate fogs have 18.4 and 17.0 sr. Checked against, not fitted: the lidar
ratio of water drops and the water of a sight (docs/lidar-fog.csv). Valid: sight of 20 m to 1 km.
"""

from __future__ import annotations

from typing import NamedTuple

from skidpad.core.environment.lidar_effects import LidarFog
from skidpad.physics.optics import LidarAir


class FogDrops(NamedTuple):
    """Drops of one kind of fog."""

    shape: float  # a
    slope: float  # b, 1/um
    dims: float  # extinction at 905 nm over that of visible light
    lidar_ratio: float  # sr, extinction over backscatter at 905 nm


FOGS = {
    LidarFog.ADVECTION: FogDrops(3.0, 0.3, 1.011, 18.1),
    LidarFog.RADIATION: FogDrops(6.0, 1.5, 1.025, 19.5),
}


def with_fog(air: LidarAir, kind: LidarFog) -> LidarAir:
    """Returns the air with the drops of a kind of fog and the same sight; FIXED leaves it as it is."""
    if kind is LidarFog.FIXED:
        return air
    drops = FOGS[kind]
    fog = air.fog * drops.dims
    return air._replace(fog=fog, backscatter=fog / drops.lidar_ratio)
