"""The columns of the snapshot that a tick may have changed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.maths.lefthanded import (
    poses_to_carla,
    turns_to_carla,
    vector_from_carla,
    vectors_to_carla,
)
from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server.actors.catalogue import Family
from skidpad.simulation.carla_server.actors.posts import Posts
from skidpad.simulation.carla_server.actors.registry import Actor, ActorTable
from skidpad.simulation.carla_server.actors.walkers import WalkerControl
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.snapshot import NO_LIGHT_STATE, Rows
from skidpad.simulation.carla_server.vehicles.vehicles import Vehicles

Signals = NDArray[np.int64]


BY_COLUMNS = (Family.VEHICLE, Family.TRAFFIC_LIGHT, Family.TRAFFIC_SIGN)


def fill_actor(rows: Rows, actors: ActorTable, actor: Actor) -> None:
    """Writes the pose of an actor that is no vehicle into its row."""
    (x, y, z), (pitch, yaw, roll) = wire.transform(actors.pose(actor))
    rows.vehicles["pose"][actor.row] = (x, y, z, pitch, yaw, roll)


def fill_walker(
    rows: Rows, actors: ActorTable, actor: Actor, control: WalkerControl, dt: float
) -> None:
    """Writes how a walker moves, and how it was told to walk, into its rows; dt: s since the last time."""
    row, walker = rows.vehicles[actor.row], rows.walkers[actor.row]
    now = np.array(vector_from_carla(*actors.velocity(actor)))
    row["acceleration"] = (now - row["velocity"]) / dt
    row["velocity"] = now
    walker["direction"] = vector_from_carla(*control.direction)
    walker["speed"] = control.speed
    walker["jump"] = control.jump


def fill_sign(rows: Rows, actor: Actor, sign: str, pole: int) -> None:
    """Writes place and name of a light or sign into its row; once, as they stay."""
    row = rows.lights[actor.row]
    (x, y, z), (pitch, yaw, roll) = wire.transform(actor.pose)
    row["pose"] = (x, y, z, pitch, yaw, roll)
    row["sign"] = sign.encode()[:31]
    row["pole"] = pole


def fill_vehicles(
    rows: Rows, actors: ActorTable, vehicles: Vehicles, posts: Posts, red: Flags
) -> None:
    """Writes motion, drivers and what the road tells them, by columns; passes on speed limits.

    red: (n,) whether a sign holds the vehicle, which is shown as a red light.
    """
    n, moving = len(vehicles), vehicles.moving
    if n == 0:
        return
    s, table = moving.fleet.states, rows.vehicles
    at = np.array([actors.alive[v.actor].row for v in vehicles])
    table["pose"][at] = poses_to_carla(s.x, s.y, s.z, s.roll, s.pitch, s.yaw)
    c, sn = np.cos(s.yaw), np.sin(s.yaw)
    climb = (s.vx * c + s.vy * sn) * np.sin(moving.grade[:n])
    for i, vehicle in enumerate(vehicles) if actors.rising else ():
        climb[i] = actors.rising.get(vehicle.actor, climb[i])
    table["velocity"][at] = vectors_to_carla(s.vx, s.vy, climb)
    flat = np.zeros(n)
    table["turn"][at] = np.degrees(turns_to_carla(flat, flat, s.yaw_rate))
    table["acceleration"][at] = vectors_to_carla(s.ax * c - s.ay * sn, s.ax * sn + s.ay * c, flat)
    signs = moving.signs()
    vehicles.heed(signs.limit.tolist())
    _fill_controls(rows, at, vehicles)
    _fill_governed(rows, at, signs.signal[:n], posts)
    held = at[red & ~rows.vehicles["has_light"][at].astype(np.bool_)]
    rows.vehicles["light_state"][held] = LightState.RED


def _fill_controls(rows: Rows, at: NDArray[np.int64], vehicles: Vehicles) -> None:
    """Writes controls, gears and speed limits in km/h of the vehicles into the snapshot rows `at`."""
    told = [vehicle.control for vehicle in vehicles]
    switches = np.array([(c.hand_brake, c.reverse, c.manual) for c in told])
    s = vehicles.moving.fleet.states
    along = (s.vx * np.cos(s.yaw) + s.vy * np.sin(s.yaw)).tolist()
    table = rows.vehicles
    table["control"][at] = [(c.throttle, wire.iso_steer(c.steer), c.brake) for c in told]
    table["switches"][at] = switches
    table["gear"][at] = [v.gear(speed) for v, speed in zip(vehicles, along, strict=False)]
    table["speed_limit"][at] = [kmh_from_mps(v.speed_limit) for v in vehicles]


def _fill_governed(rows: Rows, at: NDArray[np.int64], signals: Signals, posts: Posts) -> None:
    """Writes the traffic light that each vehicle must obey into the snapshot rows `at`.

    signals (n,): rows of the signal table, as `moving.signs` gives them.
    """
    states, has, ids = [], [], []
    for signal in signals.tolist():
        light = posts.lights.of_row.get(signal)
        states.append(NO_LIGHT_STATE if light is None else int(light.state))
        has.append(light is not None)
        ids.append(0 if light is None else posts.actor(light))
    table = rows.vehicles
    table["light_state"][at] = states
    table["has_light"][at] = has
    table["light_id"][at] = ids


def fill_lights(rows: Rows, actors: ActorTable, posts: Posts) -> None:
    """Fills the snapshot's rows with timers and lamps of traffic lights."""
    for actor, post in posts:
        row, light = rows.lights[actors.alive[actor].row], post.light
        row["times"] = (light.green, light.yellow, light.red, light.elapsed)
        row["frozen"] = posts.lights.is_frozen(light)
        row["shown"] = int(light.state)
