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

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.droplets import SMALLEST_MM, Drops
from skidpad.physics.optics import LidarAir

Floats = NDArray[np.float64]

WHITE = 0.9  # reflectivity that is just noticed at the lidar's range (LISA)
DIVERGENCE = 3e-3  # rad, full angle of the beam (LISA)
NEAREST = 1.5  # m, of a drop that is noticed (LISA)
ACCURACY = 0.09  # m, range noise at a power of half the threshold: accuracy / sqrt(2 SNR) (LISA)
PULSE = 2e-8 * 299_792_458.0  # m, length of a pulse of 20 ns (Hahner et al.)
MEETS = (
    0.9,
    10.0,
)  # m, from and to which receiver and beam come to overlap: the first value is that
# of Hahner et al., the second the bound that they name for most sensors (their own value is 1 m)
FOG_SPREAD, FOG_SHAPE = (
    10.0,
    (2.0, 20.0),
)  # m, of a beta distribution: noise of fog's distance (same)
FARTHEST_DROP = 30.0  # m; beyond, a drop returns less than 1e-6 of a white surface at 1 m
GROUND = (
    SemanticClass.ROAD, SemanticClass.SIDEWALK, SemanticClass.TERRAIN, SemanticClass.ROAD_LINE,
    SemanticClass.GROUND, SemanticClass.RAIL_TRACK,
)  # fmt: skip
# Reflectivities, incidence included: assumptions. Ground of a tenth: a lidar of 120 m range sees it
# to 40 m; signs return more than a white surface.
ON_GROUND, SIGN, OTHER = 0.1, 1.0, 0.5


class Returns(NamedTuple):
    """What n beams brought back."""

    distance: Floats  # m; inf: nothing was noticed
    intensity: Floats  # what a surface there would have as reflectivity, times the air's loss
    false: NDArray[np.bool_]  # a drop or fog, no surface


def reflectivities() -> Floats:
    """Return the reflectivities of all classes, by label."""
    table = np.full(256, OTHER)
    table[[int(c) for c in GROUND]] = ON_GROUND
    table[int(SemanticClass.TRAFFIC_SIGN)] = SIGN
    return table


class ReturnModel:
    """The returns of one lidar in one weather."""

    def __init__(self, air: LidarAir, reach: float) -> None:
        """reach: m at which a white surface is just noticed in clear air."""
        self.air, self.least = air, WHITE / reach**2
        self._fog_distance, self._fog_power = fog_response(air, reach)
        self._drops = DropReturns(air, self.least)
        self._reflects = reflectivities()

    def optical_depth(self, distance: Floats) -> Floats:
        """Return the nepers of one way through the air."""
        through = np.maximum(distance - self.air.fog_start, 0.0)
        return self.air.fog * through + self.air.falling * distance

    def measure(
        self, distance: Floats, label: NDArray[np.int64], rng: np.random.Generator
    ) -> Returns:
        """What beams bring back whose surfaces are so far; inf: they meet none."""
        n, meets = len(distance), np.isfinite(distance)
        there = np.where(meets, distance, 1.0)
        intensity = self._reflects[label] * np.exp(-2.0 * self.optical_depth(there))
        power = np.where(meets, intensity / (there * there), 0.0)
        found, false = np.where(meets, distance, np.inf), np.zeros(n, dtype=np.bool_)
        for at, strength, where in (self._fog(distance, rng), self._drops.draw(distance, rng)):
            wins = strength > power[at]
            at, strength, where = at[wins], strength[wins], where[wins]
            power[at], found[at], false[at] = strength, where, True
            intensity[at] = strength * where * where
        found[power < self.least] = np.inf
        kept = np.flatnonzero(np.isfinite(found) & ~false)
        noise = ACCURACY * np.sqrt(0.5 * self.least / power[kept])
        found[kept] += noise * rng.standard_normal(len(kept))
        return Returns(found, intensity, false)

    def _fog(
        self, distance: Floats, rng: np.random.Generator
    ) -> tuple[NDArray[np.intp], Floats, Floats]:
        """Beams that fog answers: which, how strongly, from where."""
        if self._fog_power < self.least:
            return np.zeros(0, dtype=np.intp), np.zeros(0), np.zeros(0)
        at = np.flatnonzero(distance > self._fog_distance)
        where = self._fog_distance + FOG_SPREAD * rng.beta(*FOG_SHAPE, len(at))
        return at, np.full(len(at), self._fog_power), np.minimum(where, distance[at])


def fog_response(air: LidarAir, reach: float) -> tuple[float, float]:
    """Distance in m and power of fog's strongest answer to a pulse."""
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
        self.r = np.arange(NEAREST, FARTHEST_DROP, 0.05)
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
        """Diameter in mm of a drop at each distance that returns this power."""
        beam = 1e3 * np.tan(DIVERGENCE) * self.r
        return np.asarray(beam * np.sqrt(power / np.maximum(self.most, 1e-300)))

    def _stronger(self, drops: Drops, power: float) -> Floats:
        """Mean number of stronger drops per metre of the beam."""
        area = 0.25 * np.pi * (np.tan(DIVERGENCE) * self.r) ** 2
        diameter = np.maximum(self._diameter_for(power), SMALLEST_MM)
        number = drops.density / drops.slope * np.exp(-drops.slope * diameter)
        return np.where(power < self.most, area * number, 0.0)

    def _places(self, drops: Drops, power: float) -> Floats:
        """Where a drop of just this power is, unnormalised."""
        diameter = self._diameter_for(power)
        density = self.r**2 * diameter * np.exp(-drops.slope * diameter)
        return np.where((power < self.most) & (diameter > SMALLEST_MM), density, 0.0)

    def draw(
        self, distance: Floats, rng: np.random.Generator
    ) -> tuple[NDArray[np.intp], Floats, Floats]:
        """Beams with a drop that is noticed, nearer than their surface: which, its power, its distance."""
        first = rng.standard_exponential(
            len(distance)
        )  # mean of the drops stronger than the strongest
        at = np.flatnonzero(first < self.mean[0])
        power = np.exp(np.interp(first[at], self.mean[::-1], np.log(self.powers[::-1])))
        row = np.searchsorted(self.powers, power, side="right") - 1
        column = (self.places[row] < rng.random(len(at))[:, None]).sum(axis=1)
        where = self.r[np.minimum(column, len(self.r) - 1)]
        near = where < distance[at]
        return at[near], power[near], where[near]
