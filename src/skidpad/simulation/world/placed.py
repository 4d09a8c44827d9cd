"""Where the actors are on the lanes, as drivers see it: one row per actor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats

PLACE = np.dtype(
    [
        ("x", "f8"),
        ("y", "f8"),
        ("yaw", "f8"),
        ("vx", "f8"),
        ("vy", "f8"),
        ("speed", "f8"),  # m/s along the body
        ("yaw_rate", "f8"),
        ("ax", "f8"),  # m/s^2 along the body
        ("s", "f8"),  # m along the lane
        ("offset", "f8"),  # m left of its centre
        ("heading", "f8"),  # rad, of the lane there
        ("v", "f8"),  # m/s along the lane
        ("half_length", "f8"),
        ("half_width", "f8"),
        ("lane", "i4"),  # -1: on none
        ("sample", "i4"),  # of the lane, at or before the actor
        ("present", "?"),
    ],
    align=True,
)
Places = NDArray[np.void]  # (n,) PLACE


def places_for(length: Floats, width: Floats) -> Places:
    """Places of n actors, on no lane yet."""
    placed = np.zeros(len(length), dtype=PLACE)
    placed["lane"] = -1
    placed["half_length"], placed["half_width"] = length / 2.0, width / 2.0
    return placed
