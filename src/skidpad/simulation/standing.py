"""Whether the ego stands, and whether it has a reason: another actor or a light is ahead."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import Held, kernel
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import LightState
from skidpad.roads.kernels import LaneArrays, project_point
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.simulation.clear_place import CLEAR_AHEAD, CLEAR_ASIDE, LEVEL

RED, YELLOW = int(LightState.RED), int(LightState.YELLOW)


class Stops(NamedTuple):
    """Where lights of a map stop whom they govern, by lane."""

    id: NDArray[np.int64]  # of the signal
    lane: NDArray[np.int64]
    s: Floats  # m along it

    def show(self, lights: Mapping[int, LightState]) -> NDArray[np.uint8]:
        """Returns the LightState at each of them; lights: by signal id, a missing one is UNKNOWN."""
        return np.array(
            [lights.get(i, LightState.UNKNOWN) for i in self.id.tolist()], dtype=np.uint8
        )


def stops_of(map: RoadMap) -> Stops:
    """Returns the stops of a map's lights."""
    signals = map.signals
    chosen = signals.kind == SignalKind.LIGHT
    ids, lanes = (np.asarray(c[chosen], dtype=np.int64) for c in (signals.id, signals.lane))
    return Stops(ids, lanes, np.asarray(signals.s[chosen], dtype=np.float64))


@kernel
def is_slow(held: Held[ActorStates], v: float) -> bool:
    """Returns whether the ego is slower than v m/s over ground."""
    s = held.value
    return bool(s.vx[0] * s.vx[0] + s.vy[0] * s.vy[0] < v * v)


@kernel
def has_actor_ahead(held: Held[ActorStates], x: float, y: float, z: float, heading: float) -> bool:
    """Returns whether the centre of an actor besides the ego is in the box ahead of a place.

    The box is CLEAR_ASIDE m to both sides and CLEAR_AHEAD m long, and LEVEL m up and down; heading:
    rad. Absent actors do not count.
    """
    s = held.value
    c, sn = cos(heading), sin(heading)
    for i in range(1, len(s.x)):
        dx, dy = s.x[i] - x, s.y[i] - y
        forward, aside = dx * c + dy * sn, abs(dy * c - dx * sn)
        near = 0.0 < forward < CLEAR_AHEAD and aside < CLEAR_ASIDE and abs(s.z[i] - z) < LEVEL
        if near and s.present[i]:
            return True
    return False


@kernel
def has_reason(
    map: Held[LaneArrays], held: Held[ActorStates], lanes: NDArray[np.int64], s: Floats,
    shown: NDArray[np.uint8], reach: float,
) -> bool:  # fmt: skip
    """Returns whether an actor is ahead, or a red or yellow light within `reach` m along the lane.

    lanes, s, shown: where lights stop the traffic, and what they show; False off every lane.
    """
    states = held.value
    x, y, z = states.x[0], states.y[0], states.z[0]
    lane, here, _, _, _, _, heading, _, _ = project_point(map.value, x, y, z, True)
    if lane < 0:
        return False
    if has_actor_ahead(held, x, y, z, heading):
        return True
    for k in range(len(lanes)):
        stops = shown[k] == RED or shown[k] == YELLOW
        if lanes[k] == lane and 0.0 < s[k] - here < reach and stops:
            return True
    return False
