"""Trailers: which vehicle tows which, where they stand at the begin, and how they follow the hitch.

A trailer is drawn by its coupler without slip: its rear axle moves towards the hitch. That is exact
for one axle in the limit of small steps, and what esmini does. The reference point is the rear axle.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from math import atan2, cos, sin

from skidpad.core.geometry import Pose
from skidpad.core.setup import ActorCommand
from skidpad.scenarios.actions.trailers import can_tow, train_of
from skidpad.scenarios.movement.network import Network
from skidpad.scenarios.reading.entities import GHOST, Entity
from skidpad.scenarios.scene import Actor
from skidpad.scenarios.start import Begin, Start


def hitch_of(pose: Pose, tractor: Entity) -> tuple[float, float]:
    """Returns x and y in m of a vehicle's hitch."""
    dx = tractor.coupling.hitch or 0.0
    return pose.x + dx * cos(pose.yaw), pose.y + dx * sin(pose.yaw)


def towed_pose(before: Pose, z: float, hitch: tuple[float, float], trailer: Entity) -> Pose:
    """Returns a trailer's pose when its tractor's hitch has moved; before: its pose until then."""
    length = trailer.coupling.coupler or 0.0
    yaw = atan2(hitch[1] - before.y, hitch[0] - before.x)
    return Pose(hitch[0] - length * cos(yaw), hitch[1] - length * sin(yaw), z, yaw=yaw)


def towing_pairs(entities: Mapping[str, Entity]) -> list[tuple[Entity, Entity]]:
    """Returns the trailers that are hitched at the start, each tractor before those that its trailer tows.

    Each trailer has one tractor, the first one of the file; a ring of trailers is left alone.
    """
    tractors: dict[str, Entity] = {}
    for tractor in entities.values():
        trailer = entities.get(tractor.coupling.trailer) if tractor.coupling.trailer else None
        if trailer is not None and trailer is not tractor and can_tow(tractor, trailer):
            tractors.setdefault(trailer.name, tractor)
    pairs, free = [], [e.name for e in entities.values() if e.name not in tractors]
    while free:
        name = free.pop(0)
        behind = [t for t, tractor in tractors.items() if tractor.name == name]
        pairs += [(entities[name], entities[t]) for t in behind]
        free += behind
    return pairs


def line_up(start: Start, entities: Mapping[str, Entity], network: Network) -> Start:
    """Returns the begin with every trailer straight behind the vehicle that tows it from the begin."""
    begins = dict(start.entities)
    for tractor, trailer in towing_pairs(entities):
        begin = begins[tractor.name]
        if begin.place is not None:
            behind = (tractor.coupling.hitch or 0.0) - (trailer.coupling.coupler or 0.0)
            place = network.place_of(begin.place.pose.moved(forward=behind))
            begins[trailer.name] = Begin(place, begin.speed, begins[trailer.name].actions)
    return replace(start, entities=begins)


def connect_at_begin(actors: Mapping[str, Actor]) -> None:
    """Connects what the vehicles of a file tow from the begin."""
    for tractor, trailer in towing_pairs({name: a.entity for name, a in actors.items()}):
        actors[trailer.name].towed_by = actors[tractor.name]


def tractors_first(actors: Iterable[Actor]) -> list[Actor]:
    """Returns the actors in their order, but a trailer after the vehicle that tows it."""
    found = list(actors)
    towed = [a for a in found if a.towed_by is not None]
    return sorted(found, key=lambda actor: len(tuple(train_of(actor)))) if towed else found


def tow_command(actor: Actor, tractor: Actor, dt: float) -> ActorCommand | None:
    """Moves a trailer behind its tractor and returns where it is at the end of the step of dt s.

    None while either is not in the world.
    """
    if not (actor.present and tractor.present):
        return None
    pose, motion = tractor.pose, tractor.motion
    if tractor.towed_by is None and not tractor.placed_by_file:
        pose = replace(pose, x=pose.x + motion.vx * dt, y=pose.y + motion.vy * dt)
    actor.pose = towed_pose(actor.pose, pose.z, hitch_of(pose, tractor.entity), actor.entity)
    actor.guide.v = tractor.v_told
    return ActorCommand(actor.name, place=actor.centre(actor.pose), speed=actor.guide.v)


def spare_own_trailers(entities: Mapping[str, Entity], ego: str) -> dict[str, Entity]:
    """Returns the entities; those that the ego tows touch nothing, as they would be in its way."""
    found, train = dict(entities), {ego}
    for tractor, trailer in towing_pairs(entities):
        if tractor.name in train:
            train.add(trailer.name)
            found[trailer.name] = replace(trailer, properties={**trailer.properties, GHOST: "true"})
    return found
