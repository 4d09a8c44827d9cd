"""Water in the way of a radar's wave: what drops take and return, and what a film on the radome takes.

Complex permittivity of water: double Debye model of Liebe, Hufford and Manabe (Int. J. Infrared and
Millimeter Waves 12, 1991, 659), its numbers read in `eps_swd_l91.f90` (Colorado State University,
at721). Drops are spheres (Mie) of the spectrum in `droplets`. A film is a slab of water in air: the
plastic behind it is taken as matched. The film runs down by its weight (Nusselt): q = g d^3 / (3 nu),
and what runs is the rain that the radome sweeps up: assumptions, as is a radome 0.1 m high.
Valid: 1 to 300 GHz, 0.5 to 100 mm/h, drops and films of water; wet snow and ice on the radome are not.
"""

from __future__ import annotations

from functools import cache
from math import log10, pi

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.physics.droplets import rain_drops

LIGHT = 299_792_458.0  # m/s
WATER = 1000.0  # kg/m^3
NU = 1.0e-6  # m^2/s, kinematic viscosity of water at 20 C
GRAVITY = 9.81  # m/s^2
RADOME = 0.1  # m, height of the radome: an assumption
DROPS_MM = (0.05, 8.0)  # diameters that count; larger drops break


def water_permittivity(ghz: float, celsius: float = 10.0) -> complex:
    """Returns the complex relative permittivity of water at a frequency in GHz, absorption positive.

    Source: Liebe et al. 1991.
    """
    theta = 1.0 - 300.0 / (273.15 + celsius)
    low = 77.66 - 103.3 * theta
    middle, high = 0.0671 * low, 3.52 + 7.52 * theta
    first = 20.20 + 146.4 * theta + 316.0 * theta * theta
    second = 39.8 * first
    return low - ghz * (
        (low - middle) / complex(ghz, first) + (middle - high) / complex(ghz, second)
    )


def mie_efficiencies(x: Floats, index: complex) -> tuple[Floats, Floats]:
    """Returns extinction and backscatter efficiencies of spheres, over their sections.

    x: (n,) circumference over wavelength; index: complex index of refraction, absorption positive.
    """
    terms = int(x.max() + 4.05 * x.max() ** (1.0 / 3.0) + 3.0)
    y = index * x
    down = int(max(terms, abs(y).max())) + 16
    ratio = np.zeros((down + 1, x.size), dtype=np.complex128)  # logarithmic derivatives
    for n in range(down, 0, -1):
        ratio[n - 1] = n / y - 1.0 / (ratio[n] + n / y)
    psi0, psi1, chi0, chi1 = np.cos(x), np.sin(x), -np.sin(x), np.cos(x)
    extinct, back = np.zeros(x.size), np.zeros(x.size, dtype=np.complex128)
    for n in range(1, terms + 1):
        psi, chi = (2 * n - 1) * psi1 / x - psi0, (2 * n - 1) * chi1 / x - chi0
        xi, xi1 = psi - 1j * chi, psi1 - 1j * chi1
        one, two = ratio[n] / index + n / x, ratio[n] * index + n / x
        a, b = (one * psi - psi1) / (one * xi - xi1), (two * psi - psi1) / (two * xi - xi1)
        done = n > x + 4.05 * x ** (1.0 / 3.0) + 3.0  # small spheres have fewer terms
        a, b = np.where(done, 0.0, a), np.where(done, 0.0, b)
        extinct += (2 * n + 1) * (a + b).real
        back += (2 * n + 1) * (-1) ** n * (a - b)
        psi0, psi1, chi0, chi1 = psi1, psi, chi1, chi
    return 2.0 * extinct / x**2, abs(back) ** 2 / x**2


@cache
def rain_scatter(rain_mm_h: float, ghz: float) -> tuple[float, float]:
    """Returns attenuation in dB/km one way and radar reflectivity in m^2/m^3 of rain (Mie); 0, 0 without."""
    drops = rain_drops(rain_mm_h)
    size = np.linspace(*DROPS_MM, 400)
    x = pi * size * 1e-3 * ghz * 1e9 / LIGHT
    extinct, back = mie_efficiencies(x, np.sqrt(water_permittivity(ghz)))
    area = drops.density * np.exp(-drops.slope * size) * pi / 4.0 * (size * 1e-3) ** 2  # 1/m/mm
    step = size[1] - size[0]
    return float(4343.0 * (extinct * area).sum() * step), float((back * area).sum() * step)


def film_loss_db(depth: float, ghz: float) -> float:
    """Returns what a film of water takes from a wave in dB, one way; depth: m."""
    index = np.sqrt(water_permittivity(ghz))
    phase = 2.0 * pi * ghz * 1e9 / LIGHT * index * depth
    through = 1.0 / (np.cos(phase) - 0.5j * (index + 1.0 / index) * np.sin(phase))
    return float(-20.0 * log10(abs(through)))


def radome_film(rain_mm_h: float, speed: float, height: float = RADOME) -> float:
    """Returns the mean depth in m of the film on a radome driven through rain at `speed` m/s; 0 at rest."""
    if rain_mm_h <= 0.0 or speed <= 0.0:
        return 0.0
    drops = rain_drops(rain_mm_h)
    content = pi * WATER * 1e-9 * drops.density / drops.slope**4  # kg/m^3 of air
    flow = content / WATER * speed * height  # m^2/s at the lower edge
    return float(0.75 * (3.0 * NU * flow / GRAVITY) ** (1.0 / 3.0))


def wet_radome_db(rain_mm_h: float, speed: float, ghz: float) -> float:
    """Returns the two-way loss in dB of a wet radome driven through rain at a speed in m/s."""
    return 2.0 * film_loss_db(radome_film(rain_mm_h, speed), ghz)
