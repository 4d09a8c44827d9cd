"""Moving actors by force: places, velocities, impulses, physics on and off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.catalogue import Family
from skidpad.simulation.carla_server.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.world import World

TABLE = Table("motion")
BELONGS_TO_MAP = (Family.TRAFFIC_LIGHT, Family.TRAFFIC_SIGN)


def put(world: World, actor: Actor, pose: Pose) -> None:
    """Place an actor; a child is placed relative to where its parent then is."""
    if actor.family in BELONGS_TO_MAP:
        raise CallError(f"actor {actor.id} belongs to the map and stays where it is")
    if actor.parent:
        actor.mount = pose
        return
    if actor.family is Family.VEHICLE:
        world.vehicles.teleport(actor.id, pose)
    actor.pose = pose


def _vehicle(world: World, id: Any) -> Actor | None:
    """The vehicle to push; None when it is of another family or gone, which CARLA ignores."""
    actor = world.actors.find(id)
    if actor is None or actor.id not in world.vehicles.slots:
        return None
    return actor


@TABLE.method("set_actor_transform", Shape.VOID)
def set_actor_transform(world: World, id: Any, transform: Any) -> None:
    """Put it there."""
    put(world, world.actors.get(id), wire.pose(transform, "transform"))


@TABLE.method("set_actor_location", Shape.VOID)
def set_actor_location(world: World, id: Any, location: Any) -> None:
    """Put it there with the attitude that it has."""
    actor = world.actors.get(id)
    x, y, z = wire.iso_vector(location, "location")
    base = actor.mount if actor.parent else world.pose(actor)
    put(world, actor, replace(base, x=x, y=y, z=z))


@TABLE.method("set_walker_state", Shape.VOID)
def set_walker_state(world: World, id: Any, transform: Any, speed: Any) -> None:
    """Place of its feet, and speed, in one, as the client's pedestrian navigation tells them."""
    actor = world.actors.get(id, Family.WALKER)
    put(world, actor, wire.pose(transform, "transform").moved(up=actor.half[2]))
    actor.extra.speed = 0.0
    v = wire.number(speed, "speed")
    forward = actor.pose.moved(forward=v)
    actor.velocity = (forward.x - actor.pose.x, forward.y - actor.pose.y, 0.0)


@TABLE.method("set_actor_target_velocity", Shape.VOID)
def set_actor_target_velocity(world: World, id: Any, velocity: Any) -> None:
    """World axes."""
    v = wire.iso_vector(velocity, "velocity")
    actor = _vehicle(world, id)
    if actor is not None:
        world.vehicles.set_velocity(actor.id, v)


@TABLE.method("set_actor_target_angular_velocity", Shape.VOID)
def set_actor_target_angular_velocity(world: World, id: Any, turn: Any) -> None:
    """deg/s; only the part about the vertical acts."""
    rate = wire.iso_turn(turn, "angular velocity")
    actor = _vehicle(world, id)
    if actor is not None:
        world.vehicles.fleet.states.yaw_rate[world.vehicles.slots[actor.id]] = rate[2]


@TABLE.method("enable_actor_constant_velocity", Shape.VOID)
def enable_actor_constant_velocity(world: World, id: Any, velocity: Any) -> None:
    """Body axes; kept against all forces."""
    v = wire.iso_vector(velocity, "velocity")
    actor = _vehicle(world, id)
    if actor is not None:
        world.vehicles.of(actor.id).constant_velocity = v


@TABLE.method("disable_actor_constant_velocity", Shape.VOID)
def disable_actor_constant_velocity(world: World, id: Any) -> None:
    """Physics again."""
    actor = _vehicle(world, id)
    if actor is not None:
        world.vehicles.of(actor.id).constant_velocity = None


@TABLE.method("add_actor_impulse", Shape.VOID)
def add_actor_impulse(world: World, id: Any, impulse: Any) -> None:
    """N s at the centre of gravity; the vertical part is lost."""
    push(world, id, impulse, None, 1.0)


@TABLE.method("add_actor_impulse_at_location", Shape.VOID)
def add_actor_impulse_at_location(world: World, id: Any, impulse: Any, location: Any) -> None:
    """N s at a point of the world."""
    push(world, id, impulse, location, 1.0)


@TABLE.method("add_actor_force", Shape.VOID)
def add_actor_force(world: World, id: Any, force: Any) -> None:
    """N for one tick."""
    push(world, id, force, None, world.episode.settings.step)


@TABLE.method("add_actor_force_at_location", Shape.VOID)
def add_actor_force_at_location(world: World, id: Any, force: Any, location: Any) -> None:
    """N for one tick at a point of the world."""
    push(world, id, force, location, world.episode.settings.step)


@TABLE.method("add_actor_angular_impulse", Shape.VOID)
def add_actor_angular_impulse(world: World, id: Any, impulse: Any) -> None:
    """kg m^2 deg/s as CARLA has it; only the part about the vertical acts."""
    twist(world, id, impulse, 1.0)


@TABLE.method("add_actor_torque", Shape.VOID)
def add_actor_torque(world: World, id: Any, torque: Any) -> None:
    """For one tick; only the part about the vertical acts."""
    twist(world, id, torque, world.episode.settings.step)


def push(world: World, id: Any, amount: Any, location: Any | None, seconds: float) -> None:
    """An impulse of `amount` times `seconds` on a vehicle."""
    x, y, z = wire.iso_vector(amount, "impulse or force")
    point = None if location is None else wire.iso_vector(location, "location")
    actor = _vehicle(world, id)
    if actor is not None:
        world.vehicles.push(actor.id, (x * seconds, y * seconds, z * seconds), point)


def twist(world: World, id: Any, amount: Any, seconds: float) -> None:
    """An angular impulse of `amount` times `seconds` on a vehicle."""
    moment = wire.iso_turn(amount, "torque")
    actor = _vehicle(world, id)
    if actor is not None:
        world.vehicles.twist(actor.id, moment[2] * seconds)


@TABLE.method("set_actor_simulate_physics", Shape.VOID)
def set_actor_simulate_physics(world: World, id: Any, enabled: Any) -> None:
    """Off: it stays where clients put it."""
    actor = world.actors.get(id)
    on = wire.flag(enabled, "enabled")
    if actor.family is Family.VEHICLE:
        world.vehicles.of(actor.id).simulated = on
    elif actor.family is Family.WALKER:
        world.walkers.simulated[actor.id] = on


@TABLE.method("set_actor_collisions", Shape.VOID)
def set_actor_collisions(world: World, id: Any, enabled: Any) -> None:
    """Off: it passes through everything."""
    actor = world.actors.get(id)
    on = wire.flag(enabled, "enabled")
    if actor.family is Family.VEHICLE:
        world.vehicles.of(actor.id).collides = on


@TABLE.method("set_actor_enable_gravity", Shape.VOID, without_effect="vehicles stay on the road")
def set_actor_enable_gravity(world: World, id: Any, enabled: Any) -> None:
    """Accepted."""
    world.actors.get(id)
    wire.flag(enabled, "enabled")


@TABLE.method("set_actor_dead", Shape.VOID, without_effect="actors do not fall")
def set_actor_dead(world: World, id: Any) -> None:
    """Accepted."""
    world.actors.get(id)
