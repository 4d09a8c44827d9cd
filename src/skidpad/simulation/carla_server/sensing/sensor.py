"""A sensor at work, and what makes its messages."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings
from skidpad.simulation.carla_server.snapshot import SensorType

EARLY = 1e-4  # s, so that a period of whole ticks is met in spite of rounding
Message = tuple[bytes | memoryview, ...]


@dataclass(slots=True, eq=False)
class Sensor:
    """Holds one sensor of the episode, with its period and random stream."""

    actor: Actor
    period: float  # s; 0: every tick
    rng: np.random.Generator
    equipment: Any  # what its producer made for it
    due: float | None = None  # s of simulated time; None until the first reading
    textures: dict[int, int] = field(default_factory=dict)  # streams of its G-buffers

    def number(self, attribute: str) -> float:
        """Returns an attribute of the sensor as a number."""
        return float(self.actor.attributes[attribute])

    def is_due(self, time: float) -> bool:
        """Returns whether the sensor reads at `time` in s; if so, its next time is set.

        The period counts from its first reading.
        """
        due = time if self.due is None else self.due
        if time < due - EARLY:
            return False
        later = due + self.period
        self.due = later if later > time + EARLY else time + self.period
        return True

    def share(self, clock: Clock) -> float:
        """Returns the s of work that one reading stands for: the period, one tick at least."""
        return max(clock.step, self.period)


def _no_equipment(_: Actor, __: int) -> None:
    """Does nothing: it serves the sensors that need no equipment."""


@dataclass(frozen=True, slots=True)
class Producer:
    """How one kind of sensor works."""

    type: SensorType
    produce: Callable[[Surroundings, Clock, Sensor], list[Message]]
    equip: Callable[[Actor, int], Any] = _no_equipment
    """From attributes and the server's seed; WireError when they cannot be used."""
    speak: Callable[[Surroundings, Clock, Sensor], None] | None = None
    """What it sends to others of its kind, in every tick and before any of them reads."""
    textures: Callable[[Surroundings, Clock, Sensor, list[int]], list[Message]] | None = None
    """Its G-buffers of these numbers, on streams of their own."""
    shares: Callable[[Surroundings, Sensor], Hashable] | None = None
    """What it looks at: sensors of one value read in turns, others beside them, in threads. Such a sensor
    changes nothing but its equipment and what it shares. None: it reads when all before it have read."""
