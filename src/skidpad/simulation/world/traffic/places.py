"""Free places on the road for vehicles that enter or are put back while driving."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from skidpad.core.states import ActorStates
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.traffic.network import Network

CLEARANCE = 45.0  # m to any other vehicle
EDGE = 15.0  # m kept to both ends of a lane
MAX_CURVE = 1.0 / 150.0  # 1/m: nobody is put into a tight bend
TRIES = 60


def find_candidates(map: RoadMap, net: Network) -> NDArray[np.intp]:
    """Returns the samples of a map at which a vehicle can be put, if there is room."""
    drivable = (
        (net.lane["kind"] == LaneKind.DRIVING) & (map.lanes.junction < 0) & (net.lane["ahead"] >= 0)
    )
    fits = (
        drivable[map.samples.lane]
        & (net.point["s"] > EDGE)
        & (net.point["s"] < net.lane["length"][map.samples.lane] - EDGE)
        & (np.abs(net.point["curvature"]) < MAX_CURVE)
    )
    return np.flatnonzero(fits)


class FreePlaces:
    """Draws samples of driving lanes at which a vehicle can be put."""

    UNSAVED = ("lane", "z", "candidates", "net")  # as the map has them

    def __init__(
        self, map: RoadMap, net: Network, candidates: NDArray[np.intp], rng: np.random.Generator
    ) -> None:
        """candidates: of `find_candidates`."""
        self.lane, self.z = map.samples.lane, map.samples.z
        self.candidates, self.net, self.rng = candidates, net, rng

    def draw(
        self,
        states: ActorStates,
        nearest: float,
        farthest: float,
        has_room: Callable[[int, NDArray[np.float64]], bool],
        among: NDArray[np.intp] | None = None,
    ) -> int | None:
        """Returns a sample between `nearest` and `farthest` m from the ego, clear of all; None: not found.

        TRIES samples are drawn. has_room: of a sample and (n,) m from it to every actor. among: candidates,
        None: all.
        """
        point = self.net.point
        among = self.candidates if among is None else among
        if not len(among):
            return None
        tried = among[self.rng.integers(0, len(among), TRIES)]
        x, y = point["x"][tried], point["y"][tried]
        d = np.hypot(states.x - x[:, None], states.y - y[:, None])
        here = states.present
        fits = (nearest <= d[:, 0]) & (d[:, 0] <= farthest) & (d[:, here] >= CLEARANCE).all(axis=1)
        for k in np.flatnonzero(fits):
            if has_room(int(tried[k]), d[k]):
                return int(tried[k])
        return None
