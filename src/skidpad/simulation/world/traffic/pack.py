"""A pack that keeps the ego company: who is left behind or drives away enters anew, out of sight."""

from __future__ import annotations

from math import cos, hypot, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.states import ActorStates
from skidpad.simulation.world.traffic.network import DRIVABLE, Network
from skidpad.simulation.world.traffic.state import Drivers

RADIUS = 250.0  # m of road, ahead of the ego and behind it
UNSEEN = 150.0  # m: no sensor reaches farther, neither the radar nor the object level
FARTHEST = 240.0  # m of road at which somebody enters


def ways(net: Network, lane: int, s: float, forward: bool) -> dict[int, float]:
    """Returns lanes met within RADIUS from a place on, or back from it, with the m to where each begins.

    Metres of road from the place, negative behind it. Neighbours of the same direction count as beside it.
    """
    begins = {lane: -s}
    todo = [lane]
    for here in todo:  # which grows meanwhile
        row, at = net.lane[here], begins[here]
        end = at + float(row["length"])
        found = [(int(row["left"]), at), (int(row["right"]), at)]
        if forward and end < RADIUS:
            following = slice(int(row["next_first"]), int(row["next_first"] + row["nexts"]))
            found += [(int(n), end) for n in net.next_lane[following]]
        if not forward and at > -RADIUS:
            before = slice(int(row["prev_first"]), int(row["prev_first"] + row["prevs"]))
            found += [(int(p), at - float(net.lane["length"][p])) for p in net.prev_lane[before]]
        for other, start in found:
            if other >= 0 and other not in begins and int(net.lane["kind"][other]) in DRIVABLE:
                begins[other] = start
                todo.append(other)
    return begins


class Pack:
    """The roads around the ego at one moment, and who of the pack is where on them."""

    def __init__(self, net: Network, ego: Any, lane_of: NDArray[np.integer[Any]]) -> None:
        """ego: its row of PLACE, on a lane. lane_of: (N,) lane of each point of the network."""
        self.net, self.lane_of = net, lane_of
        lane, s = int(ego["lane"]), float(ego["s"])
        self.ahead, self.behind = (ways(net, lane, s, forward) for forward in (True, False))

    def away(self, lane: int, s: float) -> float | None:
        """Returns the m of road by which a place lies ahead of the ego, negative: behind.

        None where it is farther than RADIUS.
        """
        for begins in (self.ahead, self.behind):
            if lane in begins and abs(begins[lane] + s) <= RADIUS:
                return begins[lane] + s
        return None

    def lost(self, d: Drivers, states: ActorStates) -> list[tuple[int, bool]]:
        """Returns rows of vehicles that left the pack and are out of sight, and whether to enter ahead.

        They are to enter where they did not leave it, as there they would leave it again.
        """
        gone = []
        for i in np.flatnonzero(d.state["active"] & states.present).tolist():
            if self.away(int(d.path[i, 0]), float(d.state["s"][i])) is not None:
                continue
            dx, dy = float(states.x[i] - states.x[0]), float(states.y[i] - states.y[0])
            yaw = float(states.yaw[0])
            if hypot(dx, dy) > UNSEEN:
                gone.append((i, cos(yaw) * dx + sin(yaw) * dy < 0.0))
        return gone

    def entrances(self, candidates: NDArray[np.intp], ahead: bool) -> NDArray[np.intp]:
        """Returns those of the candidate points that lie out of sight on the way ahead, or else behind."""
        begins = np.full(len(self.net.lane), np.nan)
        for lane, start in (self.ahead if ahead else self.behind).items():
            begins[lane] = start
        away = np.abs(begins[self.lane_of[candidates]] + self.net.point["s"][candidates])
        fits: NDArray[np.intp] = candidates[(away >= UNSEEN) & (away <= FARTHEST)]
        return fits
