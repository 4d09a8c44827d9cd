"""What walls, rails and roads reflect like mirrors of a radar's wave: shares of power and amplitude.

Smooth surfaces: Fresnel's equations for a wave that stands upright, hence across the plane of incidence at
a wall and in it on a road. Permittivity eta = a f^b - i sigma / (omega epsilon_0), sigma = c f^d, with
f in GHz (ITU-R P.2040, table 3, 1 to 100 GHz, read in `itu.py` of Sionna RT). Roughness takes
exp(-g / 2) of the amplitude, g = (4 pi s sin(grazing angle) / lambda)^2 (Ament's factor, read in public
radar code). Assumptions: the road's permittivity, which RadarSimX's example of a ground at 76.5 GHz has;
all roughness; the share of a guardrail. No measured power of a ghost could be read.
"""

from __future__ import annotations

from cmath import exp, sqrt
from math import exp as real_exp
from math import pi

from skidpad.core.kernels.jit import inner_kernel

LIGHT = 299_792_458.0  # m/s
EPSILON_0 = 8.8541878128e-12  # F/m, CODATA 2018
CONCRETE = (5.24, 0.0462, 0.7822)  # a, c, d of ITU-R P.2040, table 3; b is 0
ROAD = 3.2 - 0.1j  # permittivity: an assumption
RAIL_SHARE = 0.25  # of the power that a rail's corrugated steel sends on: an assumption
WALL_ROUGHNESS, ROAD_ROUGHNESS = 0.5e-3, 1.0e-3  # m, standard deviations: assumptions


def concrete_permittivity(ghz: float) -> complex:
    """Returns the complex permittivity of concrete by ITU-R P.2040; 1 to 100 GHz."""
    a, c, d = CONCRETE
    return complex(a, -c * ghz**d / (2.0 * pi * ghz * 1e9 * EPSILON_0))


@inner_kernel
def fresnel_across(permittivity: complex, sine: float) -> complex:
    """Returns the reflected amplitude of a wave across the plane of incidence; sine: of the grazing angle."""
    root = sqrt(permittivity - 1.0 + sine * sine)
    return (sine - root) / (sine + root)


@inner_kernel
def fresnel_within(permittivity: complex, sine: float) -> complex:
    """Returns the reflected amplitude of a wave in the plane of incidence; sine: of the grazing angle."""
    root = sqrt(permittivity - 1.0 + sine * sine)
    return (permittivity * sine - root) / (permittivity * sine + root)


@inner_kernel
def smooth_share(roughness: float, sine: float, wave_number: float) -> float:
    """Returns the share of the amplitude that a rough surface still mirrors; roughness: m."""
    g = (2.0 * wave_number * roughness * sine) ** 2
    return real_exp(-0.5 * g)


@inner_kernel
def two_ray_gain(near: float, far: float, sine: float, wave_number: float) -> float:
    """Returns the power of an echo over the road, over that of the same echo in free space.

    The wave goes and returns on two ways each, straight and by the road:
    |1 + Gamma exp(-i k (far - near))|^4.

    Args:
        near: m, the straight way.
        far: m, the way by the road's mirror image.
        sine: of the grazing angle on the road.
        wave_number: 2 pi over the wave's length, 1/m.
    """
    mirrored = fresnel_within(ROAD, sine) * smooth_share(ROAD_ROUGHNESS, sine, wave_number)
    total = 1.0 + mirrored * exp(-1j * wave_number * (far - near)) * near / far
    power = total.real * total.real + total.imag * total.imag
    return power * power
