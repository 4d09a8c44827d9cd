"""What a client does to one actor of a world between two steps: move, push, hold or switch it."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, sin

import numpy as np

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.simulation.world.world import World


def teleport(world: World, id: int, pose: Pose) -> None:
    """Puts an actor elsewhere; its velocity is kept. Call the world's `settle` afterwards."""
    s, i = world.states, world.row(id)
    s.x[i], s.y[i], s.z[i] = pose.x, pose.y, pose.z
    s.yaw[i], s.pitch[i], s.roll[i] = wrap_angle(pose.yaw), pose.pitch, pose.roll
    world.placed["lane"][i] = -1


def set_velocity(world: World, id: int, vx: float, vy: float) -> None:
    """Sets an actor's velocity, m/s in world axes; wheels roll with it."""
    s, i = world.states, world.row(id)
    s.vx[i], s.vy[i] = vx, vy
    if i < world.wheeled:
        along = vx * cos(s.yaw[i]) + vy * sin(s.yaw[i])
        world.fleet.wheels.omega[i] = along / world.fleet.params.wheel_radius[i]


def walk(world: World, id: int, vx: float, vy: float) -> None:
    """Lets a body without wheels move with this velocity from now on, looking where it goes."""
    set_velocity(world, id, vx, vy)
    if vx or vy:
        world.states.yaw[world.row(id)] = atan2(vy, vx)


def push(
    world: World,
    id: int,
    impulse: tuple[float, float],
    point: tuple[float, float] | None = None,
) -> None:
    """Applies N s to a vehicle at a point of the world, None: its centre of gravity."""
    s, i = world.states, world.row(id)
    if point is None:
        x_cog = world.fleet.params.x_cog[i]
        point = (s.x[i] + x_cog * cos(s.yaw[i]), s.y[i] + x_cog * sin(s.yaw[i]))
    world.fleet.apply_impulse(i, impulse, point)


def twist(world: World, id: int, moment: float) -> None:
    """Applies an angular impulse about the vertical in N m s to a vehicle."""
    i = world.row(id)
    world.states.yaw_rate[i] += moment / world.fleet.params.yaw_inertia[i]


def hold_velocity(world: World, id: int, velocity: tuple[float, float] | None) -> None:
    """Holds forward and left speed of a vehicle against all forces; None: physics again."""
    world.rows.held[world.row(id)] = np.nan if velocity is None else velocity


def set_simulated(world: World, id: int, on: bool) -> None:
    """Switches an actor's physics; off, it stays where it is put, and nothing pushes it."""
    world.rows.simulated[world.row(id)] = on
    world.weigh()


def set_collides(world: World, id: int, on: bool) -> None:
    """Switches an actor's contacts; off, it passes through everything."""
    world.rows.collides[world.row(id)] = on


def set_grounded(world: World, id: int, on: bool) -> None:
    """Switches whether an actor's height follows the road."""
    world.rows.grounded[world.row(id)] = on


def set_tyres(world: World, id: int, friction: Sequence[float]) -> None:
    """Sets tire_friction of a vehicle at FL, FR, RL, RR outside friction zones."""
    world.wheel_grip.set_tyres(world.row(id), friction)
