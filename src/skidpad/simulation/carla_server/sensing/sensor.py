"""A sensor at work, and what makes its messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings
from skidpad.simulation.carla_server.snapshot import SensorType

Message = tuple[bytes | memoryview, ...]


@dataclass(slots=True, eq=False)
class Sensor:
    """One sensor at work."""

    actor: Actor
    period: float  # s; 0: every tick
    rng: np.random.Generator
    equipment: Any  # what its producer made for it
    due: float = 0.0  # s of simulated time

    def number(self, attribute: str) -> float:
        """A numeric attribute."""
        return float(self.actor.attributes[attribute])

    def share(self, clock: Clock) -> float:
        """s of work that one reading stands for."""
        return max(clock.step, self.period)


def _no_equipment(_: Actor, __: int) -> None:
    return None


@dataclass(frozen=True, slots=True)
class Producer:
    """How one kind of sensor works."""

    type: SensorType
    produce: Callable[[Surroundings, Clock, Sensor], list[Message]]
    equip: Callable[[Actor, int], Any] = _no_equipment
    """From attributes and the server's seed; WireError when they cannot be used."""
