"""Sensors that speak only when something happens: collision and obstacle."""

from __future__ import annotations

from math import cos, sin

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.simulation.carla_server.actors.catalogue import Blueprint, Family
from skidpad.simulation.carla_server.actors.registry import SOLID, Actor
from skidpad.simulation.carla_server.actors.touches import touches
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import codec, wire
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

MAP_THINGS = {
    SemanticClass.GUARD_RAIL: "static.guardrail",
    SemanticClass.WALL: "static.wall",
    SemanticClass.FENCE: "static.fence",
    SemanticClass.BUILDING: "static.building",
    SemanticClass.POLE: "static.pole",
}


def collision(around: Surroundings, _: Clock, sensor: Sensor) -> list[Message]:
    """Returns one message per contact of the carrier in this tick; [] for none."""
    carrier = around.actors.carrier(sensor.actor)
    messages: list[Message] = []
    for touch in touches(around.moving, around.actors):
        if touch.actor is carrier and any(touch.impulse):
            other = _of_map(touch.label) if touch.other is None else touch.other
            impulse = list(wire.iso_to_wire(touch.impulse))
            messages.append((codec.pack([carrier.pack(), other.pack(), impulse]),))
    return messages


def _of_map(label: SemanticClass) -> Actor:
    """Returns a nameless actor that stands for a piece of the map with this label."""
    blueprint = Blueprint(MAP_THINGS.get(label, "static.unknown"), Family.PROP, {}, label=label)
    return Actor(0, blueprint, {}, Pose(0.0, 0.0))


def obstacle(around: Surroundings, _: Clock, sensor: Sensor) -> list[Message]:
    """Returns a message of the nearest solid actor within `distance` ahead, by a swept sphere.

    [] for none.
    """
    carrier, actors = around.actors.carrier(sensor.actor), around.actors
    if carrier is None:
        return []
    reach, radius = sensor.number("distance"), sensor.number("hit_radius")
    moving_only = sensor.actor.attributes["only_dynamics"].lower() == "true"
    pose = actors.pose(sensor.actor)
    c, s = cos(pose.yaw), sin(pose.yaw)
    best: tuple[float, Actor] | None = None
    for other in actors:
        if other.family not in SOLID or other is carrier or other.parent:
            continue
        if moving_only and other.family is Family.PROP:
            continue
        centre, half = actors.box(other)
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
    return [(codec.pack([carrier.pack(), best[1].pack(), best[0]]),)]
