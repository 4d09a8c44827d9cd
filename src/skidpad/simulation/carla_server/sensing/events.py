"""Sensors that speak only when something happens: collision and obstacle."""

from __future__ import annotations

from math import cos, sin
from typing import TYPE_CHECKING

from skidpad.core.vocabulary import SemanticClass
from skidpad.simulation.carla_server import codec, wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.catalogue import Blueprint, Family
from skidpad.simulation.carla_server.spawning import SOLID, world_box

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.sensing.sensors import Sensor
    from skidpad.simulation.carla_server.world import World

Messages = list[tuple[bytes | memoryview, ...]]
MAP_THINGS = {
    SemanticClass.GUARD_RAIL: "static.guardrail",
    SemanticClass.WALL: "static.wall",
    SemanticClass.FENCE: "static.fence",
    SemanticClass.BUILDING: "static.building",
    SemanticClass.POLE: "static.pole",
}


def collision(world: World, sensor: Sensor) -> Messages:
    """One message per contact of the carrier in this tick."""
    carrier = world.actors.alive.get(sensor.actor.parent)
    if carrier is None:
        return []
    messages: Messages = []
    for touch in world.contacts.events:
        if touch.actor == carrier.id and any(touch.impulse):
            other = _touched(world, touch.other, touch.label)
            impulse = list(wire.iso_to_wire(touch.impulse))
            messages.append((codec.pack([carrier.packed(), other.packed(), impulse]),))
    return messages


def _touched(world: World, id: int, label: int) -> Actor:
    """The other actor, or a nameless piece of the map."""
    found = world.actors.find(id) if id else None
    if found is not None:
        return found
    kind = SemanticClass(label)
    blueprint = Blueprint(MAP_THINGS.get(kind, "static.unknown"), Family.PROP, {}, label=kind)
    return Actor(0, blueprint, {}, world.spectator.pose)


def obstacle(world: World, sensor: Sensor) -> Messages:
    """The nearest solid actor within `distance` ahead of the sensor, by a swept sphere."""
    carrier = world.actors.alive.get(sensor.actor.parent)
    if carrier is None:
        return []
    reach, radius = sensor.number("distance"), sensor.number("hit_radius")
    moving_only = sensor.actor.attributes["only_dynamics"].lower() == "true"
    pose = world.pose(sensor.actor)
    c, s = cos(pose.yaw), sin(pose.yaw)
    best: tuple[float, Actor] | None = None
    for other in world.actors:
        if other.family not in SOLID or other is carrier or other.parent:
            continue
        if moving_only and other.family is Family.PROP:
            continue
        centre, half = world_box(world, other)
        ahead = (centre.x - pose.x) * c + (centre.y - pose.y) * s
        aside = abs((centre.y - pose.y) * c - (centre.x - pose.x) * s)
        turn = centre.yaw - pose.yaw
        along = half[0] * abs(cos(turn)) + half[1] * abs(sin(turn))
        across = half[0] * abs(sin(turn)) + half[1] * abs(cos(turn))
        gap = ahead - along
        met = ahead > 0.0 and gap <= reach and aside <= across + radius
        level = abs(centre.z - pose.z) <= half[2] + radius
        if met and level and (best is None or gap < best[0]):
            best = (max(gap, 0.0), other)
    if best is None:
        return []
    return [(codec.pack([carrier.packed(), best[1].packed(), best[0]]),)]
