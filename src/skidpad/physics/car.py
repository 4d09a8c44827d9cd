"""One vehicle's parameters and inputs through a tick, as plain numbers for the kernels of `vehicle`."""

from __future__ import annotations

from math import cos
from typing import NamedTuple

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.maths.constants import G
from skidpad.physics.params import VehicleParams
from skidpad.physics.stability import Model
from skidpad.physics.tyre import RELAXATION_RADII
from skidpad.physics.wheel import Tyre

THROTTLE, BRAKE, STEER, HANDBRAKE, REVERSE = range(5)  # columns of commands


class Car(NamedTuple):
    """One vehicle's parameters and inputs through a tick, as plain numbers; SI."""

    mass: float
    weight: float  # N on the road
    yaw_inertia: float
    x_cog: float
    a: float
    b: float
    half_track: float
    cog_height: float
    roll_front: float
    drag: float
    throttle: float
    brake: float
    steer: float  # rad asked for of the road wheels at standstill
    handbrake: bool
    reverse: bool
    drive_front: float
    force_max: float
    power: float
    speed_max: float
    engine_drag: float
    torque_front: float  # N m per wheel at this pedal
    torque_rear: float
    torque_hand: float  # N m per rear wheel
    rolling: float
    front: Tyre
    rear: Tyre
    model: Model
    side: float  # N over the square of m/s, of the air
    side_turn: float  # N m over that
    anti_lock: bool  # ideal
    cycling: bool  # anti-lock brakes from wheel speeds
    stability: bool
    sensed: bool  # stability control from wheel speeds
    tips: bool
    lean: float  # rad per m/s^2
    roll_inertia: float  # m^2


@inner_kernel
def car_of(i: int, p: VehicleParams, command: Floats, grade: float, bank: float) -> Car:
    """Returns the parameters of vehicle i under this command (5,), on a road of this grade and bank."""
    brake = min(max(command[BRAKE], 0.0), 1.0)
    handbrake = command[HANDBRAKE] > 0.5
    radius, inertia = p.wheel_radius[i], p.wheel_inertia[i]
    relaxation = RELAXATION_RADII * radius
    wheelbase = p.a[i] + p.b[i]
    per_wheel = 0.5 * p.mass[i] * G / wheelbase
    # no control flow inside the call: numba takes no more than 30 arguments with it
    torque_hand = p.handbrake_torque[i] if handbrake else 0.0
    anti_lock, cycling = p.anti_lock[i], p.cycling[i]
    return Car(
        p.mass[i],
        p.mass[i] * G * cos(grade) * cos(bank),
        p.yaw_inertia[i],
        p.x_cog[i],
        p.a[i],
        p.b[i],
        0.5 * p.track[i],
        p.cog_height[i],
        p.roll_front[i],
        p.drag[i],
        min(max(command[THROTTLE], 0.0), 1.0),
        brake,
        min(max(command[STEER], -1.0), 1.0) * p.steer_max[i],
        handbrake,
        command[REVERSE] > 0.5,
        p.drive_front[i],
        p.force_max[i],
        p.power[i],
        p.speed_max[i],
        p.engine_drag[i],
        brake * p.brake_torque[i, 0],
        brake * p.brake_torque[i, 1],
        torque_hand,
        p.rolling[i],
        Tyre(p.stiffness[i, 0], per_wheel * p.b[i], relaxation, radius, inertia),
        Tyre(p.stiffness[i, 1], per_wheel * p.a[i], relaxation, radius, inertia),
        Model(
            wheelbase,
            (1.0 / p.stiffness[i, 0] - 1.0 / p.stiffness[i, 1]) / G,
            3.0 / p.stiffness[i, 1],
        ),
        p.side[i, 0],
        p.side[i, 1],
        anti_lock & ~cycling,
        anti_lock & cycling,
        p.stability[i],
        p.stability[i] & p.sensed[i],
        p.tips[i],
        p.roll_gradient[i],
        p.roll_inertia[i],
    )
