"""What an environment says of each tick: the ego's own motion, its lane, and the vehicle ahead.

Perception is ideal up to `REACH`; friction is not observed, only what the car feels of it.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import wrap_angle
from skidpad.core.states import EgoEstimate
from skidpad.simulation.world.traffic.network import Network
from skidpad.simulation.world.world import EGO, World

REACH = 150.0  # m to the vehicle ahead; farther ones are not observed
FASTEST = 100.0  # m/s, bound of speeds


class Quantity(NamedTuple):
    """One number of an observation."""

    name: str
    unit: str
    low: float
    high: float


OBSERVED = (
    Quantity("speed", "m/s", -FASTEST, FASTEST),  # along the body
    Quantity("ax", "m/s^2", -100.0, 100.0),
    Quantity("ay", "m/s^2", -100.0, 100.0),
    Quantity("yaw_rate", "rad/s", -20.0, 20.0),
    Quantity("wheel_slip", "m/s", -FASTEST, FASTEST),  # slowest wheel minus speed
    Quantity("lane_offset", "m", -20.0, 20.0),  # left of the lane's centre
    Quantity("heading_error", "rad", -3.2, 3.2),
    Quantity("curvature", "1/m", -1.0, 1.0),  # of the lane here, left positive
    Quantity("limit", "m/s", 0.0, FASTEST),
    Quantity("gap", "m", -10.0, REACH),  # bumper to bumper; REACH without a vehicle ahead
    Quantity("closing_speed", "m/s", -FASTEST, FASTEST),  # positive when closing; 0 without one
    Quantity("has_lead", "1", 0.0, 1.0),
)
LOW = np.array([q.low for q in OBSERVED], dtype=np.float32)
HIGH = np.array([q.high for q in OBSERVED], dtype=np.float32)


class Lead(NamedTuple):
    """The vehicle ahead on the lanes that the ego follows."""

    gap: float  # m, bumper to bumper
    closing_speed: float  # m/s


class Observer:
    """Reads observations off a world."""

    def __init__(self, net: Network) -> None:
        self.net = net
        self._ways: dict[int, NDArray[np.float64]] = {}

    def observe(self, world: World, ego: EgoEstimate, lead: Lead | None) -> NDArray[np.float32]:
        """Returns the observation of this tick, within its bounds."""
        here = world.placed[EGO]
        on_lane = here["lane"] >= 0
        point = self.net.point[here["sample"]] if on_lane else None
        gap, closing = (REACH, 0.0) if lead is None else lead
        values = (
            ego.speed,
            ego.ax,
            ego.ay,
            ego.yaw_rate,
            min(ego.wheel_speeds) - ego.speed,
            here["offset"] if on_lane else 0.0,
            wrap_angle(ego.pose.yaw - here["heading"]) if on_lane else 0.0,
            0.0 if point is None else point["curvature"],
            0.0 if point is None else point["limit"],
            gap,
            closing,
            0.0 if lead is None else 1.0,
        )
        return np.array(values, dtype=np.float32).clip(LOW, HIGH)

    def find_lead(self, world: World) -> Lead | None:
        """Returns the nearest vehicle ahead in lane within reach; None where there is none."""
        placed = world.placed
        here = placed[EGO]
        lane = int(here["lane"])
        if lane < 0:
            return None
        way = self._ways.get(lane)
        if way is None:
            way = self._ways[lane] = self._way(lane)
        ahead = way[placed["lane"]] + placed["s"] - here["s"]
        ahead[~(placed["present"] & (placed["lane"] >= 0) & (ahead > 0.0))] = np.inf
        i = int(ahead.argmin())
        gap = float(ahead[i] - placed["half_length"][i] - here["half_length"])
        if not gap <= REACH:
            return None
        return Lead(gap, _along(here, here) - _along(placed[i], here))

    def _way(self, lane: int) -> NDArray[np.float64]:
        """Returns for each lane of the map the way in m to its begin from that of `lane`; inf: not on it."""
        lanes = self.net.lane
        way = np.full(len(lanes), np.inf)
        at, end = 0.0, REACH + float(lanes["length"][lane])
        while lane >= 0 and at <= end and np.isinf(way[lane]):
            way[lane] = at
            at += float(lanes["length"][lane])
            lane = int(lanes["ahead"][lane])
        return way


def _along(actor: np.void, here: np.void) -> float:
    """Returns an actor's speed in m/s along its own lane, or along the ego's where it has none."""
    heading = actor["heading"] if actor["lane"] >= 0 else here["heading"]
    return float(actor["vx"] * cos(heading) + actor["vy"] * sin(heading))
