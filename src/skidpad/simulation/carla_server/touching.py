"""Contacts between vehicles, walkers, props and roadside, and what collision sensors hear of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from skidpad.roads.queries import RoadMap

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World


@dataclass(frozen=True, slots=True)
class Touch:
    """Two actors touch in this tick."""

    actor: int
    other: int  # 0: something of the map
    label: int  # SemanticClass of the other
    impulse: tuple[float, float, float]  # N s on `actor`, world


class Contacts:
    """Who touches whom in this tick."""

    def __init__(self) -> None:
        self.events: list[Touch] = []

    def begin(self, roads: RoadMap) -> None:
        """Another map."""
        del roads
        self.events = []

    def resolve(self, world: World) -> None:
        """Find contacts and push vehicles apart."""
        del world
        self.events = []
