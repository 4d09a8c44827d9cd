"""Double-track vehicle dynamics for many vehicles at once.

A body with three degrees of freedom in the road plane, four wheel spins and a steering actuator;
quasi-static load transfer; combined-slip tyres (`tyre`). Wheel spin is integrated semi-implicitly
with the secant of the tyre curve, so locking and spin-up stay stable at steps of 10 ms. Rollover
and suspension travel are not modelled; limit handling is bounded, not validated (docs/physics.md).
Sources: Milliken and Milliken, Race Car Vehicle Dynamics (1995), chapters 5 and 18; Pacejka, Tire
and Vehicle Dynamics (2012), chapter 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, exp, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.constants import G
from skidpad.core.jit import kernel
from skidpad.core.states import ActorStates
from skidpad.physics.types import VehicleType
from skidpad.physics.tyre import V_SLIP_MIN, brush_secant

Floats = NDArray[np.float64]

AIR_DENSITY = 1.225  # kg/m^3, ISO 2533 at sea level
LOAD_TIME = 0.08  # s, lag of load transfer: body on its springs, heave and roll near 2 Hz
STEER_TIME = 0.05  # s, lag of the steering actuator
V_POWER_MIN = 1.0  # m/s, below which force is limited by the lowest gear only
V_CLUTCH = 3.0  # m/s, below which an automatic box takes the engine's drag off the wheels
V_REVERSE_MAX = 2.0  # m/s, forward speed above which reverse finds no drive
V_ABS_MIN = 1.5  # m/s, below which anti-lock brakes let wheels lock; ISO 21994 leaves it free
ABS_UTILISATION = 0.99  # of the grip that the idealised slip control keeps
ABS_RELEASE = 0.6  # of the grip, while a wheel is past its peak
DRAG_CONTROL = 0.5  # of the grip, most that engine drag takes with anti-lock brakes; our assumption
MU_MIN = 1e-6  # keeps slip over grip finite
V_HOLD = 0.1  # m/s and rad/s, below which a braked vehicle comes to rest

THROTTLE, BRAKE, STEER, HANDBRAKE, REVERSE = range(5)  # columns of commands

# Share of the largest road-wheel angle at 0, 20, 60 and 120 km/h: CARLA's default steering curve.
V_CURVE_1, V_CURVE_2, V_CURVE_3 = 20.0 / 3.6, 60.0 / 3.6, 120.0 / 3.6


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
    drive_front: Floats
    power: Floats
    force_max: Floats
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
    anti_lock: NDArray[np.bool_]


class WheelStates(NamedTuple):
    """What a vehicle remembers beside its motion, and what it tells about its tyres."""

    omega: Floats  # (n, 4) wheel spin, rad/s: FL, FR, RL, RR
    steer: Floats  # (n,) road-wheel angle
    a_load: Floats  # (n, 2) specific force behind the load transfer, low-passed
    slide: Floats  # (n, 4) slip over the slip of full sliding; beyond 1 the tyre slides
    load: Floats  # (n, 4) N


def vehicle_params(types: Sequence[VehicleType]) -> VehicleParams:
    """Parameters of these vehicles, in their order."""

    def column(values: list[float]) -> Floats:
        return np.array(values, dtype=np.float64)

    return VehicleParams(
        mass=column([t.mass for t in types]),
        yaw_inertia=column([t.yaw_inertia for t in types]),
        x_cog=column([t.x_cog for t in types]),
        a=column([t.x_front_axle - t.x_cog for t in types]),
        b=column([t.x_cog - t.x_rear_axle for t in types]),
        track=column([t.track for t in types]),
        cog_height=column([t.cog_height for t in types]),
        wheel_radius=column([t.wheel_radius for t in types]),
        wheel_inertia=column([t.wheel_inertia for t in types]),
        drive_front=column([t.drive_share_front for t in types]),
        power=column([t.power for t in types]),
        force_max=column([t.force_max for t in types]),
        engine_drag=column([t.engine_drag for t in types]),
        brake_torque=np.array(
            [(t.brake_torque_front, t.brake_torque_rear) for t in types], dtype=np.float64
        ).reshape(-1, 2),
        handbrake_torque=column([t.handbrake_torque for t in types]),
        steer_max=column([t.steer_max for t in types]),
        steer_rate=np.radians(column([t.steer_rate_deg for t in types])),
        drag=0.5 * AIR_DENSITY * column([t.drag_area for t in types]),
        rolling=column([t.rolling_resistance for t in types]),
        stiffness=np.array(
            [(t.stiffness_front, t.stiffness_rear) for t in types], dtype=np.float64
        ).reshape(-1, 2),
        roll_front=column([t.roll_share_front for t in types]),
        pitch_gradient=column([t.pitch_gradient for t in types]),
        roll_gradient=column([t.roll_gradient for t in types]),
        anti_lock=np.array([t.abs for t in types], dtype=np.bool_),
    )


@kernel
def steer_share(speed: float) -> float:
    """Share of the largest road-wheel angle that full steer gives at this speed."""
    if speed < V_CURVE_1:
        return 1.0 - 0.1 * speed / V_CURVE_1
    if speed < V_CURVE_2:
        return 0.9 - 0.1 * (speed - V_CURVE_1) / (V_CURVE_2 - V_CURVE_1)
    return 0.8 - 0.1 * min((speed - V_CURVE_2) / (V_CURVE_3 - V_CURVE_2), 1.0)


@kernel
def _wheel_loads(
    i: int, p: VehicleParams, weight: float, a_x: float, a_y: float, load: Floats
) -> None:
    """Quasi-static vertical loads into `load[i]`; an axle or a wheel never pulls on the road."""
    wheelbase = p.a[i] + p.b[i]
    front = weight * p.b[i] / wheelbase - p.mass[i] * a_x * p.cog_height[i] / wheelbase
    front = min(max(front, 0.0), weight)
    moment = p.mass[i] * a_y * p.cog_height[i] / p.track[i]
    for axle in range(2):
        axle_load = front if axle == 0 else weight - front
        share = p.roll_front[i] if axle == 0 else 1.0 - p.roll_front[i]
        transfer = min(max(share * moment, -0.5 * axle_load), 0.5 * axle_load)
        load[i, 2 * axle] = 0.5 * axle_load - transfer
        load[i, 2 * axle + 1] = 0.5 * axle_load + transfer


@kernel
def _brake_limit(grip: float, slide: float, s_x: float, v_x: float) -> float:
    """Longest brake force that the idealised slip control lets through at a wheel, N."""
    past_peak = slide > 1.0 and s_x * v_x < 0.0
    return grip * (ABS_RELEASE if past_peak else ABS_UTILISATION)


@kernel
def _spin(
    omega: float, drive: float, resist: float, k: float, v_x: float, radius: float, inertia: float,
    h: float,
) -> float:  # fmt: skip
    """Wheel spin after h seconds: implicit in the tyre (k in N per m/s), Coulomb in `resist`."""
    denominator = inertia + h * radius * radius * k
    free = (inertia * omega + h * (drive + radius * k * v_x)) / denominator
    loss = h * resist / denominator
    if abs(free) <= loss:
        return 0.0
    return free - loss if free > 0.0 else free + loss


@kernel
def _advance(
    i: int,
    states: ActorStates,
    wheels: WheelStates,
    p: VehicleParams,
    command: Floats,
    mu: Floats,
    grade: float,
    bank: float,
    h: float,
    steps: int,
) -> None:
    """Vehicle i through `steps` substeps of h seconds. command (5,), mu (4,)."""
    mass, radius = p.mass[i], p.wheel_radius[i]
    throttle = min(max(command[THROTTLE], 0.0), 1.0)
    brake = min(max(command[BRAKE], 0.0), 1.0)
    steer_command = min(max(command[STEER], -1.0), 1.0) * p.steer_max[i]
    handbrake = command[HANDBRAKE] > 0.5
    reverse = command[REVERSE] > 0.5
    weight = mass * G * cos(grade) * cos(bank)
    g_x, g_y = -G * sin(grade), -G * sin(bank)
    g_plane = mass * sqrt(g_x * g_x + g_y * g_y)
    steer_lag, load_lag = 1.0 - exp(-h / STEER_TIME), 1.0 - exp(-h / LOAD_TIME)
    omega, slide, load = wheels.omega, wheels.slide, wheels.load

    yaw, r = states.yaw[i], states.yaw_rate[i]
    c, s = cos(yaw), sin(yaw)
    x = states.x[i] + p.x_cog[i] * c
    y = states.y[i] + p.x_cog[i] * s
    vx = states.vx[i] - r * p.x_cog[i] * s
    vy = states.vy[i] + r * p.x_cog[i] * c
    a_x = states.ax[i]

    for _ in range(steps):
        u = vx * c + vy * s
        v = vy * c - vx * s
        speed = sqrt(u * u + v * v)
        target = steer_command * steer_share(speed)
        turn = (target - wheels.steer[i]) * steer_lag
        turn_max = p.steer_rate[i] * h
        wheels.steer[i] += min(max(turn, -turn_max), turn_max)
        cd, sd = cos(wheels.steer[i]), sin(wheels.steer[i])
        _wheel_loads(i, p, weight, wheels.a_load[i, 0], wheels.a_load[i, 1], load)

        spin = p.drive_front[i] * (omega[i, 0] + omega[i, 1])
        spin += (1.0 - p.drive_front[i]) * (omega[i, 2] + omega[i, 3])
        v_drive = max(speed, 0.5 * abs(spin) * radius, V_POWER_MIN)
        drive = throttle * min(p.force_max[i], p.power[i] / v_drive)
        if reverse:
            drive = -drive if u < V_REVERSE_MAX else 0.0
        engine_drag = mass * p.engine_drag[i] * (1.0 - throttle) * min(speed / V_CLUTCH, 1.0)

        force_x, force_y, moment, holding = 0.0, 0.0, 0.0, 0.0
        for w in range(4):
            front = w < 2
            axle = 0 if front else 1
            arm_x = p.a[i] if front else -p.b[i]
            arm_y = 0.5 * p.track[i] if w % 2 == 0 else -0.5 * p.track[i]
            share = 0.5 * (p.drive_front[i] if front else 1.0 - p.drive_front[i])
            vx_w = u - r * arm_y
            vy_w = v + r * arm_x
            if front:
                vx_w, vy_w = vx_w * cd + vy_w * sd, vy_w * cd - vx_w * sd
            rim = omega[i, w] * radius
            per_speed = 1.0 / max(sqrt(vx_w * vx_w + vy_w * vy_w), abs(rim), V_SLIP_MIN)
            s_x = (rim - vx_w) * per_speed
            s_y = -vy_w * per_speed
            grip = mu[w] * load[i, w]
            sigma = p.stiffness[i, axle] * sqrt(s_x * s_x + s_y * s_y) / (3.0 * max(mu[w], MU_MIN))
            slide[i, w] = sigma
            k = p.stiffness[i, axle] * load[i, w] * brush_secant(sigma)

            engine = share * engine_drag
            if p.anti_lock[i]:
                engine = min(engine, DRAG_CONTROL * grip)
            drag = radius * (p.rolling[i] * load[i, w] + engine)
            braking = brake * p.brake_torque[i, axle]
            if p.anti_lock[i] and speed > V_ABS_MIN:
                limit = radius * _brake_limit(grip, sigma, s_x, vx_w)
                own = p.wheel_inertia[i] * abs(a_x) / radius  # to slow the wheel itself
                braking = min(braking, max(limit + own - drag, 0.0))
            if handbrake and not front:
                braking += p.handbrake_torque[i]
            holding += min(braking / radius, grip)
            omega[i, w] = _spin(
                omega[i, w], share * drive * radius, braking + drag, k * per_speed, vx_w, radius,
                p.wheel_inertia[i], h,
            )  # fmt: skip
            # Body and wheel feel the same force, that of the new spin; the secant may overshoot.
            f_x = k * (omega[i, w] * radius - vx_w) * per_speed
            f_y = k * s_y
            square = f_x * f_x + f_y * f_y
            if square > grip * grip:
                cut = grip / sqrt(square)
                f_x, f_y = f_x * cut, f_y * cut
            if front:
                f_x, f_y = f_x * cd - f_y * sd, f_x * sd + f_y * cd
            force_x += f_x
            force_y += f_y
            moment += arm_x * f_y - arm_y * f_x

        a_x = (force_x - p.drag[i] * speed * u) / mass
        a_y = (force_y - p.drag[i] * speed * v) / mass
        wheels.a_load[i, 0] += load_lag * (force_x / mass - wheels.a_load[i, 0])
        wheels.a_load[i, 1] += load_lag * (force_y / mass - wheels.a_load[i, 1])
        a_x += g_x
        a_y += g_y
        vx += h * (a_x * c - a_y * s)
        vy += h * (a_x * s + a_y * c)
        r += h * moment / p.yaw_inertia[i]
        slow = speed < V_HOLD and abs(r) < V_HOLD
        if slow and (brake > 0.0 or handbrake) and holding >= g_plane + abs(drive):
            vx, vy, r = 0.0, 0.0, 0.0
            omega[i, :] = 0.0
        x += h * vx
        y += h * vy
        yaw += h * r
        c, s = cos(yaw), sin(yaw)

    states.yaw[i] = pi - (pi - yaw) % (2.0 * pi)
    states.x[i] = x - p.x_cog[i] * c
    states.y[i] = y - p.x_cog[i] * s
    vx_new = vx + r * p.x_cog[i] * s
    vy_new = vy - r * p.x_cog[i] * c
    ax_world = (vx_new - states.vx[i]) / (h * steps)
    ay_world = (vy_new - states.vy[i]) / (h * steps)
    states.ax[i] = ax_world * c + ay_world * s
    states.ay[i] = ay_world * c - ax_world * s
    states.vx[i], states.vy[i], states.yaw_rate[i] = vx_new, vy_new, r
    states.pitch[i] = -grade - p.pitch_gradient[i] * wheels.a_load[i, 0]
    states.roll[i] = bank + p.roll_gradient[i] * wheels.a_load[i, 1]


@kernel
def step_vehicles(
    states: ActorStates,
    wheels: WheelStates,
    params: VehicleParams,
    commands: Floats,
    mu: Floats,
    grade: Floats,
    bank: Floats,
    active: NDArray[np.bool_],
    h: float,
    steps: int,
) -> None:
    """All active vehicles through one tick of `steps` substeps of h seconds, in place.

    commands (n, 5): throttle, brake, steer (left positive), handbrake, reverse. mu (n, 4) at FL,
    FR, RL, RR. grade (n,): slope along the heading, rad, uphill positive. bank (n,): roll of the
    road about the heading, rad, left side up positive.
    """
    for i in range(active.shape[0]):
        if active[i]:
            _advance(
                i, states, wheels, params, commands[i], mu[i], grade[i], bank[i], h, steps
            )  # fmt: skip
