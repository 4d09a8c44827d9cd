"""Interference of automotive radars: how far a chirp of another radar raises the noise of ours.

A chirp that crosses ours is in the receiver's band for a share of the samples and leaves noise in all cells
(crossing interference; TI SWRA662A, September 2022, 2.3.1 and 2.3.2). Its power over the thermal noise is
    I / N = P G (lambda / (4 pi R))^2 share / (k T B F),
P 10 dBm, G 14 dB of both antennas and F 14 dB as printed there. B is not: 10 MHz give the first row of its
table 2-1, and the rows that were not used are met within 1 dB (docs/radar-interference.csv). Radars that
chirp in step, which leave false targets, are left out: SWRA662A calls them very rare. Valid from 1 m on, in
line of sight.
"""

from __future__ import annotations

from math import pi

from skidpad.physics.mirrors import LIGHT

POWER_DBM, GAIN_DB, NOISE_FIGURE_DB = 10.0, 14.0, 14.0  # SWRA662A, 2.3.2
THERMAL_DBM = -173.98  # of kT in 1 Hz at 290 K
BAND = 1e7  # Hz, of the receiver: fitted, see above
AFFECTED = (
    0.01  # share of samples in which a chirp is in the band; SWRA662A has rows for 0.01 and 0.1
)


def interference_over_noise(distance: float, affected: float, ghz: float) -> float:
    """Returns the power of one radar in ours over the thermal noise.

    Args:
        distance: m between the two, which face each other.
        affected: share of samples in which the other chirp is in the band.
        ghz: frequency.
    """
    spread = LIGHT / (ghz * 1e9) / (4.0 * pi * distance)
    level = 10.0 ** (0.1 * (POWER_DBM + GAIN_DB - NOISE_FIGURE_DB - THERMAL_DBM))
    return float(level * spread * spread * affected / BAND)
