"""Resolution cells of a radar: sums of echoes by range, Doppler and beam, and what stands out of them.

Only cells that an echo reaches are kept, in preallocated arrays behind a hash table. An echo spreads over
three cells each way: in range and Doppler as a Hann window spreads it, across as a Gaussian beam does.
Cell averaging CFAR with 16 cells in range: threshold N (P_fa^(-1/N) - 1) times their mean (Richards,
Fundamentals of Radar Signal Processing, eq. 6.135). Noise of a cell is complex Gaussian with power 1.
"""

from __future__ import annotations

from math import exp, log, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.kernels.splitmix import GOLDEN
from skidpad.sensors.noise import uniform

BITS = 14
SLOTS = 1 << BITS  # of the table; at most half may be taken
MOST = SLOTS // 2
RANGES, SPEEDS = 1 << 11, 1 << 12  # numbers of bins that a cell's number has room for
GUARD, TRAIN = 2, 8  # cells on each side of the tested one: left out, averaged
AVERAGED = 2 * TRAIN
EMPTY = -1
UNKNOWN = -1.0
RAIN_SPREAD = 1.0  # m/s, of the drops' Doppler to each side: an assumption
WEAK = 0.1  # an echo below this share of the noise is left out
FAINT = 0.999 * WEAK  # no cell of such an echo is reached
MORE = 1.0 + 1e-9  # of a bound, so that rounding leaves no cell out
SLACK = 0.3  # share of the threshold below which a cell cannot pass, but for 2 in 100 000 means


class Scratch(NamedTuple):
    """Arrays that one tick writes for itself: a kernel that allocates nothing counts no references."""

    origin: Floats  # (3,) m, of the antenna
    rotation: Floats  # (3, 3) of the antenna
    actor: Ints  # (n,) rows of the actors near
    screen: Floats  # (7, n) where they stand; `Screens`
    walls: Ints  # walls in view
    mirrors: Ints  # mirrors in view
    aims: Floats  # (beams, 3) as in `Noise`


class Cells(NamedTuple):
    """Cells that were reached in a tick, in the order in which they were."""

    place: NDArray[np.int16]  # (SLOTS,) where a cell stands in the arrays below; EMPTY: free
    number: Ints  # (MOST,) of the cell
    middle: (
        Ints  # (MOST,) number of the cell in the middle of its strongest echo; it or a neighbour
    )
    re: Floats  # (MOST,) sum of the echoes' amplitudes
    im: Floats
    power: Floats  # (MOST,) with noise; UNKNOWN until it is asked for
    most: Floats  # (MOST,) bounds of the amplitude with noise
    fewest: Floats
    weight: Floats  # (MOST,) sum of the echoes' powers
    rise: Floats  # (MOST,) sum of power times elevation, rad
    reached: Ints  # (1,) how many
    own: Floats  # (3,) velocity of the antenna in its axes in m/s, yaw rate in rad/s


class Noise(NamedTuple):
    """What raises the power of the cells of a tick beside their echoes."""

    key: np.uint64
    tick: int
    speed_step: float  # m/s
    aims: (
        Floats  # (beams, 3) the antenna's speed along each beam in two parts, share of clutter left
    )
    ground: Floats  # (ranges,) clutter over noise in the Doppler cell of what stands
    rain: Floats  # (ranges,) in each Doppler cell of the drops


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
    re, im, power, most, fewest, weight, rise = np.zeros((7, MOST))
    return Cells(
        np.full(SLOTS, EMPTY, np.int16), np.zeros(MOST, np.int64), np.zeros(MOST, np.int64), re, im,
        power, most, fewest, weight, rise, np.zeros(1, np.int64), np.zeros(3),
    )  # fmt: skip


def make_scratch(actors: int, walls: int, mirrors: int, beams: int) -> Scratch:
    """Returns room for a tick with as many of each."""
    return Scratch(
        np.zeros(3), np.zeros((3, 3)), np.zeros(actors, np.int64), np.zeros((7, actors)),
        np.zeros(walls, np.int64), np.zeros(mirrors, np.int64), np.zeros((beams, 3)),
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
def bins_of(number: int) -> tuple[int, int, int]:
    """Returns range, Doppler and beam of a cell."""
    rest = number // RANGES
    return number % RANGES, rest % SPEEDS - SPEEDS // 2, rest // SPEEDS


@inner_kernel
def find_slot(cells: Cells, number: int) -> int:
    """The slot of a cell, or the free one where it would go."""
    at = np.int64((np.uint64(number) * GOLDEN) >> np.uint64(64 - BITS))
    while cells.place[at] != EMPTY and cells.number[cells.place[at]] != number:
        at = (at + 1) & (SLOTS - 1)
    return int(at)


@inner_kernel
def clear(cells: Cells) -> None:
    """Forget the cells that were reached before."""
    cells.place[:] = EMPTY
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
    if snr < FAINT:
        return
    r0, v0, b0 = round(at[0]), round(at[1]), round(at[2])
    amplitude = sqrt(snr)
    c, s, middle = np.cos(phase), np.sin(phase), cell_number(r0, v0, b0)
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
                slot = find_slot(cells, number)
                k = np.int64(cells.place[slot])
                if k == EMPTY:
                    k = cells.reached[0]
                    if k == MOST:
                        continue
                    cells.place[slot], cells.number[k] = k, number
                    cells.reached[0] += 1
                    cells.re[k] = cells.im[k] = 0.0
                    cells.weight[k] = cells.rise[k] = 0.0
                    cells.power[k] = UNKNOWN
                if value * value > cells.weight[k]:
                    cells.middle[k] = middle
                cells.re[k] += value * c
                cells.im[k] += value * s
                cells.weight[k] += value * value
                cells.rise[k] += value * value * rise


@inner_kernel
def normal_pair(key: np.uint64, tick: int, index: int) -> tuple[float, float]:
    """Two independent numbers of the standard normal distribution."""
    radius = sqrt(-2.0 * log(1.0 - uniform(key, tick, 2 * index)))
    angle = 2.0 * pi * uniform(key, tick, 2 * index + 1)
    return radius * np.cos(angle), radius * np.sin(angle)


@inner_kernel
def clutter_at(noise: Noise, number: int) -> float:
    """Clutter over noise in a cell: ground where what stands has this Doppler, rain around it."""
    distance, speed, beam = bins_of(number)
    off = abs(speed * noise.speed_step + noise.aims[beam, 0] + noise.aims[beam, 1])
    power = 0.0
    if off <= noise.speed_step:
        power += noise.ground[distance]
    if off <= RAIN_SPREAD:
        power += noise.rain[distance]
    return float(power * noise.aims[beam, 2])


@inner_kernel
def power_of(cells: Cells, noise: Noise, k: int) -> float:
    """Power of the cell at k with noise and clutter, which are drawn when it is first asked for."""
    if cells.power[k] == UNKNOWN:
        number = cells.number[k]
        z, w = normal_pair(noise.key, noise.tick, number)
        rms = sqrt(0.5 * (1.0 + clutter_at(noise, number)))
        re, im = cells.re[k] + rms * z, cells.im[k] + rms * w
        cells.power[k] = re * re + im * im
    return float(cells.power[k])


@inner_kernel
def bound_powers(cells: Cells, noise: Noise) -> None:
    """Write between which amplitudes that of each cell lies with its noise, which is not drawn.

    The noise of `power_of` is r long with r^2 = -2 rms^2 log(1 - u), and -log(1 - u) <= u / sqrt(1 - u).
    """
    for k in range(cells.reached[0]):
        number, re, im = cells.number[k], cells.re[k], cells.im[k]
        u = uniform(noise.key, noise.tick, 2 * number)
        own = sqrt(re * re + im * im)
        spread = sqrt(MORE * (1.0 + clutter_at(noise, number)) * u / sqrt(1.0 - u))
        cells.most[k], cells.fewest[k] = own + spread, own - spread


@inner_kernel
def is_minor(cells: Cells, k: int, least: float) -> bool:
    """Whether the cell at k surely is weaker than `least`, or than the middle of its strongest echo.

    Most cells are: no noise need be drawn for them.
    """
    if cells.most[k] * cells.most[k] < least:
        return True
    at = np.int64(cells.place[find_slot(cells, cells.middle[k])])
    return bool(at != EMPTY and cells.fewest[at] > cells.most[k])


@inner_kernel
def power_at(cells: Cells, noise: Noise, number: int) -> float:
    """Power of a cell that was reached, else 0."""
    k = np.int64(cells.place[find_slot(cells, number)])
    return power_of(cells, noise, k) if k != EMPTY else 0.0


@inner_kernel
def is_stronger(cells: Cells, noise: Noise, number: int, power: float) -> bool:
    """Whether a cell was reached and has more than `power`."""
    k = np.int64(cells.place[find_slot(cells, number)])
    if k == EMPTY:
        return False
    if cells.most[k] * cells.most[k] < power:
        return False
    return power_of(cells, noise, k) > power


@inner_kernel
def is_peak(cells: Cells, noise: Noise, k: int) -> bool:
    """Whether no neighbour of the cell at k is stronger."""
    number, power = cells.number[k], power_of(cells, noise, k)
    for db in range(-1, 2):
        for dv in range(-1, 2):
            for dr in range(-1, 2):
                other = number + (db * SPEEDS + dv) * RANGES + dr
                if other != number and is_stronger(cells, noise, other, power):
                    return False
    return True


@inner_kernel
def noise_mean(
    cells: Cells, noise: Noise, ranges: int, number: int, clutter: float, key: np.uint64
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
                power = power_at(cells, noise, number + side * k)
            if power > 0.0:
                total += power
            else:
                free += 1
    if free > 0:
        z, _ = normal_pair(key, noise.tick, number)
        root = 1.0 - 1.0 / (9.0 * free) + z / (3.0 * sqrt(float(free)))
        total += (1.0 + clutter) * free * max(root, 0.0) ** 3
    return total / AVERAGED


@inner_kernel
def centre(cells: Cells, noise: Noise, number: int, step: int) -> float:
    """Offset in bins of the middle of power over a cell and its two neighbours in one direction."""
    low = power_at(cells, noise, number - step)
    high = power_at(cells, noise, number + step)
    return (high - low) / max(low + power_at(cells, noise, number) + high, 1e-300)
