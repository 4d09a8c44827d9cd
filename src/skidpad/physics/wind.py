"""Wind on vehicles: side force and yaw moment by the air that moves past them, and gusts.

F = -k V v and M = -n u v, with V, u and v of the vehicle against the air, forward and left, so that both
are linear in the angle of the air at first: k and n are 0.5 rho A c, n times the wheelbase too. M is
about the middle of the wheelbase (form: Altair MotionView, aerodynamics for cars and trucks, after
Mitschke and Wallentowitz). Slopes of 3.0 and 1.0 per rad to 0.3 rad over a frontal area of 2 m^2: side
force and yaw moment vectors with which vehicle bodies of MathWorks' Vehicle Dynamics Blockset are set up
in public repositories. Here they are over the side area of a compact car, 5.0 m^2, and scale with it.
Assumptions: that scaling, the side area as 0.8 of length times height, the 2 m^2.

Gusts are a Gauss-Markov process along and across the wind: Dryden's first-order filter (MIL-STD-8785C)
with a length of 50 m and an intensity that the run says, one for all vehicles: assumptions.
Valid: mean wind to 30 m/s, vehicles that roll on four wheels. It acts at the centre of gravity.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, exp, sin, sqrt

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.maths.randomness import stream
from skidpad.core.setup import Wind
from skidpad.physics.types import VehicleType

AIR_DENSITY = 1.225  # kg/m^3, ISO 2533 at sea level
FRONTAL, FORCE_SLOPE, MOMENT_SLOPE = 2.0, 3.0, 1.0  # m^2, 1/rad, 1/rad over the wheelbase
COMPACT_SIDE = 5.0  # m^2
SIDE_FILL = 0.8  # of length times height
GUST_LENGTH = 50.0  # m
HURRICANE = 32.7  # m/s, least wind of Beaufort 12 (tcdata.typhoon.org.cn, extended Beaufort scale)


def side_coefficients(types: Sequence[VehicleType]) -> Floats:
    """Returns (n, 2): k of the side force F = -k V v in N, n of the yaw moment M = -n u v in N m.

    Speeds against the air in m/s, as in the module's docstring.
    """
    area = np.array([SIDE_FILL * t.length * t.height for t in types], dtype=np.float64)
    wheelbase = np.array([t.wheelbase for t in types], dtype=np.float64)
    per_area = 0.5 * AIR_DENSITY * FRONTAL / COMPACT_SIDE
    return np.column_stack(
        [FORCE_SLOPE * per_area * area, MOMENT_SLOPE * per_area * area * wheelbase]
    )


def wind_of_intensity(percent: float) -> float:
    """Returns the wind in m/s of CARLA's `wind_intensity`: 100 is a hurricane, linear: an assumption.

    CARLA gives its number no unit: it bends trees and slants rain.
    """
    return HURRICANE * percent / 100.0


class Gusts:
    """The wind of a run tick by tick: its mean and what gusts add."""

    def __init__(self, wind: Wind, seed: int) -> None:
        self._rng = stream(seed, "wind", "gusts")
        self._along = self._across = 0.0  # standard deviations
        self.wind = wind

    def advance(self, dt: float) -> tuple[float, float]:
        """Moves the gusts on by dt seconds and returns the velocity of the air in m/s in world axes.

        Random numbers are drawn only where gusts and mean wind are above 0.
        """
        wind = self.wind
        if wind.gusts > 0.0 and wind.speed > 0.0:
            keep = exp(-dt * wind.speed / GUST_LENGTH)
            fresh = sqrt(1.0 - keep * keep)
            one, other = self._rng.standard_normal(2)
            self._along = keep * self._along + fresh * float(one)
            self._across = keep * self._across + fresh * float(other)
        along = wind.speed * (1.0 + wind.gusts * self._along)
        across = wind.speed * wind.gusts * self._across
        c, s = cos(wind.towards), sin(wind.towards)
        return along * c - across * s, along * s + across * c
