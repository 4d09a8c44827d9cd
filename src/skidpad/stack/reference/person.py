"""Who drives: reaction time, headway, speed and acceleration of one careful driver, drawn from a seed.

Inputs from the literature; docs/reference-driver.md compares what comes out with other sources.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp

from skidpad.core.maths.randomness import stream

# Johansson and Rumar (1965), report 26, Uppsala: from a signal to the brake when it comes as a
# surprise; median 0.9 s, 25 % of drivers above 1.2 s. A log-normal through both.
REACTION_MEDIAN, REACTION_SIGMA = 0.9, 0.4265  # s, of the logarithm: ln(1.2 / 0.9) / 0.6745
REACTION_RANGE = (0.4, 2.5)  # s
# Taieb-Maimon and Shinar (2001), Human Factors 43(1): the comfortable distance, 0.98 s; spread as
# the background's drivers have it (simulation/world/traffic/variety.py).
HEADWAY_MEDIAN, HEADWAY_SIGMA = 0.98, 0.4  # s, of the logarithm
HEADWAY_RANGE = (0.5, 3.0)  # s
SPEED_SIGMA, SLOWEST = 0.10, 0.8  # of the limit (Highway Capacity Manual 2010); none above it
# Kesting, Treiber and Helbing (2010): acceleration 1.4 m/s^2, varied by 20 to 30 %.
A_MAX, A_SIGMA, A_RANGE = 1.4, 0.25, (0.7, 2.1)  # m/s^2


@dataclass(frozen=True, slots=True)
class Person:
    """Holds the traits of one driver."""

    reaction: float  # s
    headway: float  # s
    speed: float  # share of the limit that is driven on a dry road
    a_max: float  # m/s^2


def person_of(seed: int) -> Person:
    """Returns the driver that a seed draws.

    A careful driver keeps at least the headway that the own reaction needs: who follows closer than
    that cannot stop behind a leader that brakes as hard.
    """
    z = stream(seed, "reference", "person").standard_normal(4).tolist()
    reaction = _within(REACTION_MEDIAN * exp(REACTION_SIGMA * z[0]), REACTION_RANGE)
    headway = _within(HEADWAY_MEDIAN * exp(HEADWAY_SIGMA * z[1]), HEADWAY_RANGE)
    return Person(
        reaction=reaction,
        headway=max(headway, reaction),
        speed=_within(1.0 + SPEED_SIGMA * z[2], (SLOWEST, 1.0)),
        a_max=_within(A_MAX * (1.0 + A_SIGMA * z[3]), A_RANGE),
    )


def _within(value: float, bounds: tuple[float, float]) -> float:
    """Returns the value clipped to its bounds (low, high)."""
    return min(max(value, bounds[0]), bounds[1])
