"""What the kernels need about vehicles, and what vehicles remember, as arrays of many at once."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.physics.rollover import roll_inertias
from skidpad.physics.types import VehicleType
from skidpad.physics.wind import AIR_DENSITY, side_coefficients


class VehicleParams(NamedTuple):
    """What the kernels need about n vehicles, arrays of shape (n,) unless noted; see VehicleType."""

    mass: Floats
    yaw_inertia: Floats
    x_cog: Floats
    a: Floats  # centre of gravity to front axle
    b: Floats  # to rear axle
    track: Floats
    cog_height: Floats
    wheel_radius: Floats
    wheel_inertia: Floats
    tyre_width: Floats
    drive_front: Floats
    power: Floats
    force_max: Floats
    speed_max: Floats
    engine_drag: Floats
    brake_torque: Floats  # (n, 2) per wheel, front and rear
    handbrake_torque: Floats
    steer_max: Floats
    steer_rate: Floats
    drag: Floats  # 0.5 rho cw A
    rolling: Floats
    stiffness: Floats  # (n, 2)
    roll_front: Floats
    pitch_gradient: Floats
    roll_gradient: Floats
    side: Floats  # (n, 2) 0.5 rho A c of side force and, times the wheelbase, of yaw moment; `wind`
    anti_lock: NDArray[np.bool_]
    cycling: NDArray[np.bool_]  # anti-lock brakes work from wheel speeds
    stability: NDArray[np.bool_]  # stability and traction control, brake-force distribution
    sensed: NDArray[np.bool_]  # that control works from wheel speeds, `sensed`
    roll_inertia: Floats  # m^2, about the outer wheels, over the mass; `rollover`
    tips: NDArray[np.bool_]  # it can roll over


class WheelStates(NamedTuple):
    """What a vehicle remembers beside its motion, and what it tells about its tyres."""

    omega: Floats  # (n, 4) wheel spin, rad/s: FL, FR, RL, RR
    steer: Floats  # (n,) road-wheel angle
    slip_y: Floats  # (n, 4) lateral slip that the tyres feel, behind the contact patch
    a_load: Floats  # (n, 2) specific force behind the load transfer, low-passed
    slide: Floats  # (n, 4) slip over the slip of full sliding; beyond 1 the tyre slides
    load: Floats  # (n, 4) N
    memory: Floats  # (n, MEMORY) of controls and of tipping: `antilock`, `rollover`, `sensed`


# Columns of what the road does to the tyres, (n, 12), each for FL, FR, RL, RR: friction at nominal
# load, slip stiffness over that on a dry road, and drag of water in N over the square of the speed
# in m/s, against the wheel's rolling. One array, as every further one costs each vehicle 0.03 us.
STIFFNESS, WATER, FEEL = 4, 8, 12


ALIKE = (  # parameters that a VehicleType has under the same name
    "mass", "yaw_inertia", "x_cog", "track", "cog_height", "wheel_radius", "wheel_inertia",
    "tyre_width", "power", "force_max", "engine_drag", "handbrake_torque", "steer_max",
    "pitch_gradient", "roll_gradient",
)  # fmt: skip


def vehicle_params(types: Sequence[VehicleType]) -> VehicleParams:
    """Returns the parameters of these vehicles, in their order.

    cycling, stability, sensed and tips are off; the fleet sets them.
    """

    def column(values: list[float]) -> Floats:
        return np.array(values, dtype=np.float64)

    alike: dict[str, Any] = {name: column([getattr(t, name) for t in types]) for name in ALIKE}
    return VehicleParams(
        **alike,
        a=column([t.x_front_axle - t.x_cog for t in types]),
        b=column([t.x_cog - t.x_rear_axle for t in types]),
        drive_front=column([t.drive_share_front for t in types]),
        speed_max=column([inf if t.speed_max is None else t.speed_max for t in types]),
        brake_torque=np.array(
            [(t.brake_torque_front, t.brake_torque_rear) for t in types], dtype=np.float64
        ).reshape(-1, 2),
        steer_rate=np.radians(column([t.steer_rate_deg for t in types])),
        drag=0.5 * AIR_DENSITY * column([t.drag_area for t in types]),
        rolling=column([t.rolling_resistance for t in types]),
        stiffness=np.array(
            [(t.stiffness_front, t.stiffness_rear) for t in types], dtype=np.float64
        ).reshape(-1, 2),
        roll_front=column([t.roll_share_front for t in types]),
        side=side_coefficients(types),
        anti_lock=np.array([t.abs for t in types], dtype=np.bool_),
        cycling=np.zeros(len(types), dtype=np.bool_),
        stability=np.zeros(len(types), dtype=np.bool_),
        sensed=np.zeros(len(types), dtype=np.bool_),
        roll_inertia=roll_inertias(types),
        tips=np.zeros(len(types), dtype=np.bool_),
    )
