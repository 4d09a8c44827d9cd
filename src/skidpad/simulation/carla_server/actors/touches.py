"""Contacts between actors in a tick, as collision sensors and the recorder report them."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.vocabulary import SemanticClass
from skidpad.simulation.carla_server.actors.registry import Actor, ActorTable
from skidpad.simulation.carla_server.protocol.wire import Vector
from skidpad.simulation.world.world import World


@dataclass(frozen=True, slots=True)
class Touch:
    """Two actors touch in this tick."""

    actor: Actor
    other: Actor | None  # None: something of the map
    label: SemanticClass  # of the other
    impulse: Vector  # N s on `actor`, world


def touches(moving: World, actors: ActorTable) -> list[Touch]:
    """Returns all contacts of the last step, those between actors twice, seen from both sides."""
    c, found = moving.touching, []
    for k in range(moving.touches):
        x, y = float(c.impulse[k] * c.nx[k]), float(c.impulse[k] * c.ny[k])
        one, j = actors.in_row(int(c.i[k])), int(c.j[k])
        if j < 0:
            label = moving.obstacles.labels[int(c.segment[k])]
            found.append(Touch(one, None, label, (x, y, 0.0)))
            continue
        two = actors.in_row(j)
        found.append(Touch(one, two, two.blueprint.label, (x, y, 0.0)))
        found.append(Touch(two, one, one.blueprint.label, (-x, -y, 0.0)))
    return found
