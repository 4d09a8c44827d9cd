"""A space of values: what varies, in what ranges, and how likely each value is.

Methods of search see the unit cube only: a coordinate in [0, 1] is the share of the distribution that
lies below a value, so that uniform coordinates draw values as likely as the distributions say.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from statistics import NormalDist

from msgspec import Struct

from skidpad.core.errors import ConfigError

DIGITS = 9  # significant ones of a value, as files write it
STANDARD = NormalDist()
EDGE = 1e-12  # coordinates stay this far from 0 and 1, where a normal has no value


class Uniform(Struct, frozen=True, tag="uniform", forbid_unknown_fields=True):
    """Every value of a range is as likely as any other."""

    low: float
    high: float

    @property
    def range(self) -> tuple[float, float]:
        """Returns the lower and the upper end of the range."""
        return self.low, self.high

    def value(self, u: float) -> float:
        """Return the value below which the share `u` lies."""
        return self.low + u * (self.high - self.low)

    def likelihood(self, value: float) -> float:
        """Return the density relative to that of the likeliest value, 0 to 1."""
        return 1.0 if self.low <= value <= self.high else 0.0

    def scale_by(self, factor: float) -> Uniform:
        """Return the distribution of `factor` times the value."""
        return Uniform(*sorted((self.low * factor, self.high * factor)))

    def share_below(self, value: float) -> float:
        """Return the share of the distribution below a value: the inverse of `value`."""
        return min(max((value - self.low) / (self.high - self.low), 0.0), 1.0)

    def density(self, value: float) -> float:
        """Return the density at a value."""
        return self.likelihood(value) / (self.high - self.low)


class Normal(Struct, frozen=True, tag="normal", forbid_unknown_fields=True):
    """A normal distribution, cut to a range; of the logarithm where `is_log`."""

    mean: float
    sigma: float
    low: float | None = None  # None: no end
    high: float | None = None
    is_log: bool = False

    @property
    def range(self) -> tuple[float, float]:
        """Returns the ends of the range; infinite where there is none, 0 below a logarithm's."""
        lowest = 0.0 if self.is_log else -math.inf
        return (
            lowest if self.low is None else self.low,
            math.inf if self.high is None else self.high,
        )

    def value(self, u: float) -> float:
        """Return the value below which the share `u` lies."""
        low, high = self.range
        below, above = STANDARD.cdf(self._z(low)), STANDARD.cdf(self._z(high))
        inner = self.mean + self.sigma * STANDARD.inv_cdf(below + u * (above - below))
        return min(max(math.exp(inner) if self.is_log else inner, low), high)

    def likelihood(self, value: float) -> float:
        """Return the density of z, or of the logarithm, relative to the likeliest value, 0 to 1."""
        low, high = self.range
        if not low <= value <= high:
            return 0.0
        nearest = min(max(0.0, self._z(low)), self._z(high))
        return math.exp(0.5 * (nearest**2 - self._z(value) ** 2))

    def scale_by(self, factor: float) -> Normal:
        """Return the distribution of `factor` times the value, a factor above 0."""
        low, high = (None if end is None else end * factor for end in (self.low, self.high))
        if self.is_log:
            return Normal(self.mean + math.log(factor), self.sigma, low, high, True)
        return Normal(self.mean * factor, self.sigma * factor, low, high)

    def share_below(self, value: float) -> float:
        """Return the share of the distribution below a value: the inverse of `value`."""
        low, high = self.range
        below, above = STANDARD.cdf(self._z(low)), STANDARD.cdf(self._z(high))
        return float((STANDARD.cdf(self._z(min(max(value, low), high))) - below) / (above - below))

    def density(self, value: float) -> float:
        """Return the density at a value."""
        low, high = self.range
        if not low <= value <= high or (self.is_log and value <= 0.0):
            return 0.0
        mass = float(STANDARD.cdf(self._z(high)) - STANDARD.cdf(self._z(low)))
        bell = math.exp(-0.5 * self._z(value) ** 2) / math.sqrt(2.0 * math.pi)
        return bell / (mass * self.sigma * (value if self.is_log else 1.0))

    def _z(self, value: float) -> float:
        """Returns the standard score of a value, of its logarithm for a lognormal law."""
        if self.is_log:
            value = math.log(value) if value > 0.0 else -math.inf
        return (value - self.mean) / self.sigma


class Choice(Struct, frozen=True, tag="choice", forbid_unknown_fields=True):
    """One of several words, each with its weight."""

    words: tuple[str, ...]
    weights: tuple[float, ...] = ()  # (): alike; else one per word, 0 or more and one above 0

    def __post_init__(self) -> None:
        """Checks the weights; ConfigError names them where they make no distribution."""
        total = sum(self.weights)
        fits = len(self.weights) == len(self.words) and min(self.weights, default=0.0) >= 0.0
        if self.weights and not (fits and 0.0 < total < math.inf):
            raise ConfigError(
                f"weights of {len(self.words)} words must be as many, 0 or more and one above 0, "
                f"got {', '.join(f'{weight:g}' for weight in self.weights)}"
            )

    def value(self, u: float) -> str:
        """Returns the word in whose share of the distribution `u` lies."""
        reached, last = 0.0, self.words[-1]
        for word, share in zip(self.words, self._shares(), strict=True):
            reached += share
            if u < reached:
                return word
            last = word if share > 0.0 else last
        return last  # shares that add up to a hair below 1

    def likelihood(self, value: str) -> float:
        """Returns the weight of a word relative to that of the likeliest, 0 to 1; 0 for another word."""
        shares = self._shares()
        return shares[self.words.index(value)] / max(shares) if value in self.words else 0.0

    def _shares(self) -> list[float]:
        """Returns the probability of each word, equal ones where no weights are given."""
        weights = self.weights or (1.0,) * len(self.words)
        return [weight / sum(weights) for weight in weights]


Law = Uniform | Normal | Choice
Value = float | str


class Variable(Struct, frozen=True, forbid_unknown_fields=True):
    """A parameter of the scenario, `weather`, or `weather.FIELD`, and how its values are distributed.

    source: where the distribution was read; "" for an assumption.
    """

    name: str
    law: Law
    source: str = ""

    def value(self, u: float) -> Value:
        """Return the value of a coordinate in [0, 1], as files write it."""
        found = self.law.value(min(max(u, EDGE), 1.0 - EDGE))
        return found if isinstance(found, str) else float(f"{found:.{DIGITS}g}")

    def likelihood(self, value: Value) -> float:
        """Return how likely a value is beside the likeliest one, 0 to 1."""
        return self.law.likelihood(value)  # type: ignore[arg-type]


class Space(Struct, frozen=True, forbid_unknown_fields=True):
    """All variables, in order: coordinate k is that of variable k."""

    variables: tuple[Variable, ...]

    def __post_init__(self) -> None:
        names = [v.name for v in self.variables]
        if not names:
            raise ConfigError(
                "nothing varies: give --vary NAME=LOW:HIGH, --disturb ACTOR=accel or a distribution file"
            )
        if len(set(names)) < len(names):
            raise ConfigError(f"a name varies twice: {', '.join(names)}")

    @property
    def names(self) -> tuple[str, ...]:
        """Returns the names of the variables in their order."""
        return tuple(v.name for v in self.variables)

    def values(self, unit: Sequence[float]) -> dict[str, Value]:
        """Return the values of a point of the unit cube, by name."""
        return {v.name: v.value(u) for v, u in zip(self.variables, unit, strict=True)}

    def likelihood(self, values: Mapping[str, Value]) -> float:
        """Return how likely the values are beside the likeliest ones, 0 to 1."""
        return math.prod(v.likelihood(values[v.name]) for v in self.variables)
