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
from skidpad.scenarios.actions.trailers import can_tow
from skidpad.scenarios.entities import GHOST, Entity
from skidpad.scenarios.network import Network
from skidpad.scenarios.scene import Actor
from skidpad.scenarios.start import Begin, Start


def hitch_of(pose: Pose, tractor: Entity) -> tuple[float, float]:
    """Returns where a vehicle's hitch is."""
    dx = tractor.coupling.hitch or 0.0
    return pose.x + dx * cos(pose.yaw), pose.y + dx * sin(pose.yaw)


def towed_pose(before: Pose, z: float, hitch: tuple[float, float], trailer: Entity) -> Pose:
    """Returns a trailer's pose when its tractor's hitch has moved; before: its pose until then."""
    length = trailer.coupling.coupler or 0.0
    yaw = atan2(hitch[1] - before.y, hitch[0] - before.x)
    return Pose(hitch[0] - length * cos(yaw), hitch[1] - length * sin(yaw), z, yaw=yaw)


def line_up(start: Start, entities: Mapping[str, Entity], network: Network) -> Start:
    """Returns the begin with every trailer straight behind the vehicle that tows it from the begin."""
    begins = dict(start.entities)
    waiting = [e for e in entities.values() if e.coupling.trailer in begins]
    towed = {e.coupling.trailer for e in waiting}
    for tractor in sorted(waiting, key=lambda e: e.name in towed):
        chain: Entity | None = tractor
        while chain is not None and chain.coupling.trailer in begins:
            begin, trailer = begins[chain.name], entities[chain.coupling.trailer]
            if begin.place is not None and can_tow(chain, trailer):
                behind = (chain.coupling.hitch or 0.0) - (trailer.coupling.coupler or 0.0)
                place = network.place_of(begin.place.pose.moved(forward=behind))
                begins[trailer.name] = Begin(place, begin.speed, begins[trailer.name].actions)
            chain = None if trailer.name == tractor.name else trailer
    return replace(start, entities=begins)


def connect_at_begin(actors: Mapping[str, Actor]) -> None:
    """Connect what the vehicles of a file tow from the begin."""
    for actor in actors.values():
        trailer = actors.get(actor.entity.coupling.trailer)
        if trailer is not None and can_tow(actor.entity, trailer.entity):
            trailer.towed_by = actor


def tractors_first(actors: Iterable[Actor]) -> list[Actor]:
    """Returns the actors in their order, but a trailer after the vehicle that tows it."""
    found = list(actors)
    return sorted(found, key=_depth) if any(a.towed_by for a in found) else found


def _depth(actor: Actor) -> int:
    depth, one = 0, actor.towed_by
    while one is not None and one is not actor:
        depth, one = depth + 1, one.towed_by
    return depth


def tow_command(actor: Actor, tractor: Actor, dt: float) -> ActorCommand | None:
    """Returns where a trailer is at the end of the step; None while either is not in the world."""
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
    found, name = dict(entities), entities[ego].coupling.trailer
    while name in found and not found[name].is_ghost and name != ego:
        trailer = found[name]
        found[name] = replace(trailer, properties={**trailer.properties, GHOST: "true"})
        name = trailer.coupling.trailer
    return found
