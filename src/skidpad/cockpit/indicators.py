"""How near a crash a stored run was: the time to collision along its time line."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.evidence.bodies import Body
from skidpad.evidence.drive.conflict import time_to_collision
from skidpad.evidence.pairs import following

NEAR = 10.0  # s, our choice: a longer time to collision is not shown
CURVE = 1000  # about so many moments of a curve are shown


def ttc_ahead(bodies: Sequence[Body], present: NDArray[np.bool_]) -> Floats:
    """Returns (T,) s to the collision with the nearest body in the ego's way; inf: none is near.

    bodies: the ego first. present: (T, n), each where it may be met.
    """
    least = np.full(len(present), np.inf)
    for i, other in enumerate(bodies[1:], start=1):
        way = following(bodies[0], other)
        there = present[:, 0] & present[:, i] & ~np.isnan(way.gap)
        ttc = time_to_collision(way.gap[there], way.v_closing[there])
        least[there] = np.minimum(least[there], ttc)
    return least


def every(n: int) -> slice:
    """Returns a slice that takes about CURVE of n moments."""
    return slice(None, None, max(1, n // CURVE))


def least_of(values: Floats) -> list[float | None]:
    """Returns the least value from each shown moment to the next, so that no short one is missed.

    None where it is not below NEAR.
    """
    if not len(values):
        return []
    least = np.minimum.reduceat(values, np.arange(len(values))[every(len(values))])
    return [round(v, 1) if v < NEAR else None for v in least.tolist()]
