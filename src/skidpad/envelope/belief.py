"""What is believed of the grip: probabilities over grip and slip stiffness, by Bayes' rule.

No law between stiffness and grip is assumed: both are unknown, and only the bend of the curve tells
them apart. What is known spreads back to the prior with the distance driven, as a surface may have
changed on the way, so "no information" is the prior and never high grip. The curve is the brush
tyre's (Pacejka, Tire and Vehicle Dynamics, chapter 3). Methods that take the slope itself for a sign
of grip need a law: Gustafsson, Automatica 33 (1997); Rajamani et al., IEEE Control Systems 30 (2010).
"""

from __future__ import annotations

from functools import lru_cache
from math import erf, exp, log, sqrt

import numpy as np

from skidpad.core.arrays import Floats

GRIP = np.geomspace(0.05, 1.05, 28)
STIFFNESS_SHARES = np.geomspace(0.22, 1.55, 13)  # of the tyre that the estimator was designed with
STIFFNESS_SPREAD, STIFFNESS_OPEN = 0.25, 0.3  # relative, and share of the prior that is flat
LOG_GRIP = np.log(GRIP)
CHANGE = 1000.0  # m over which a surface is expected to change; our assumption
CAUTION = 0.3  # quantile of the grip that is taken for its value
WILD = 0.01  # least likelihood of a reading over the best one: readings may be wrong
TEMPER = 0.5  # exponent of a reading's likelihood, as readings share their errors
REPEATED, NEW_FORCE = (
    0.05,
    0.03,
)  # exponent where force over load is within this of the last reading's
COLD_C = 3.0  # deg C that a thermometer with 2 K of error says where the road may be frozen
BRIDGE_K = 3.0  # K by which a bridge may be colder than the road beside it; our assumption
# (grip, relative spread, weight) by stage of the rain sensor: dry, wet (0.2 mm), in between, 1 mm at 90
# km/h of the friction table of the Bosch Automotive Handbook (docs/physics.md); the weights are our
# assumption, as is what hides a patch of something else
RAIN_PRIORS = (
    ((0.85, 0.15, 0.96), (0.3, 0.6, 0.04)),
    ((0.65, 0.2, 0.95), (0.3, 0.6, 0.05)),
    ((0.5, 0.25, 0.95), (0.25, 0.6, 0.05)),
    ((0.35, 0.3, 0.95), (0.2, 0.6, 0.05)),
)
# ice, packed snow, bare road in the cold: docs/physics.md lists the tests
COLD_PRIOR = ((0.12, 0.25, 0.25), (0.3, 0.3, 0.5), (0.7, 0.25, 0.25))


@lru_cache(maxsize=8)
def prior_of(stage: int, is_cold: bool) -> Floats:
    """Returns the (n,) probabilities of the n grips in GRIP before any evidence.

    stage: of the rain sensor, 0 (dry) to 3, index into RAIN_PRIORS; is_cold: below COLD_C.
    """
    parts = COLD_PRIOR if is_cold else RAIN_PRIORS[stage]
    wet = RAIN_PRIORS[stage][0][0] if is_cold and stage else 1.0
    p = np.zeros(len(GRIP))
    for grip, spread, weight in parts:
        bell = np.exp(-0.5 * ((LOG_GRIP - log(min(grip, wet))) / spread) ** 2)
        p += weight * bell / bell.sum()
    p /= p.sum()
    return p


def quantile(p: Floats, share: float) -> float:
    """Returns the grip below which `share` of the (n,) probabilities lies."""
    return exp(float(np.interp(share, np.cumsum(p) - 0.5 * p, LOG_GRIP)))


def prior_grip(stage: int, air_c: float) -> float:
    """Returns the grip that a careful driver expects: the CAUTION quantile of `prior_of`.

    stage: of the rain sensor, 0: dry; air_c: air in deg C.
    """
    return quantile(prior_of(stage, air_c < COLD_C), CAUTION)


def _stiffness_prior() -> Floats:
    """Returns the prior over STIFFNESS_SHARES: a lognormal bell plus a uniform share, summing to 1."""
    bell = np.exp(-0.5 * (np.log(STIFFNESS_SHARES) / STIFFNESS_SPREAD) ** 2)
    p = np.full(len(bell), STIFFNESS_OPEN / len(bell))
    p += (1.0 - STIFFNESS_OPEN) * bell / bell.sum()
    return p


STIFFNESS_PRIOR = _stiffness_prior()


class GripBelief:
    """Probabilities (grips, stiffnesses) of what the tyres stand on."""

    def __init__(self) -> None:
        self.prior, self.is_new, self.force = prior_of(0, False), True, 0.0
        self.p = np.outer(self.prior, STIFFNESS_PRIOR)

    def forget(self, way: float, prior: Floats) -> None:
        """Mixes the belief with `prior` by the chance that the surface changed on a way of so many m.

        The first call replaces it by the prior. `confidence` is measured against the last prior given here.
        """
        way, self.is_new, self.prior = 1e9 if self.is_new else way, False, prior
        share = 1.0 - exp(-way / CHANGE)
        self.p = (1.0 - share) * self.p + share * np.outer(prior, STIFFNESS_PRIOR)

    def see_slip(
        self, force: float, slip: float, stiffness: float, sigma_slip: float, sigma_force: float
    ) -> None:
        """Updates the belief by force over load and slip with their standard deviations.

        Both are >= 0 when they work as meant. stiffness: force over load per unit slip of the design's tyre.
        """
        stiff = stiffness * STIFFNESS_SHARES
        sigma = np.minimum(stiff * abs(slip) / (3.0 * GRIP[:, None]), 1.0)
        left = 1.0 - sigma
        expected = GRIP[:, None] * (1.0 - left**3)
        variance = sigma_force**2 + (sigma_slip * stiff * left * left) ** 2
        error = (force if slip >= 0.0 else -force) - expected
        is_repeated = abs(force - self.force) < NEW_FORCE
        self.force = force
        likelihood = np.exp(-0.5 * error * error / variance) / np.sqrt(variance)
        self._multiply(likelihood, REPEATED if is_repeated else TEMPER)

    def see_least(self, use: float, sigma: float) -> None:
        """Updates the belief by a lower bound: the car got `use`, over gravity, with error sigma."""
        edge = (GRIP - use) / (sigma * sqrt(2.0))
        self._multiply(np.array([0.5 * (1.0 + erf(x)) for x in edge.tolist()])[:, None])

    def see_limit(self, grip: float, spread: float) -> None:
        """Updates the belief by the grip that a car at its limit showed; spread: its relative error."""
        error = (LOG_GRIP - log(max(grip, 1e-3))) / spread
        self._multiply(np.exp(-0.5 * error * error)[:, None])

    def _multiply(self, likelihood: Floats, exponent: float = TEMPER) -> None:
        """Multiplies the belief by a likelihood to a power and makes it sum to 1 again.

        No likelihood counts for less than WILD of the greatest one; all zeros change nothing.
        """
        likely = likelihood / likelihood.max() if likelihood.max() > 0.0 else 1.0
        self.p = self.p * np.maximum(likely, WILD) ** exponent
        self.p /= self.p.sum()

    @property
    def grips(self) -> Floats:
        """Returns (n,) the probability of each of the n grips in GRIP, summed over stiffnesses."""
        marginal: Floats = self.p.sum(axis=1)
        return marginal

    @property
    def softness(self) -> float:
        """Mean over the belief of the design's stiffness over the stiffness; 1 for the tyre of the design."""
        return float(self.p.sum(axis=0) @ (1.0 / STIFFNESS_SHARES))

    @property
    def confidence(self) -> float:
        """1 less the spread of the grip over that of the prior, at least 0: what signals have added."""
        return max(1.0 - _compute_spread(self.grips) / _compute_spread(self.prior), 0.0)


def _compute_spread(p: Floats) -> float:
    """Returns the standard deviation of the logarithm of grip under the (n,) probabilities; at least 3e-5."""
    mean = p @ LOG_GRIP
    return sqrt(max(float(p @ (LOG_GRIP - mean) ** 2), 1e-9))
