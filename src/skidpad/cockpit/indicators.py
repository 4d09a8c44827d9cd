"""How near a crash a stored run was: gap and time to collision along its time line."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.evidence.bodies import Body
from skidpad.evidence.drive.conflict import time_to_collision
from skidpad.evidence.pairs import following

NEAR = 10.0  # s, our choice: a longer time to collision is not shown
FAR = 80.0  # m, our choice: a longer gap is not shown
CURVE = 1000  # about so many moments of a curve are shown


class Ahead(NamedTuple):
    """How near the bodies in the ego's way are, (T,) each; inf: none is in the way."""

    ttc: Floats  # s, least time to collision
    gap: Floats  # m, least gap, bumper to bumper


def measure_ahead(bodies: Sequence[Body], present: NDArray[np.bool_]) -> Ahead:
    """Returns time to collision and gap to what is in the ego's way.

    bodies: the ego first. present: (T, n), each where it may be met.
    """
    ahead = Ahead(np.full(len(present), np.inf), np.full(len(present), np.inf))
    for i, other in enumerate(bodies[1:], start=1):
        way = following(bodies[0], other)
        there = present[:, 0] & present[:, i] & ~np.isnan(way.gap)
        ttc = time_to_collision(way.gap[there], way.v_closing[there])
        ahead.ttc[there] = np.minimum(ahead.ttc[there], ttc)
        ahead.gap[there] = np.minimum(ahead.gap[there], way.gap[there])
    return ahead


def every(n: int) -> slice:
    """Returns a slice that takes about CURVE of n moments."""
    return slice(None, None, max(1, n // CURVE))


def least_of(values: Floats, below: float, part: slice) -> list[float | None]:
    """Returns the least value from each moment of `part` to the next, so that no short one is missed.

    None where it is not below `below`.
    """
    if not len(values):
        return []
    least = np.minimum.reduceat(values, np.arange(len(values))[part])
    return [round(v, 1) if v < below else None for v in least.tolist()]
