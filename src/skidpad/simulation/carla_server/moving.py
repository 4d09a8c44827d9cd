"""After physics: attached actors follow their parents, and the snapshot's rows are filled."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import kmh_from_mps
from skidpad.core.lefthanded import (
    poses_to_carla,
    turn_from_carla,
    turns_to_carla,
    vector_from_carla,
    vectors_to_carla,
)
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.catalogue import Family
from skidpad.simulation.carla_server.snapshot import NO_LIGHT_STATE

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World

NO_MOTION = (Family.TRAFFIC_LIGHT, Family.TRAFFIC_SIGN, Family.VEHICLE)


def follow(world: World) -> None:
    """Children of vehicles and walkers go where their parents went."""
    for actor in world.actors:
        if actor.parent:
            parent = world.actors.alive.get(actor.parent)
            if parent is not None:
                actor.pose = world.pose(parent) @ actor.mount


def fill_rows(world: World) -> None:
    """All columns that may have changed."""
    if len(world.vehicles):
        _vehicles(world)
    _lights(world)
    for actor in world.actors:
        if actor.family not in NO_MOTION:
            fill_row(world, actor)


def fill_row(world: World, actor: Actor) -> None:
    """Pose and motion of an actor that is no vehicle."""
    row = world.rows.vehicles[actor.row]
    (x, y, z), (pitch, yaw, roll) = wire.transform(actor.pose)
    row["pose"] = (x, y, z, pitch, yaw, roll)
    row["velocity"] = vector_from_carla(*actor.velocity)
    row["turn"] = [degrees(v) for v in turn_from_carla(*actor.turn)]
    row["acceleration"] = vector_from_carla(*actor.acceleration)
    if actor.family is Family.WALKER:
        walker = world.rows.walkers[actor.row]
        control = actor.extra
        walker["direction"] = vector_from_carla(*control.direction)
        walker["speed"] = control.speed
        walker["jump"] = control.jump


def _vehicles(world: World) -> None:
    """Vehicles by columns."""
    members, fleet = world.vehicles.members, world.vehicles.fleet
    s, table = fleet.states, world.rows.vehicles
    rows = np.array([world.actors.alive[v.actor].row for v in members])
    table["pose"][rows] = poses_to_carla(s.x, s.y, s.z, s.roll, s.pitch, s.yaw)
    c, sn = np.cos(s.yaw), np.sin(s.yaw)
    climb = np.zeros(len(members))
    if len(world.ground.grade) == len(members):
        climb = (s.vx * c + s.vy * sn) * np.sin(world.ground.grade)
    table["velocity"][rows] = vectors_to_carla(s.vx, s.vy, climb)
    flat = np.zeros(len(members))
    table["turn"][rows] = np.degrees(turns_to_carla(flat, flat, s.yaw_rate))
    table["acceleration"][rows] = vectors_to_carla(s.ax * c - s.ay * sn, s.ax * sn + s.ay * c, flat)
    _controls(world, rows)


def _controls(world: World, rows: NDArray[np.int64]) -> None:
    """What drivers do, and what the road tells them."""
    table, members = world.rows.vehicles, world.vehicles.members
    control, switches, gears = [], [], []
    for i, vehicle in enumerate(members):
        c = vehicle.control
        control.append((c.throttle, wire.iso_steer(c.steer), c.brake))
        switches.append((c.hand_brake, c.reverse, c.manual))
        gears.append(c.gear if c.manual else world.vehicles.fleet.gear(i, c.reverse))
    table["control"][rows] = control
    table["switches"][rows] = switches
    table["gear"][rows] = gears
    table["speed_limit"][rows] = [kmh_from_mps(v.speed_limit) for v in members]
    _governed(world, rows)


def _governed(world: World, rows: NDArray[np.int64]) -> None:
    """The traffic light that each vehicle must obey."""
    states, has, ids = [], [], []
    for signal in world.ground.signal[: len(rows)].tolist():
        light = world.lights.by_row.get(signal)
        states.append(NO_LIGHT_STATE if light is None else int(light.state))
        has.append(light is not None)
        ids.append(0 if light is None else light.actor)
    if len(states) == len(rows):
        table = world.rows.vehicles
        table["light_state"][rows] = states
        table["has_light"][rows] = has
        table["light_id"][rows] = ids


def _lights(world: World) -> None:
    """Timers and lamps."""
    table = world.rows.lights
    for light in world.lights.lights:
        row = table[world.actors.alive[light.actor].row]
        row["times"] = (light.green, light.yellow, light.red, light.elapsed)
        row["frozen"] = world.lights.frozen(light)
        row["shown"] = int(light.state)
