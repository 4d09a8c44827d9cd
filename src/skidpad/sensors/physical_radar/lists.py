"""Objects instead of cells: detections of one radar that belong together become one row.

Two rows belong together where range, place across and range rate are within the sizes below, and so on
from row to row: assumptions, sized so that the sides of one car join and two lanes do not. An object begins
at its nearest row; angles and rate are means by power. Its section is what the radar equation gives
for the sum of powers without weather: sigma = SNR R^4 / (factor G^2); between the middles of cells an
object loses up to 6 dB of it.
"""

from __future__ import annotations

from math import exp, log

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.physical_radar.setup import RadarSetup

Rows = NDArray[np.float32]

APART, ASIDE, FASTER = 2.7, 1.5, 0.7  # m in range, m across, m/s: assumptions
RANGE, AZIMUTH, ALTITUDE, RATE, POWER, SECTION = range(6)  # columns; power is over the noise


@inner_kernel
def add_sections(radar: RadarSetup, rows: Rows, count: int) -> None:
    """Fill the sections in m^2 that rows have by their power."""
    for k in range(count):
        distance, power = float(rows[k, RANGE]), float(rows[k, POWER])
        off = (rows[k, AZIMUTH] / radar.wide) ** 2 + (rows[k, ALTITUDE] / radar.high) ** 2
        rows[k, SECTION] = power * distance**4 / radar.factor * exp(8.0 * log(2.0) * off)


@inner_kernel
def _is_one(rows: Rows, a: int, b: int) -> bool:
    """Whether two rows may be of one object."""
    if abs(rows[a, RANGE] - rows[b, RANGE]) > APART or abs(rows[a, RATE] - rows[b, RATE]) > FASTER:
        return False
    across = abs(rows[a, AZIMUTH] - rows[b, AZIMUTH]) * min(rows[a, RANGE], rows[b, RANGE])
    return bool(across <= ASIDE)


@inner_kernel
def join_rows(rows: Rows, count: int) -> int:
    """Replace rows by the objects that they form, in the order of their first rows; returns how many."""
    group = np.full(count, -1, np.int64)
    stack = np.empty(count, np.int64)
    n = 0
    for first in range(count):
        if group[first] >= 0:
            continue
        group[first], stack[0], top = n, first, 1
        while top > 0:
            top -= 1
            a = stack[top]
            for b in range(count):
                if group[b] < 0 and _is_one(rows, a, b):
                    group[b], stack[top] = n, b
                    top += 1
        n += 1
    made = np.zeros((n, 6))
    made[:, RANGE] = np.inf
    for k in range(count):
        one, power = made[group[k]], float(rows[k, POWER])
        one[RANGE] = min(one[RANGE], rows[k, RANGE])
        one[POWER] += power
        for column in (AZIMUTH, ALTITUDE, RATE):
            one[column] += power * rows[k, column]
    for g in range(n):
        for column in (AZIMUTH, ALTITUDE, RATE):
            made[g, column] /= made[g, POWER]
        for column in range(6):
            rows[g, column] = made[g, column]
    return n
