"""Walkers: they walk as told, on the ground, and nothing pushes them.

A walker's origin is the middle of its body, as in CARLA.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, hypot
from typing import TYPE_CHECKING

from skidpad.simulation.carla_server.actors import STILL, Actor
from skidpad.simulation.carla_server.wire import Vector

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

V_MAX = 15.0  # m/s


@dataclass(slots=True)
class WalkerControl:
    """WalkerControl as last applied; ISO direction."""

    direction: Vector = STILL
    speed: float = 0.0
    jump: bool = False
    lane: int = -1  # hint for the ground


class Walkers:
    """All walkers."""

    def __init__(self) -> None:
        self.members: dict[int, Actor] = {}
        self.simulated: dict[int, bool] = {}

    def add(self, actor: Actor) -> None:
        """A new walker at rest."""
        actor.extra = WalkerControl()
        self.members[actor.id] = actor

    def forget(self, id: int) -> None:
        """It is gone."""
        self.members.pop(id, None)
        self.simulated.pop(id, None)

    def step(self, world: World, dt: float) -> None:
        """Everybody walks for dt."""
        for actor in self.members.values():
            if self.simulated.get(actor.id, True):
                _walk(world, actor, actor.extra, dt)


def _walk(world: World, actor: Actor, control: WalkerControl, dt: float) -> None:
    dx, dy, _ = control.direction
    length = hypot(dx, dy)
    v = min(max(control.speed, 0.0), V_MAX) if length > 1e-6 else 0.0
    before = actor.velocity
    vx, vy = (v * dx / length, v * dy / length) if v > 0.0 else (0.0, 0.0)
    x, y = actor.pose.x + vx * dt, actor.pose.y + vy * dt
    yaw = atan2(dy, dx) if v > 0.0 else actor.pose.yaw
    z = ground_height(world, x, y, actor.pose.z - actor.half[2], control)
    actor.pose = replace(actor.pose, x=x, y=y, z=z + actor.half[2], yaw=yaw)
    actor.velocity = (vx, vy, 0.0)
    actor.acceleration = ((vx - before[0]) / dt, (vy - before[1]) / dt, 0.0)


def ground_height(
    world: World, x: float, y: float, z: float, control: WalkerControl | None = None
) -> float:
    """Height of the nearest lane of any kind; the given one beside all roads."""
    hint = -1 if control is None else control.lane
    place = world.map.roads.project(x, y, z, hint, driving=False)
    if place is None:
        return z
    if control is not None:
        control.lane = place.lane
    return place.z
