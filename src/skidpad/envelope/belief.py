"""What is believed of the grip: probabilities over grip and slip stiffness, by Bayes' rule.

No law between stiffness and grip is assumed: both are unknown, and only the bend of the curve tells
them apart. What is known spreads back to the prior with the distance driven, as a surface may have
changed on the way, so "no information" is the prior and never high grip. The curve is the brush
tyre's (Pacejka, Tire and Vehicle Dynamics, chapter 3). Methods that take the slope itself for a sign
of grip need a law: Gustafsson, Automatica 33 (1997); Rajamani et al., IEEE Control Systems 30 (2010).
"""

from __future__ import annotations

from math import erf, exp, log, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel

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


def _make_prior(stage: int, is_cold: bool) -> Floats:
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


COLD = len(RAIN_PRIORS)  # row of PRIORS from which on those of the cold stand
PRIORS = np.array([_make_prior(i, cold) for cold in (False, True) for i in range(COLD)])


def prior_of(stage: int, is_cold: bool) -> Floats:
    """Returns the row of PRIORS for a stage of the rain sensor, 0 (dry) to 3; is_cold: below COLD_C."""
    row: Floats = PRIORS[stage + COLD if is_cold else stage]
    return row


@kernel
def quantile(p: Floats, share: float) -> float:
    """Returns the grip below which `share` of the (n,) probabilities lies."""
    below, middle, last = 0.0, 0.0, 0.0
    for i in range(len(p)):
        middle = below + 0.5 * p[i]
        if share < middle:
            if i == 0:
                return float(GRIP[0])
            part = (share - last) / (middle - last)
            return exp(LOG_GRIP[i - 1] + part * (LOG_GRIP[i] - LOG_GRIP[i - 1]))
        last = middle
        below += p[i]
    return float(GRIP[len(p) - 1])


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


BELIEF = np.dtype([("is_new", np.bool_), ("force", np.float64)], align=True)


class BeliefArrays(NamedTuple):
    """What is believed, for kernels: n grips of GRIP, m stiffnesses of STIFFNESS_SHARES."""

    memory: NDArray[
        np.void
    ]  # (1,) BELIEF: nothing was seen yet; force over load of the last reading
    p: Floats  # (n, m) probabilities
    prior: Floats  # (n,) the last one that was given
    grips: Floats  # (n,) room: `p` summed over stiffnesses
    likelihood: Floats  # (n, m) room


def new_belief() -> BeliefArrays:
    """Returns what is believed before anything is known."""
    memory = np.zeros(1, BELIEF)
    memory["is_new"] = True
    prior = prior_of(0, False).copy()
    p = np.outer(prior, STIFFNESS_PRIOR)
    return BeliefArrays(memory, p, prior, np.zeros(len(GRIP)), np.zeros_like(p))


@kernel
def forget(belief: BeliefArrays, way: float, prior: Floats) -> None:
    """Mixes the belief with `prior`, (n,), by the chance that the surface changed on a way of so many m.

    The first call replaces it by the prior. `measure_confidence` measures against the last prior given here.
    """
    m, p = belief.memory[0], belief.p
    share = 1.0 if m.is_new else 1.0 - exp(-way / CHANGE)
    m.is_new = False
    for i in range(len(GRIP)):
        belief.prior[i] = prior[i]
        for j in range(len(STIFFNESS_SHARES)):
            p[i, j] = (1.0 - share) * p[i, j] + share * prior[i] * STIFFNESS_PRIOR[j]


@kernel
def see_slip(
    belief: BeliefArrays, force: float, slip: float, stiffness: float, sigma_slip: float,
    sigma_force: float,
) -> None:  # fmt: skip
    """Updates the belief by force over load and slip with their standard deviations.

    Both are >= 0 when they work as meant. stiffness: force over load per unit slip of the design's tyre.
    """
    m, likelihood = belief.memory[0], belief.likelihood
    measured = force if slip >= 0.0 else -force
    for j in range(len(STIFFNESS_SHARES)):
        stiff = stiffness * STIFFNESS_SHARES[j]
        for i in range(len(GRIP)):
            left = 1.0 - min(stiff * abs(slip) / (3.0 * GRIP[i]), 1.0)
            spread = sigma_slip * stiff * left * left
            variance = sigma_force * sigma_force + spread * spread
            error = measured - GRIP[i] * (1.0 - left * left * left)
            likelihood[i, j] = exp(-0.5 * error * error / variance) / sqrt(variance)
    is_repeated = abs(force - m.force) < NEW_FORCE
    m.force = force
    multiply(belief, REPEATED if is_repeated else TEMPER)


@kernel
def see_least(belief: BeliefArrays, use: float, sigma: float) -> None:
    """Updates the belief by a lower bound: the car got `use`, over gravity, with error sigma."""
    for i in range(len(GRIP)):
        edge = (GRIP[i] - use) / (sigma * sqrt(2.0))
        belief.likelihood[i, :] = 0.5 * (1.0 + erf(edge))
    multiply(belief, TEMPER)


@kernel
def see_limit(belief: BeliefArrays, grip: float, spread: float) -> None:
    """Updates the belief by the grip that a car at its limit showed; spread: its relative error."""
    shown = log(max(grip, 1e-3))
    for i in range(len(GRIP)):
        error = (LOG_GRIP[i] - shown) / spread
        belief.likelihood[i, :] = exp(-0.5 * error * error)
    multiply(belief, TEMPER)


@kernel
def multiply(belief: BeliefArrays, exponent: float) -> None:
    """Multiplies the belief by the likelihood in its room to a power and makes it sum to 1 again.

    No likelihood counts for less than WILD of the greatest one; all zeros change nothing.
    """
    p, likelihood, most, total = belief.p, belief.likelihood, 0.0, 0.0
    for i in range(len(GRIP)):
        for j in range(len(STIFFNESS_SHARES)):
            most = max(most, likelihood[i, j])
    for i in range(len(GRIP)):
        for j in range(len(STIFFNESS_SHARES)):
            likely = likelihood[i, j] / most if most > 0.0 else 1.0
            p[i, j] *= max(likely, WILD) ** exponent
            total += p[i, j]
    for i in range(len(GRIP)):
        for j in range(len(STIFFNESS_SHARES)):
            p[i, j] /= total


@kernel
def sum_grips(belief: BeliefArrays) -> None:
    """Writes (n,) the probability of each grip, summed over stiffnesses, to its room `grips`."""
    for i in range(len(GRIP)):
        total = 0.0
        for j in range(len(STIFFNESS_SHARES)):
            total += belief.p[i, j]
        belief.grips[i] = total


@kernel
def measure_softness(belief: BeliefArrays) -> float:
    """Returns the mean over the belief of the design's stiffness over the stiffness; 1 for its own tyre."""
    mean = 0.0
    for i in range(len(GRIP)):
        for j in range(len(STIFFNESS_SHARES)):
            mean += belief.p[i, j] / STIFFNESS_SHARES[j]
    return mean


@kernel
def measure_confidence(belief: BeliefArrays) -> float:
    """Returns 1 less the spread of the grip over that of the prior, at least 0: what signals have added."""
    sum_grips(belief)
    return max(1.0 - measure_spread(belief.grips) / measure_spread(belief.prior), 0.0)


@kernel
def measure_spread(p: Floats) -> float:
    """Returns the standard deviation of the logarithm of grip under the (n,) probabilities; at least 3e-5."""
    mean, variance = 0.0, 0.0
    for i in range(len(GRIP)):
        mean += p[i] * LOG_GRIP[i]
    for i in range(len(GRIP)):
        variance += p[i] * (LOG_GRIP[i] - mean) * (LOG_GRIP[i] - mean)
    return sqrt(max(variance, 1e-9))
