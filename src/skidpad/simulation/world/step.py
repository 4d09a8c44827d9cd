"""One step of the world as one compiled call: it allocates nothing, all room is in the arrays.

The order: drivers, friction, vehicles, other bodies, contacts; then ground and markings.
"""

from __future__ import annotations

from math import cos, isnan, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags, Floats
from skidpad.core.kernels.jit import Held, inner_kernel, kernel
from skidpad.core.states import ActorStates
from skidpad.physics.contact import Bodies, ContactLaw, Contacts, resolve_contacts
from skidpad.physics.grip import grip_of_row, mu_at, stiffness_at, water_drag
from skidpad.physics.params import STIFFNESS, WATER, VehicleParams, WheelStates
from skidpad.physics.segments import Segments
from skidpad.physics.types import TIRE_FRICTION_REFERENCE
from skidpad.physics.vehicle import step_vehicles
from skidpad.physics.wakes import Displacing, fill_air
from skidpad.roads.kernels import LaneArrays
from skidpad.simulation.world.ground import settle
from skidpad.simulation.world.rows import Rows
from skidpad.simulation.world.touch import Markings, cross_markings
from skidpad.simulation.world.traffic.care import Care
from skidpad.simulation.world.traffic.driver import drive_all
from skidpad.simulation.world.traffic.occupancy import Occupancy
from skidpad.simulation.world.traffic.path import wrapped
from skidpad.simulation.world.traffic.state import Drivers, Streets, View
from skidpad.simulation.world.traffic.zebras import note_walkers

DECIDE, MOVE, SETTLE = 1, 2, 4  # stages of a step; a scenario's words come before MOVE


class Wheeled(NamedTuple):
    """The vehicles, which are the first rows, as their physics needs them."""

    wheels: WheelStates
    params: VehicleParams
    tire_friction: Floats  # (w, 4)
    patched: Floats  # (w, 4) share of the grip that friction patches leave
    road_mu: Floats  # (w, 4) of a tyre with tire_friction 3.5
    grips: Floats  # (w, fields of GripParams), of each vehicle's tyres outside of patches
    patch_stiffness: Floats  # (w, 4) slip stiffness over the dry one in patches; below 0: no patch
    patch_film: Floats  # (w, 4) m of water in patches; below 0: no patch
    feel: Floats  # (w, 12) at the tyres, see `params`
    displacing: Displacing  # vehicles that push air aside
    air: Floats  # (w, 2) m/s of the air at each vehicle, in world axes
    active: Flags  # (w,) moved by physics in this step


class Rules(NamedTuple):
    """What holds in every step."""

    lights: NDArray[np.uint8]  # (K,) LightState by signal row
    law: ContactLaw
    free_choice: bool  # drivers draw branches instead of taking the straightest
    care: Care  # what drivers know of weather
    road_noise: float  # rad
    driving_only: bool


class Arena(NamedTuple):
    """Everything that a step reads and writes, until actors come or go."""

    rows: Rows
    moved: Flags  # (n,) put somewhere by a scenario in this step
    wheeled: Wheeled
    bodies: Bodies
    touchable: Flags  # (n,)
    segments: Segments
    touching: Contacts
    lanes: LaneArrays
    streets: Streets
    drivers: Drivers
    occupancy: Occupancy
    markings: Markings
    rules: Rules


@kernel
def advance(
    arena: Held[Arena], stages: int, tick: int, dt: float, substeps: int, wx: float, wy: float
) -> tuple[int, int]:
    """The asked stages of a step; returns contacts found, and markings crossed as bits.

    stages: DECIDE, MOVE, SETTLE as bits; dt: s; wx, wy: m/s of the air in world axes. Numbers cross
    into a kernel for nothing, a named tuple takes 2 us.
    """
    a = arena.value
    if stages & DECIDE:
        rows, rules = a.rows, a.rules
        note_walkers(a.streets, rows.placed)
        view = View(a.streets, a.occupancy, rows.placed, rules.lights, tick, dt,
                    rules.free_choice, rules.care)  # fmt: skip
        drive_all(view, a.drivers, rows.commands)
    return advance_undriven(arena, stages, tick, dt, substeps, wx, wy)


@kernel
def advance_undriven(
    arena: Held[Arena], stages: int, tick: int, dt: float, substeps: int, wx: float, wy: float
) -> tuple[int, int]:
    """The same without drivers: half as much to compile where there are none."""
    a = arena.value
    rows, rules = a.rows, a.rules
    touches = crossed = 0
    if stages & MOVE:
        _drive(rows, a.moved, a.wheeled, dt, substeps, wx, wy)
        _glide(rows, a.moved, len(a.wheeled.active), dt)
        states = _touchable(a)
        touches = resolve_contacts(states, a.bodies, a.segments, rules.law, dt, a.touching)
    if stages & SETTLE:
        settle(a.lanes, rows, rules.road_noise, rules.driving_only, tick)
        crossed = cross_markings(a.markings, a.lanes, rows.placed)
    return touches, crossed


@kernel
def feel_grip(rows: Rows, w: Wheeled) -> None:
    """Writes friction, stiffness and water at every wheel, by weather, patches and the tyres' own scale."""
    s = rows.states
    for i in range(len(w.active)):
        grip = grip_of_row(w.grips, i)
        v = sqrt(s.vx[i] * s.vx[i] + s.vy[i] * s.vy[i])
        mu, stiffness = mu_at(grip, v), stiffness_at(grip, v)
        for k in range(4):
            w.road_mu[i, k] = mu * w.patched[i, k]
            w.feel[i, k] = w.road_mu[i, k] * w.tire_friction[i, k] / TIRE_FRICTION_REFERENCE
            own, film = w.patch_stiffness[i, k], w.patch_film[i, k]
            w.feel[i, STIFFNESS + k] = stiffness if own < 0.0 else own
            depth = grip.film if film < 0.0 else film
            w.feel[i, WATER + k] = water_drag(depth, w.params.tyre_width[i], k >= 2)


@inner_kernel
def _drive(
    rows: Rows, moved: Flags, w: Wheeled, dt: float, substeps: int, wx: float, wy: float
) -> None:
    """Vehicles through their physics, or as they are told."""
    s = rows.states
    feel_grip(rows, w)
    for i in range(len(w.active)):
        w.active[i] = s.present[i] and rows.simulated[i] and not moved[i]
    fill_air(s, w.displacing, wx, wy, w.air)
    step_vehicles(
        s, w.wheels, w.params, rows.commands, w.feel, rows.grade, rows.bank, w.active,
        w.air, dt / substeps, substeps,
    )  # fmt: skip
    for i in range(len(w.active)):
        for k in range(4):
            rows.mu[i, k] = w.feel[i, k]
        forward, left = rows.held[i, 0], rows.held[i, 1]
        if not isnan(forward):
            c, sn = cos(s.yaw[i]), sin(s.yaw[i])
            s.vx[i], s.vy[i] = forward * c - left * sn, forward * sn + left * c
            for k in range(4):
                w.wheels.omega[i, k] = forward / w.params.wheel_radius[i]
        elif not rows.simulated[i]:
            s.vx[i] = s.vy[i] = s.yaw_rate[i] = s.ax[i] = s.ay[i] = 0.0


@inner_kernel
def _glide(rows: Rows, moved: Flags, first: int, dt: float) -> None:
    """Bodies without wheels that nobody placed keep their velocity."""
    s = rows.states
    for i in range(first, len(moved)):
        if s.present[i] and rows.simulated[i] and not moved[i]:
            s.x[i] += s.vx[i] * dt
            s.y[i] += s.vy[i] * dt
            yaw = wrapped(s.yaw[i] + s.yaw_rate[i] * dt)
            s.yaw[i] = yaw if yaw > -pi else pi


@inner_kernel
def _touchable(a: Arena) -> ActorStates:
    """Returns the states in which only actors that collide are present."""
    s = a.rows.states
    for i in range(len(a.touchable)):
        a.touchable[i] = s.present[i] and a.rows.collides[i]
    return ActorStates(
        s.x, s.y, s.z, s.yaw, s.pitch, s.roll, s.vx, s.vy, s.yaw_rate, s.ax, s.ay, a.touchable
    )
