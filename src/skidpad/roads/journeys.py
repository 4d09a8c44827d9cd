"""A way with an end: so many metres along the road from a start, and how far a car got on it."""

from __future__ import annotations

from math import hypot
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.kernels.jit import kernel
from skidpad.roads.edge import LEVEL
from skidpad.roads.queries import LanePoint, RoadMap

AnyFloats = NDArray[np.floating[Any]]
STEP = 5.0  # m between the places of a journey
WINDOW = 16  # places ahead of the last one among which a car is looked for
NEAR = 15.0  # m from a place within which a car is on its way: beside it on a road of four lanes


class Journey:
    """A way along the road; at forks it goes the straightest way, as lanes do (A-148)."""

    def __init__(self, map: RoadMap, start: LanePoint, length: float) -> None:
        """Lays `length` m of way from a start; ConfigError where the road ends before."""
        steps = max(round(length / STEP), 1)
        further = map.trace_ahead(start, STEP, steps)
        if len(further) < steps:
            raise ConfigError(
                f"route-km must be at most {len(further) * STEP / 1000.0:g} on map {map.name}, where "
                f"the road from the start ends; got {length / 1000.0:g}"
            )
        self.length = length
        self.places = np.vstack(((start.x, start.y, start.z), further[:, :3]))  # (n, 3)
        self.reached = 0  # index of the furthest place that the car came by

    def follow(self, x: float, y: float, z: float) -> float:
        """Takes where the car is now, and returns the m of the way that it has come by.

        Call it in each tick. A car that is beside the way comes no further, one that turns back keeps
        what it had.
        """
        self.reached = come_by(self.places, self.reached, x, y, z)
        return self.progress

    @property
    def progress(self) -> float:
        """M of the way that the car has come by, by the furthest place."""
        return self.length * self.reached / (len(self.places) - 1)

    @property
    def is_done(self) -> bool:
        """Whether the car has come to the end."""
        return self.reached == len(self.places) - 1


@kernel
def come_by(places: Floats, reached: int, x: float, y: float, z: float) -> int:
    """Returns the index of the furthest of (n, 3) places that a car at x, y, z in m has come by.

    reached: the one before, among whose next ones it is looked for.
    """
    best, least = reached, NEAR
    for k in range(reached, min(reached + WINDOW, len(places))):
        distance = hypot(places[k, 0] - x, places[k, 1] - y)
        if distance < least and abs(places[k, 2] - z) < LEVEL:
            best, least = k, distance
    return best


def progress_along(
    journey: Journey, x: AnyFloats, y: AnyFloats, z: AnyFloats
) -> NDArray[np.float64]:
    """Returns (T,) m of the way that a car at these (T,) places had come by in each tick."""
    ways = zip(x.tolist(), y.tolist(), z.tolist(), strict=True)
    return np.array([journey.follow(*way) for way in ways])
