"""What comes back of a lidar's beams through rain, fog and snow: lost, false and weak returns.

Powers are in units of a white surface at 1 m in clear air. A surface returns rho exp(-2 tau) / R^2;
below 0.9 / range^2 nothing is noticed (LISA, Kilic et al. 2021). Of all that a beam meets the
strongest counts:

* the surface;
* the strongest drop in the beam. LISA draws all drops, thousands for every beam; here the number of
  drops stronger than p is Poisson with the mean that their spectrum gives, so one random number
  yields the strongest and a second one its distance. The tests compare both ways.
* fog: the pulse is a sine square of 20 ns, the response its greatest overlap with the backscatter
  beyond the distance where receiver and beam meet (Hahner et al. 2021).

Valid where drops in a beam are met one by one: 0.5 to 100 mm/h, fog down to 20 m of sight.
"""

from __future__ import annotations

from math import exp, inf, log, log1p, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import beta, norm

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.kernels.splitmix import GOLDEN, scrambled, unit
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.droplets import SMALLEST_MM, Drops
from skidpad.physics.optics import LidarAir
from skidpad.physics.wetted import wet_ground
from skidpad.sensors.ranging.clouds import Sprayed, no_spray

WHITE = 0.9  # reflectivity that is just noticed at the lidar's range (LISA)
DIVERGENCE = 3e-3  # rad, full angle of the beam (LISA)
NEAREST = 1.5  # m, of a drop that is noticed (LISA)
ACCURACY = 0.09  # m, range noise at a power of half the threshold: accuracy / sqrt(2 SNR) (LISA)
PULSE = 2e-8 * 299_792_458.0  # m, length of a pulse of 20 ns (Hahner et al.)
# m, from and to which receiver and beam come to overlap: the first value is that of Hahner et al.,
# the second the bound that they name for most sensors (their own value is 1 m).
MEETS = (0.9, 10.0)
FOG_SPREAD = 10.0  # m, of a beta distribution: noise of fog's distance (Hahner et al.)
FOG_SHAPE = (2.0, 20.0)
FARTHEST_DROP = 30.0  # m; beyond, a drop returns less than 1e-6 of a white surface at 1 m
GROUND = (
    SemanticClass.ROAD, SemanticClass.SIDEWALK, SemanticClass.TERRAIN, SemanticClass.ROAD_LINE,
    SemanticClass.GROUND, SemanticClass.RAIL_TRACK,
)  # fmt: skip
# Reflectivities, incidence included: assumptions. Ground of a tenth: a lidar of 120 m range sees it
# to 40 m; signs return more than a white surface.
ON_GROUND, SIGN, OTHER = 0.1, 1.0, 0.5
COSINES = 1025  # of the table of wet ground


class BeamAir(NamedTuple):
    """The air of one lidar in one weather, as kernels read it."""

    fog: float  # 1/m
    fog_start: float  # m
    falling: float  # 1/m
    least: float  # power below which nothing is noticed
    fog_distance: float  # m, and power of fog's answer
    fog_power: float
    reflects: Floats  # (256,) by label
    spread: Floats  # (T,) m, quantiles of the noise of fog's distance
    normal: Floats  # (T,) of the standard normal distribution
    drop_share: float  # share of beams with a drop that is noticed
    mean: Floats  # (P,) number of drops in a beam that are stronger than each power, falling
    log_power: Floats  # (P,)
    places: Floats  # (P, R) distribution of the distance of a drop of such power
    r: Floats  # (R,) m
    wet: Floats  # (256, W) share that water leaves of a reflectivity, by label and cosine of incidence


class Returns(NamedTuple):
    """What n beams brought back."""

    distance: Floats  # m; inf: nothing was noticed
    intensity: Floats  # what a surface there would have as reflectivity, times the air's loss
    false: NDArray[np.bool_]  # a drop or fog, no surface


@inner_kernel
def _strongest_drop(m: BeamAir, chance: float, second: float) -> tuple[float, float]:
    """Returns power and distance in m of a beam's strongest drop, of two random numbers in [0, 1).

    chance: below `drop_share`. The mean number of drops stronger than the strongest is exponential:
    -log(1 - chance).
    """
    number = -log1p(-chance)
    low, high = 0, m.mean.size - 1  # mean[low] > number >= mean[high]
    while high - low > 1:
        middle = (low + high) // 2
        if m.mean[middle] > number:
            low = middle
        else:
            high = middle
    part = (m.mean[low] - number) / max(m.mean[low] - m.mean[high], 1e-300)
    power = exp(m.log_power[low] + min(part, 1.0) * (m.log_power[high] - m.log_power[low]))
    row = m.places[low]
    at = min(int(np.searchsorted(row, second)), m.r.size - 1)
    return power, m.r[at]


@kernel
def find_returns(
    m: BeamAir,
    distance: Floats,
    label: NDArray[np.int64],
    cosine: Floats,
    window: float,
    key: np.uint64,
    tick: int,
    spray: Sprayed,
) -> Returns:
    """Returns what beams bring back. distance: (n,) m of the surface in the way, inf: none.

    label, cosine: (n,) of the surfaces, of incidence. window: share of power left behind it. One loop: a
    call per beam that is handed the air's arrays would cost more than all the rest.
    """
    n, sprayed = distance.size, spray.depth.size > 0
    least, wettable = m.least / window, m.wet.shape[1] - 1
    out, strengths, false = np.empty(n), np.empty(n), np.zeros(n, np.bool_)
    start = scrambled(key + np.uint64(tick) * GOLDEN)  # random bits of a lidar in one tick
    for i in range(n):
        bits = scrambled(start + np.uint64(i) * np.uint64(4) * GOLDEN)  # of a beam; steps of GOLDEN
        power, intensity, found = 0.0, 0.0, distance[i]
        if found < inf:
            depth = m.fog * max(found - m.fog_start, 0.0) + m.falling * found
            if sprayed:
                depth += spray.depth[i]
            intensity = m.reflects[label[i]] * exp(-2.0 * depth)
            if wettable > 0:
                intensity *= m.wet[label[i], int(cosine[i] * wettable + 0.5)]
            power = intensity / (found * found)
        chance = unit(scrambled(bits))
        if chance < m.drop_share:
            strength, where = _strongest_drop(m, chance, unit(scrambled(bits + GOLDEN)))
            if strength > power and where < distance[i]:
                power, found, false[i] = strength, where, True
                intensity = strength * where * where
        if m.fog_power >= least and m.fog_power > power and distance[i] > m.fog_distance:
            at = int(unit(scrambled(bits + np.uint64(2) * GOLDEN)) * m.spread.size)
            power, false[i] = m.fog_power, True
            found = min(m.fog_distance + m.spread[at], distance[i])
            intensity = power * found * found
        if sprayed and spray.power[i] > power:
            power, found, false[i] = spray.power[i], spray.distance[i], True
            intensity = power * found * found
        if power < least:
            found, intensity, false[i] = inf, 0.0, False
        elif not false[i]:
            at = int(unit(scrambled(bits + np.uint64(3) * GOLDEN)) * m.normal.size)
            found += ACCURACY * sqrt(0.5 * least / power) * m.normal[at]
        out[i], strengths[i] = found, intensity * window
    return Returns(out, strengths, false)


@kernel
def lost_depths(
    air: BeamAir, ray: Ints, distance: Floats, label: Ints, least: float, n: int
) -> Floats:
    """Returns the depth of spray at which each of n beams' surfaces is not noticed; -inf: it has none.

    ray, distance, label: of the beams that meet one, m. A little more than what `find_returns` says.
    """
    lost = np.full(n, -np.inf)
    for k in range(ray.size):
        d = distance[k]
        depth = air.fog * max(d - air.fog_start, 0.0) + air.falling * d
        lost[ray[k]] = 0.5 * log(air.reflects[label[k]] / (least * d * d)) - depth + 1e-6
    return lost


def wet_shares(cover: float) -> Floats:
    """Returns what water leaves of reflectivities, as `BeamAir.wet`; (256, 1) where no ground is wet.

    cover: share of the ground under water.
    """
    if cover <= 0.0:
        return np.ones((256, 1))
    table = np.ones((256, COSINES))
    left = wet_ground(ON_GROUND, np.linspace(0.0, 1.0, COSINES))
    table[[int(c) for c in GROUND]] = 1.0 - cover + cover * left
    return table


def reflectivities() -> Floats:
    """Returns the reflectivities (256,) of all classes, by label."""
    table = np.full(256, OTHER)
    table[[int(c) for c in GROUND]] = ON_GROUND
    table[int(SemanticClass.TRAFFIC_SIGN)] = SIGN
    return table


class ReturnModel:
    """The returns of one lidar in one weather."""

    def __init__(self, air: LidarAir, reach: float, cover: float = 0.0) -> None:
        """reach: m at which a white surface is just noticed in clear air. cover: share of wet ground."""
        self.least = WHITE / reach**2
        fog_distance, fog_power = fog_response(air, reach)
        drops, quantiles = DropReturns(air, self.least), (np.arange(1024) + 0.5) / 1024
        self.air = BeamAir(
            air.fog, air.fog_start, air.falling, self.least, fog_distance, fog_power,
            reflectivities(), FOG_SPREAD * beta.ppf(quantiles, *FOG_SHAPE), norm.ppf(quantiles),
            float(-np.expm1(-drops.mean[0])), drops.mean, np.log(drops.powers), drops.places,
            drops.r, wet_shares(cover),
        )  # fmt: skip

    def measure(
        self, distance: Floats, label: NDArray[np.int64], key: int, tick: int = 0
    ) -> Returns:
        """Returns what beams bring back without spray, through a clean window, from dry ground.

        distance: (n,) m of their surfaces, inf: they meet none. label: (n,) of the surfaces.
        The same key and tick give the same returns.
        """
        ones = np.ones(len(distance))
        return find_returns(self.air, distance, label, ones, 1.0, np.uint64(key), tick, no_spray())


def fog_response(air: LidarAir, reach: float) -> tuple[float, float]:
    """Returns distance in m and power of fog's strongest answer to a pulse; power 0 without fog."""
    step = 0.05
    r = np.arange(step, min(reach, 60.0), step)
    low, high = MEETS
    overlap = np.clip((r - low) / (high - low), 0.0, 1.0) * (r >= air.fog_start)
    depth = air.fog * np.maximum(r - air.fog_start, 0.0) + air.falling * r
    returned = overlap * np.exp(-2.0 * depth) / (r * r)
    pulse = np.sin(np.pi * np.arange(0.0, PULSE, step) / PULSE) ** 2
    answer = np.pi * air.backscatter * step * np.convolve(returned, pulse)[: len(r)]
    best = int(answer.argmax())
    return float(r[best]), float(answer[best])


class DropReturns:
    """The strongest drop in a beam, drawn from two random numbers."""

    def __init__(self, air: LidarAir, least: float) -> None:
        """least: power below which nothing is noticed."""
        self.r = np.arange(NEAREST + 0.025, FARTHEST_DROP, 0.05)  # middles of steps
        depth = air.fog * np.maximum(self.r - air.fog_start, 0.0) + air.falling * self.r
        self.most = (
            air.drops.reflectivity * np.exp(-2.0 * depth) / self.r**2
        )  # a drop that fills it
        self.powers = np.geomspace(least, max(float(self.most.max()), least * 1.001), 64)
        self.mean = np.array([self._stronger(air.drops, p).sum() for p in self.powers])
        self.mean *= self.r[1] - self.r[0]
        places = np.array([self._places(air.drops, p) for p in self.powers]).cumsum(axis=1)
        self.places = places / np.maximum(places[:, -1:], 1e-300)

    def _diameter_for(self, power: float) -> Floats:
        """Returns the diameter in mm of a drop at each distance `r` that returns this power."""
        beam = 1e3 * np.tan(DIVERGENCE) * self.r
        return np.asarray(beam * np.sqrt(power / np.maximum(self.most, 1e-300)))

    def _stronger(self, drops: Drops, power: float) -> Floats:
        """Returns the mean number of stronger drops per metre of the beam, at each distance `r`."""
        area = 0.25 * np.pi * (np.tan(DIVERGENCE) * self.r) ** 2
        diameter = np.maximum(self._diameter_for(power), SMALLEST_MM)
        number = drops.density / drops.slope * np.exp(-drops.slope * diameter)
        return np.where(power < self.most, area * number, 0.0)

    def _places(self, drops: Drops, power: float) -> Floats:
        """Returns how likely a drop of just this power is at each distance `r`, unnormalised."""
        diameter = self._diameter_for(power)
        density = self.r**2 * diameter * np.exp(-drops.slope * diameter)
        return np.where((power < self.most) & (diameter > SMALLEST_MM), density, 0.0)
