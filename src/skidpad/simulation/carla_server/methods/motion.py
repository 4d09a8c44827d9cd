"""Moving actors by force: places, velocities, impulses, physics on and off."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin
from typing import Any

from skidpad.core.geometry import Pose
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.protocol.rpc import CallError, Shape, Table
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicle
from skidpad.simulation.world.interventions import hold_velocity, set_collides, set_velocity

TABLE = Table("motion")
BELONGS_TO_MAP = (Family.TRAFFIC_LIGHT, Family.TRAFFIC_SIGN)


def place_actor(served: Served, actor: Actor, pose: Pose) -> None:
    """Places an actor; CallError for one of the map."""
    if actor.family in BELONGS_TO_MAP:
        raise CallError(f"actor {actor.id} belongs to the map and stays where it is")
    served.episode.place(actor, pose)


def _vehicle(served: Served, id: Any) -> Vehicle | None:
    """Returns the vehicle to push; None when it is of another family or gone, which CARLA ignores."""
    vehicles = served.episode.vehicles
    wire.integer(id, "actor id")
    return vehicles.of(id) if id in vehicles else None


@TABLE.method("set_actor_transform", Shape.VOID)
def set_actor_transform(served: Served, id: Any, transform: Any) -> None:
    """Places an actor at a transform."""
    place_actor(served, served.episode.actors.get(id), wire.pose(transform, "transform"))


@TABLE.method("set_actor_location", Shape.VOID)
def set_actor_location(served: Served, id: Any, location: Any) -> None:
    """Puts an actor at a location with the attitude that it has."""
    actor = served.episode.actors.get(id)
    x, y, z = wire.iso_vector(location, "location")
    base = actor.mount if actor.parent else served.episode.actors.pose(actor)
    place_actor(served, actor, replace(base, x=x, y=y, z=z))


@TABLE.method("set_walker_state", Shape.VOID)
def set_walker_state(served: Served, id: Any, transform: Any, speed: Any) -> None:
    """Sets place of its feet and speed of a walker, as the client's pedestrian navigation sends them."""
    actor = served.episode.actors.get(id, Family.WALKER)
    pose, v = wire.pose(transform, "transform"), wire.number(speed, "speed")
    place_actor(served, actor, pose.moved(up=actor.lift))
    if actor.body is not None:
        set_velocity(served.episode.moving, actor.body, v * cos(pose.yaw), v * sin(pose.yaw))


@TABLE.method("set_actor_target_velocity", Shape.VOID)
def set_actor_target_velocity(served: Served, id: Any, velocity: Any) -> None:
    """Sets a vehicle's velocity, in axes of the world; other actors are left alone."""
    v = wire.iso_vector(velocity, "velocity")
    vehicle = _vehicle(served, id)
    if vehicle is not None:
        served.episode.vehicles.set_velocity(vehicle.actor, v)
        actors = served.episode.actors
        rising = actors.rising.get(vehicle.actor, 0.0)
        served.episode.falling.push(actors.alive[vehicle.actor], v[2] - rising)


@TABLE.method("set_actor_target_angular_velocity", Shape.VOID)
def set_actor_target_angular_velocity(served: Served, id: Any, turn: Any) -> None:
    """Sets a vehicle's turn, given in deg/s; only the part about the vertical acts."""
    rate = wire.iso_turn(turn, "angular velocity")
    vehicle, moving = _vehicle(served, id), served.episode.moving
    if vehicle is not None:
        moving.states.yaw_rate[moving.row(vehicle.body)] = rate[2]


@TABLE.method("enable_actor_constant_velocity", Shape.VOID)
def enable_actor_constant_velocity(served: Served, id: Any, velocity: Any) -> None:
    """Holds a vehicle's velocity, given in axes of its body, against all forces."""
    v = wire.iso_vector(velocity, "velocity")
    vehicle = _vehicle(served, id)
    if vehicle is not None:
        hold_velocity(served.episode.moving, vehicle.body, v[:2])


@TABLE.method("disable_actor_constant_velocity", Shape.VOID)
def disable_actor_constant_velocity(served: Served, id: Any) -> None:
    """Hands a vehicle's velocity back to physics."""
    vehicle = _vehicle(served, id)
    if vehicle is not None:
        hold_velocity(served.episode.moving, vehicle.body, None)


@TABLE.method("add_actor_impulse", Shape.VOID)
def add_actor_impulse(served: Served, id: Any, impulse: Any) -> None:
    """Applies an impulse in N s at a vehicle's centre of gravity."""
    push(served, id, impulse, None, 1.0)


@TABLE.method("add_actor_impulse_at_location", Shape.VOID)
def add_actor_impulse_at_location(served: Served, id: Any, impulse: Any, location: Any) -> None:
    """Applies an impulse in N s at a point of the world."""
    push(served, id, impulse, location, 1.0)


@TABLE.method("add_actor_force", Shape.VOID)
def add_actor_force(served: Served, id: Any, force: Any) -> None:
    """Applies a force in N for one tick at a vehicle's centre of gravity."""
    push(served, id, force, None, served.clock.step)


@TABLE.method("add_actor_force_at_location", Shape.VOID)
def add_actor_force_at_location(served: Served, id: Any, force: Any, location: Any) -> None:
    """Applies a force in N for one tick at a point of the world."""
    push(served, id, force, location, served.clock.step)


@TABLE.method("add_actor_angular_impulse", Shape.VOID)
def add_actor_angular_impulse(served: Served, id: Any, impulse: Any) -> None:
    """Applies kg m^2 deg/s as CARLA has it; only the part about the vertical acts."""
    twist(served, id, impulse, 1.0)


@TABLE.method("add_actor_torque", Shape.VOID)
def add_actor_torque(served: Served, id: Any, torque: Any) -> None:
    """Applies a torque for one tick; only the part about the vertical acts."""
    twist(served, id, torque, served.clock.step)


def push(served: Served, id: Any, amount: Any, location: Any | None, seconds: float) -> None:
    """Applies an impulse of `amount` times `seconds` to a vehicle; does nothing to other actors.

    location: point of the world, None: the centre of gravity.
    """
    x, y, z = wire.iso_vector(amount, "impulse or force")
    point = None if location is None else wire.iso_vector(location, "location")
    vehicle = _vehicle(served, id)
    if vehicle is not None:
        served.episode.vehicles.push(vehicle.actor, (x * seconds, y * seconds, z * seconds), point)
        actor = served.episode.actors.alive[vehicle.actor]
        served.episode.falling.push(actor, z * seconds / vehicle.type.mass)


def twist(served: Served, id: Any, amount: Any, seconds: float) -> None:
    """Applies an angular impulse of `amount` times `seconds` to a vehicle; nothing to other actors."""
    moment = wire.iso_turn(amount, "torque")
    vehicle = _vehicle(served, id)
    if vehicle is not None:
        served.episode.vehicles.twist(vehicle.actor, moment[2] * seconds)


@TABLE.method("set_actor_simulate_physics", Shape.VOID)
def set_actor_simulate_physics(served: Served, id: Any, enabled: Any) -> None:
    """Switches an actor's physics; off, it stays where clients put it."""
    on = wire.flag(enabled, "enabled")
    served.episode.simulate(served.episode.actors.get(id), on)


@TABLE.method("set_actor_collisions", Shape.VOID)
def set_actor_collisions(served: Served, id: Any, enabled: Any) -> None:
    """Switches a vehicle's contacts; off, it passes through everything. Nothing changes for others."""
    on = wire.flag(enabled, "enabled")
    vehicle = _vehicle(served, served.episode.actors.get(id).id)
    if vehicle is not None:
        set_collides(served.episode.moving, vehicle.body, on)


@TABLE.method("set_actor_enable_gravity", Shape.VOID)
def set_actor_enable_gravity(served: Served, id: Any, enabled: Any) -> None:
    """Switches gravity; off, a vehicle or walker keeps its height and its tyres grip nothing."""
    actor = served.episode.actors.get(id)
    served.episode.falling.weigh(actor, wire.flag(enabled, "enabled"))


@TABLE.method("set_actor_dead", Shape.VOID, without_effect="walkers do not lie down")
def set_actor_dead(served: Served, id: Any) -> None:
    """Accepts the call and does nothing, as walkers do not fall down."""
    served.episode.actors.get(id)
