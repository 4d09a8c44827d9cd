"""The server's truth as our states, from the client's own snapshot: no call per tick (A-266)."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, radians, sin
from typing import Any

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.maths.lefthanded import mirror_value, turn_from_carla
from skidpad.core.states import ActorStates, VehicleCommand
from skidpad.simulation.carla.actor_rows import ActorRow
from skidpad.simulation.carla.axes import from_transform, from_vector
from skidpad.simulation.carla.grip import Grip

EGO = 0


def read_states(players: Sequence[ActorRow], source: Any, out: ActorStates) -> None:
    """Fills `out` from a carla.WorldSnapshot, or from a carla.ActorList asked of the server.

    Rows of actors that are not there are set not present and keep their numbers.
    """
    ask = source.find
    for i, player in enumerate(players):
        seen = None if player.actor is None else ask(player.actor.id)
        out.present[i] = seen is not None
        if seen is not None:
            put_row(out, i, player, seen)


def put_row(out: ActorStates, i: int, player: ActorRow, seen: Any) -> None:
    """Writes row i; the motion of the footprint's centre is taken to be that of CARLA's origin."""
    pose = player.footprint(from_transform(seen.get_transform()))
    yaw = wrap_angle(pose.yaw)
    out.x[i], out.y[i], out.z[i], out.yaw[i] = pose.x, pose.y, pose.z, yaw
    out.pitch[i], out.roll[i] = pose.pitch, pose.roll
    out.vx[i], out.vy[i], _ = from_vector(seen.get_velocity())
    rate = seen.get_angular_velocity()  # deg/s
    out.yaw_rate[i] = radians(turn_from_carla(rate.x, rate.y, rate.z)[2])
    ax, ay, _ = from_vector(seen.get_acceleration())
    c, s = cos(yaw), sin(yaw)
    out.ax[i], out.ay[i] = ax * c + ay * s, ay * c - ax * s


def move_row(out: ActorStates, i: int, pose: Pose, v: float) -> None:
    """Writes row i as it shall be after a relocation that the server has not stepped yet; v: m/s."""
    out.x[i], out.y[i], out.z[i], out.yaw[i] = pose.x, pose.y, pose.z, wrap_angle(pose.yaw)
    out.pitch[i] = out.roll[i] = out.yaw_rate[i] = out.ax[i] = out.ay[i] = 0.0
    out.vx[i], out.vy[i] = v * cos(pose.yaw), v * sin(pose.yaw)


def read_commands(players: Sequence[ActorRow], ego: VehicleCommand, out: Floats) -> None:
    """Writes (n, 5) throttle, brake, steer, handbrake, reverse of the vehicles; rows of others stay.

    ego: the command that the ego was given.
    """
    for i, player in enumerate(players):
        if i == EGO or player.actor is None or not player.is_vehicle:
            continue
        c = player.actor.get_control()
        out[i] = (c.throttle, c.brake, mirror_value(c.steer), c.hand_brake, c.reverse)
    out[EGO] = (ego.throttle, ego.brake, ego.steer, ego.handbrake, ego.reverse)


def read_mu(players: Sequence[ActorRow], grip: Grip, states: ActorStates, out: Floats) -> None:
    """Writes the nominal friction at the tyres into out (n, 4); NaN where there is none."""
    out.fill(np.nan)
    for i, player in enumerate(players):
        if states.present[i] and player.is_vehicle:
            mu = grip.mu(hypot(states.vx[i], states.vy[i]))
            out[i] = mu * grip.scale(player.actor.id)


def along(states: ActorStates, i: int) -> float:
    """Returns the speed of row i along its body in m/s, negative backwards."""
    return float(states.vx[i] * cos(states.yaw[i]) + states.vy[i] * sin(states.yaw[i]))
