"""Spray behind vehicles: how much water hangs in the air, by the film on the road and the speed.

Every tyre track throws its film up, and a share of it that grows with speed stays in the air as drops (mass
balance). They fill the wake behind the body and fall out of it. The extinction of drops of one size is that
of rain drops, twice their cross section. Numbers are assumptions: tracks of 0.115 of the body's width each
(the tyres of `vehicles.yaml` have 0.10 to 0.15), the shares, a wake half a metre wider than the body on
each side and as high as it but 2.5 m at most, drops of 0.2 mm that hang for a second. No table of densities
by film and speed was found in a public text; compared with: a chart of Virginia Tech and TRL for lorries in
rain of one inch per hour, whose axis ends at 0.030 kg/m^3 (scribd 353892870, "Splash & Spray Density").
Valid: films to 2 mm above the texture, 40 to 130 km/h. Wind moves no spray; a wheel behind another throws
what that one leaves, which is in the shares.
"""

from __future__ import annotations

from skidpad.core.kernels.jit import kernel

TRACK = 0.115  # of the body's width, one tyre
V_FIRST, V_FULL, SHARE_FULL = (
    11.0,
    36.0,
    0.3,
)  # m/s at which spray begins, and is that share of the water
ASIDE, HIGHEST = 0.5, 2.5  # m, of the wake
HANGS = 1.0  # s
DROP = 2.0e-4  # m, diameter
WATER = 1000.0  # kg/m^3
FILM_MAX = 0.002  # m, deeper counts as this


@kernel
def spray_density(film: float, speed: float, width: float, height: float) -> float:
    """Returns the water in kg/m^3 just behind a body of this width and height in m; 0 up to V_FIRST.

    film: m of water on the road, FILM_MAX at most; speed: m/s.
    """
    share = SHARE_FULL * min(max((speed - V_FIRST) / (V_FULL - V_FIRST), 0.0), 1.0)
    thrown = 2.0 * TRACK * width * WATER * min(max(film, 0.0), FILM_MAX)  # kg per m of road
    return share * thrown / ((width + 2.0 * ASIDE) * min(height, HIGHEST))


@kernel
def spray_extinction(density: float) -> float:
    """Returns the extinction in 1/m of drops of `density` kg/m^3 together: 2 pi/4 D^2 of each."""
    return 3.0 * density / (WATER * DROP)
