"""What drivers know of a map, found once per process: lanes, rights of way and zebras."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.traffic.network import LANE, POINT, STOP, Network, network
from skidpad.simulation.world.traffic.places import find_candidates
from skidpad.simulation.world.traffic.priority import CONFLICT, ENTRY, ZEBRA, bake_priority
from skidpad.simulation.world.traffic.state import Streets


@lru_cache(maxsize=8)
def network_of(map: RoadMap) -> Network:
    """Returns the drivers' view of a map, made once per process."""
    return network(map.samples, map.lanes, map.signals)


@lru_cache(maxsize=8)
def candidates_of(map: RoadMap) -> NDArray[np.intp]:
    """Returns the samples of a map at which vehicles can be put, found once per process."""
    return find_candidates(map, network_of(map))


@lru_cache(maxsize=8)
def priority_of(
    map: RoadMap,
) -> tuple[NDArray[np.void], NDArray[np.void], NDArray[np.void], NDArray[np.float64]]:
    """Returns the right of way on a map as of `bake_priority`, baked once per process."""
    return bake_priority(map.samples, map.lanes, map.signals, map.roadside)


def streets_of(map: RoadMap) -> Streets:
    """Returns lanes, rights of way and zebras of a map as drivers know them, with no `walkers` yet.

    `Traffic.arrange` puts the walkers in.
    """
    entry, conflict, zebra, zebras = priority_of(map)
    nobody, free = np.empty(0, dtype=np.int64), np.zeros(len(zebras), dtype=np.bool_)
    return Streets(network_of(map), entry, conflict, zebra, zebras, nobody, free)


def no_streets() -> Streets:
    """Returns the streets of a world without drivers: no lanes, conflicts or zebras."""
    lanes = np.empty(0, dtype=np.int32)
    net = Network(np.empty(0, POINT), np.empty(0, LANE), np.empty(0, STOP), lanes, lanes)
    rows = np.empty(0, ENTRY), np.empty(0, CONFLICT), np.empty(0, ZEBRA)
    nobody, free = np.empty(0, dtype=np.int64), np.zeros(0, dtype=np.bool_)
    return Streets(net, *rows, np.empty((0, 5)), nobody, free)
