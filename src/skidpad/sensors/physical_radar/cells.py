"""Resolution cells of a radar: sums of echoes by range, Doppler and beam, and what stands out of them.

Only cells that an echo reaches are kept, in a hash table of preallocated arrays. An echo spreads over
three cells each way: in range and Doppler as a Hann window spreads it, across as a Gaussian beam does.
Cell averaging CFAR with 16 cells in range: threshold N (P_fa^(-1/N) - 1) times their mean (Richards,
Fundamentals of Radar Signal Processing, eq. 6.135). Noise of a cell is complex Gaussian with power 1.
"""

from __future__ import annotations

from math import exp, log, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.kernels.splitmix import GOLDEN
from skidpad.sensors.noise import uniform

BITS = 14
SLOTS = 1 << BITS  # of the table; fewer than half may be taken
MOST = SLOTS // 2
RANGES, SPEEDS = 1 << 11, 1 << 12  # numbers of bins that a cell's number has room for
GUARD, TRAIN = 2, 8  # cells on each side of the tested one: left out, averaged
AVERAGED = 2 * TRAIN
EMPTY = -1
WEAK = 0.1  # an echo below this share of the noise is left out
SLACK = 0.3  # share of the threshold below which a cell cannot pass, but for 2 in 100 000 means


class Cells(NamedTuple):
    """Cells that were reached in a tick."""

    number: Ints  # (SLOTS,) of the cell, EMPTY: free
    re: Floats  # (SLOTS,) sum of the echoes' amplitudes
    im: Floats
    power: Floats  # (SLOTS,) with noise
    weight: Floats  # (SLOTS,) sum of the echoes' powers
    rise: Floats  # (SLOTS,) sum of power times elevation, rad
    taken: Ints  # (MOST,) slots in use
    reached: Ints  # (1,) how many
    own: Floats  # (3,) velocity of the antenna in its axes in m/s, yaw rate in rad/s


class Grid(NamedTuple):
    """Sizes of a radar's cells, and its threshold over the mean of its neighbours."""

    range_step: float  # m
    speed_step: float  # m/s
    beam_step: float  # rad
    ranges: int
    beams: int
    threshold: float


def make_cells() -> Cells:
    """Returns cells of which none was reached."""
    re, im, power, weight, rise = np.zeros((5, SLOTS))
    return Cells(
        np.full(SLOTS, EMPTY), re, im, power, weight, rise, np.zeros(MOST, np.int64),
        np.zeros(1, np.int64), np.zeros(3),
    )  # fmt: skip


def cfar_threshold(false_alarms: float) -> float:
    """Returns the threshold over the mean of the averaged cells for a probability of false alarms."""
    return float(AVERAGED * (false_alarms ** (-1.0 / AVERAGED) - 1.0))


def snr_for(detected: float, false_alarms: float) -> float:
    """Returns the mean SNR at which a Swerling 1 target is found with a probability.

    IEEE AES-14 (1978), 44, its abstract: ((P_D / P_FA)^(1/M) - 1) / (1 - P_D^(1/M)).
    """
    power = 1.0 / AVERAGED
    return float(((detected / false_alarms) ** power - 1.0) / (1.0 - detected**power))


@inner_kernel
def cell_number(distance: int, speed: int, beam: int) -> int:
    """The number of a cell; range runs fastest."""
    return (beam * SPEEDS + speed + SPEEDS // 2) * RANGES + distance


@inner_kernel
def find_slot(numbers: Ints, number: int) -> int:
    """The slot of a cell, or the free one where it would go.

    Functions that are called for each cell take the arrays they need: to hand all on costs more.
    """
    at = np.int64((np.uint64(number) * GOLDEN) >> np.uint64(64 - BITS))
    while numbers[at] != EMPTY and numbers[at] != number:
        at = (at + 1) & (SLOTS - 1)
    return int(at)


@inner_kernel
def clear(cells: Cells) -> None:
    """Forget the cells that were reached before."""
    for k in range(cells.reached[0]):
        slot = cells.taken[k]
        cells.number[slot] = EMPTY
    cells.reached[0] = 0


@inner_kernel
def hann(offset: float) -> float:
    """Amplitude in a bin that is `offset` bins from an echo."""
    d = abs(offset)
    if d < 1e-6:
        return 1.0
    if abs(d - 1.0) < 1e-6:
        return 0.5
    return sin(pi * d) / (pi * d * (1.0 - d * d))


@inner_kernel
def add_echo(
    cells: Cells, grid: Grid, at: tuple[float, float, float], snr: float, phase: float, rise: float
) -> None:
    """Add an echo; at: range, Doppler and beam in bins; rise: its elevation in rad."""
    r0, v0, b0 = round(at[0]), round(at[1]), round(at[2])
    amplitude = sqrt(snr)
    c, s = np.cos(phase), np.sin(phase)
    in_range = (hann(r0 - 1 - at[0]), hann(r0 - at[0]), hann(r0 + 1 - at[0]))
    in_speed = (hann(v0 - 1 - at[1]), hann(v0 - at[1]), hann(v0 + 1 - at[1]))
    for b in range(max(b0 - 1, 0), min(b0 + 2, grid.beams)):
        beam = amplitude * exp(-2.0 * log(2.0) * (b - at[2]) ** 2)
        for v in range(max(v0 - 1, 1 - SPEEDS // 2), min(v0 + 2, SPEEDS // 2)):
            row = beam * in_speed[v - v0 + 1]
            if row * row < WEAK:
                continue
            for r in range(max(r0 - 1, 1), min(r0 + 2, grid.ranges)):
                value = row * in_range[r - r0 + 1]
                if value * value < WEAK:
                    continue
                number = cell_number(r, v, b)
                slot = find_slot(cells.number, number)
                if cells.number[slot] == EMPTY:
                    if cells.reached[0] == MOST:
                        continue
                    cells.number[slot] = number
                    cells.taken[cells.reached[0]] = slot
                    cells.reached[0] += 1
                    cells.re[slot] = cells.im[slot] = 0.0
                    cells.weight[slot] = cells.rise[slot] = 0.0
                cells.re[slot] += value * c
                cells.im[slot] += value * s
                cells.weight[slot] += value * value
                cells.rise[slot] += value * value * rise


@inner_kernel
def normal_pair(key: np.uint64, tick: int, index: int) -> tuple[float, float]:
    """Two independent numbers of the standard normal distribution."""
    radius = sqrt(-2.0 * log(1.0 - uniform(key, tick, 2 * index)))
    angle = 2.0 * pi * uniform(key, tick, 2 * index + 1)
    return radius * np.cos(angle), radius * np.sin(angle)


@inner_kernel
def power_at(numbers: Ints, powers: Floats, number: int) -> float:
    """Power of a cell that was reached, else 0."""
    slot = find_slot(numbers, number)
    return float(powers[slot]) if numbers[slot] == number else 0.0


@inner_kernel
def is_peak(numbers: Ints, powers: Floats, slot: int) -> bool:
    """Whether no neighbour of a cell is stronger."""
    number, power = numbers[slot], powers[slot]
    for step in (
        1,
        RANGES,
        SPEEDS * RANGES,
    ):  # beside it first: that is where it mostly is stronger
        above = power_at(numbers, powers, number + step)
        if above > power or power_at(numbers, powers, number - step) > power:
            return False
    for db in range(-1, 2):
        for dv in range(-1, 2):
            for dr in range(-1, 2):
                other = number + (db * SPEEDS + dv) * RANGES + dr
                if abs(db) + abs(dv) + abs(dr) > 1 and power_at(numbers, powers, other) > power:
                    return False
    return True


@inner_kernel
def noise_mean(
    numbers: Ints,
    powers: Floats,
    ranges: int,
    number: int,
    clutter: float,
    key: np.uint64,
    tick: int,
) -> float:
    """Mean power of the cells beside one in range; those that no echo reached hold noise and clutter.

    The sum of k exponential numbers is drawn as Wilson and Hilferty approximate it.
    """
    distance = number % RANGES
    total, free = 0.0, 0
    for side in (-1, 1):
        for k in range(GUARD + 1, GUARD + TRAIN + 1):
            r = distance + side * k
            power = 0.0
            if 0 < r < ranges:
                power = power_at(numbers, powers, number + side * k)
            if power > 0.0:
                total += power
            else:
                free += 1
    if free > 0:
        z, _ = normal_pair(key, tick, number)
        root = 1.0 - 1.0 / (9.0 * free) + z / (3.0 * sqrt(float(free)))
        total += (1.0 + clutter) * free * max(root, 0.0) ** 3
    return total / AVERAGED


@inner_kernel
def centre(numbers: Ints, powers: Floats, number: int, step: int) -> float:
    """Offset in bins of the middle of power over a cell and its two neighbours in one direction."""
    low, high = (
        power_at(numbers, powers, number - step), power_at(numbers, powers, number + step),
    )  # fmt: skip
    return (high - low) / max(low + power_at(numbers, powers, number) + high, 1e-300)
