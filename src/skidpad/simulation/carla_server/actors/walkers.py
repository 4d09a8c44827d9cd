"""Walkers: they walk as told, on the ground, and nothing pushes them."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

from skidpad.simulation.carla_server.actors.registry import STILL
from skidpad.simulation.carla_server.protocol.wire import Vector

V_MAX = 15.0  # m/s


@dataclass(frozen=True, slots=True)
class WalkerControl:
    """WalkerControl as last applied; ISO direction."""

    direction: Vector = STILL
    speed: float = 0.0
    jump: bool = False

    def velocity(self) -> tuple[float, float]:
        """Returns the walker's velocity in the plane in m/s, V_MAX at most; zeros without a direction."""
        x, y, _ = self.direction
        length = hypot(x, y)
        if length < 1e-6:
            return 0.0, 0.0
        v = min(max(self.speed, 0.0), V_MAX) / length
        return v * x, v * y
