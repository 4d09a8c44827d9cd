"""Where a channel believes to be: jitter, slow drift and rare jumps (decision C-2)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import exp, sqrt

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import require_range
from skidpad.core.maths.randomness import stream


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalisationError:
    """Strengths of the parts of an error; zero switches a part off."""

    sigma: float  # m per axis, jitter that a filter leaves
    time: float  # s, its correlation time
    drift_sigma: float  # m per axis
    drift_time: float  # s
    jump_rate: float  # 1/h
    jump_low: float  # m, uniform size of a jump, any direction
    jump_high: float
    jump_time: float  # s until the channel has found itself again, exponential
    heading_sigma: float  # rad, with the jitter's correlation time
    dark: float = 1.0  # factor on jitter, drift and jump rate when it is dark

    def __post_init__(self) -> None:
        require_range("localisation.jump_high", self.jump_high, self.jump_low, 100.0)
        require_range("localisation.time", self.time, 1e-3, 1e6)
        require_range("localisation.drift_time", self.drift_time, 1e-3, 1e6)

    def scale(self, factor: float, is_dark: bool) -> LocalisationError:
        """Returns the same with all strengths times `factor`, in the dark or not.

        Darkness does not act on the heading; the result's own `dark` is 1.
        """
        f = factor * (self.dark if is_dark else 1.0)
        return replace(
            self,
            sigma=f * self.sigma,
            drift_sigma=f * self.drift_sigma,
            jump_rate=f * self.jump_rate,
            heading_sigma=factor * self.heading_sigma,
            dark=1.0,
        )


class Localisation:
    """The error of one channel over time; knows nothing of the world."""

    def __init__(self, error: LocalisationError, channel: str, seed: int, dt: float) -> None:
        self.error, self.dt = error, dt
        self._jitter = stream(seed, f"{channel}/localisation/jitter")
        self._drift = stream(seed, f"{channel}/localisation/drift")
        self._jumps = stream(seed, f"{channel}/localisation/jumps")
        # begun in their stationary distributions
        self.jitter: Floats = self._jitter.standard_normal(3) * self._sigmas()
        self.drift: Floats = self._drift.standard_normal(2) * error.drift_sigma
        self.jump: Floats = np.zeros(2)

    def _sigmas(self) -> Floats:
        """Returns the standard deviations (3,) of the error in x, y (m) and heading (rad)."""
        e = self.error
        return np.array([e.sigma, e.sigma, e.heading_sigma])

    def update(self) -> tuple[float, float, float]:
        """Returns the error in x, y (m, world frame) and heading (rad) of the next cycle."""
        e = self.error
        self.jitter = gauss_markov(
            self.jitter, self._jitter.standard_normal(3) * self._sigmas(), self.dt / e.time
        )
        self.drift = gauss_markov(
            self.drift, self._drift.standard_normal(2) * e.drift_sigma, self.dt / e.drift_time
        )
        chance, size, angle, back = self._jumps.random(4).tolist()  # as many in every cycle
        if chance < e.jump_rate / 3600.0 * self.dt:
            r = e.jump_low + size * (e.jump_high - e.jump_low)
            self.jump = r * np.array([np.cos(2.0 * np.pi * angle), np.sin(2.0 * np.pi * angle)])
        elif back < self.dt / e.jump_time:
            self.jump = np.zeros(2)
        x, y = (self.jitter[:2] + self.drift + self.jump).tolist()
        return x, y, float(self.jitter[2])


def gauss_markov(state: Floats, draw: Floats, ratio: float) -> Floats:
    """Returns the next value of a first-order Gauss-Markov process; `ratio` is the step over its time.

    draw: normal deviates with the stationary standard deviation. Source: Gelb (1974), 3.6.
    """
    kept = exp(-ratio)
    following: Floats = kept * state + sqrt(1.0 - kept * kept) * draw
    return following
