"""Double-track vehicle dynamics for many vehicles at once.

A body with three degrees of freedom in the road plane, four wheel spins and a steering actuator;
quasi-static load transfer; wheels with combined-slip tyres (`wheel`, `tyre`); stability control
(`stability`) and roll-over (`rollover`) where a vehicle has it. Suspension travel is not modelled. How
far limit handling can be trusted: docs/physics.md. The equations are textbook ones (Newton and Euler
in the plane); tests compare them with an independent drift model and with laws of motion.
"""

from __future__ import annotations

from math import cos, exp, pi, sin, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.maths.constants import G
from skidpad.core.states import ActorStates
from skidpad.physics.antilock import PRESSURE, regulate
from skidpad.physics.car import Car, car_of
from skidpad.physics.loads import write_loads
from skidpad.physics.params import STIFFNESS, WATER, VehicleParams, WheelStates
from skidpad.physics.rollover import OVER, SLIDING, TILT, left_arm, tip
from skidpad.physics.sensed import limit_drive, note_motion, sensed_correction
from skidpad.physics.stability import Correction, Motion, correction
from skidpad.physics.tyre import V_SLIP_MIN
from skidpad.physics.wheel import Contact, Torques, turn

LOAD_TIME = 0.08  # s, lag of load transfer: body on its springs, heave and roll near 2 Hz
STEER_TIME = 0.05  # s, lag of the steering actuator
V_POWER_MIN = 1.0  # m/s, below which force is limited by the lowest gear only
V_CLUTCH = 3.0  # m/s, below which an automatic box takes the engine's drag off the wheels
V_REVERSE_MAX = 2.0  # m/s, forward speed above which reverse finds no drive
V_ABS_MIN = 1.5  # m/s, below which anti-lock brakes let wheels lock; ISO 21994 leaves it free
V_HOLD = 0.1  # m/s and rad/s, below which a braked vehicle comes to rest

# Share of the largest road-wheel angle at 0, 20, 60 and 120 km/h: CARLA's default steering curve.
V_CURVE_1, V_CURVE_2, V_CURVE_3 = 20.0 / 3.6, 60.0 / 3.6, 120.0 / 3.6


@kernel
def steer_share(speed: float) -> float:
    """Returns the share of the largest road-wheel angle that full steer gives at this speed in m/s."""
    if speed < V_CURVE_1:
        return 1.0 - 0.1 * speed / V_CURVE_1
    if speed < V_CURVE_2:
        return 0.9 - 0.1 * (speed - V_CURVE_1) / (V_CURVE_2 - V_CURVE_1)
    return 0.8 - 0.1 * min((speed - V_CURVE_2) / (V_CURVE_3 - V_CURVE_2), 1.0)


class Body(NamedTuple):
    """Motion of the centre of gravity in world axes."""

    x: float
    y: float
    yaw: float
    vx: float
    vy: float
    r: float
    a_x: float  # m/s^2, along the body


class Push(NamedTuple):
    """What all wheels together do."""

    x: float  # N along the body
    y: float
    moment: float  # N m
    held: float  # N that brakes could hold at standstill


@inner_kernel
def _slide(car: Car, u: float, v: float, r: float, feel: Floats, h: float) -> Push:
    """Returns what the road does to a body that lies on its side, at the places of its axles.

    u, v: m/s forward and left; r: rad/s; feel: friction of the wheels, of which SLIDING at most counts.
    """
    force_x, force_y, moment = 0.0, 0.0, 0.0
    for axle in range(2):
        arm = car.a if axle == 0 else -car.b
        load = car.weight * (car.b if axle == 0 else car.a) / (car.a + car.b)
        mu = min(SLIDING, 0.5 * (feel[2 * axle] + feel[2 * axle + 1]))
        side = v + r * arm
        speed = sqrt(u * u + side * side)
        # at most what stops it within the step
        most = min(mu, speed / (G * h)) * load / max(speed, V_HOLD * h)
        force_x -= most * u
        force_y -= most * side
        moment -= most * side * arm
    return Push(force_x, force_y, moment, 0.0)


@inner_kernel
def _drive(car: Car, u: float, speed: float, omega: Floats) -> float:
    """Returns the force of the engine at all driven wheels in N, negative in reverse.

    0 beyond its top speed, and in reverse while rolling forward at V_REVERSE_MAX or faster.
    """
    spin = car.drive_front * (omega[0] + omega[1]) + (1.0 - car.drive_front) * (omega[2] + omega[3])
    v = max(speed, 0.5 * abs(spin) * car.front.radius, V_POWER_MIN)
    if v > car.speed_max or (car.reverse and u >= V_REVERSE_MAX):
        return 0.0
    drive = car.throttle * min(car.force_max, car.power / v)
    return float(-drive if car.reverse else drive)


@inner_kernel
def _stability_correction(
    car: Car, u: float, v: float, r: float, steer: float, mu: Floats
) -> Correction:
    """Returns what stability control asks for, told the friction `mu` (4,); nothing without such control.

    u, v: m/s forward and left of the centre of gravity; r: rad/s.
    """
    if not car.stability:
        return Correction(0.0, False, 1.0)
    mean = 0.25 * (mu[0] + mu[1] + mu[2] + mu[3])
    slip = (v - car.b * r) / max(u, V_SLIP_MIN)
    return correction(Motion(u, r, slip, steer, mean), car.model)


@inner_kernel
def _sense(
    car: Car, memory: Floats, omega: Floats, r: float, a_load: Floats, steer: float, h: float
) -> Correction:
    """Returns what stability and traction control ask for from what the car measures; updates `memory`.

    They know wheel speeds omega, yaw rate r, specific force a_load behind its lag, and steer, by h s.
    """
    radius, half, pedal = car.front.radius, car.half_track, car.throttle > 0.0
    note_motion(memory, omega, radius, half, r, a_load[0], a_load[1], car.brake > 0.0, h)
    asked = sensed_correction(memory, car.model, car.b, r, a_load[1], steer, h)
    left = limit_drive(memory, omega, radius, half, r, car.drive_front, pedal, h)
    return Correction(asked.turn, asked.rear, min(asked.drive, left))


@inner_kernel
def _push(
    car: Car, u: float, v: float, r: float, a_x: float, drive: float, asked: Correction,
    steer: float, omega: Floats, slip_y: Floats, slide: Floats, load: Floats, feel: Floats,
    pressure: Floats, h: float,
) -> Push:  # fmt: skip
    """Returns what all four wheels do to the body through h seconds; writes omega, slip_y and slide (4,).

    u, v: m/s forward and left; r: rad/s; drive: N of the engine at all wheels.
    pressure: share of the brake torque that anti-lock brakes leave to each wheel, first four entries.
    """
    cd, sd = cos(steer), sin(steer)
    speed = sqrt(u * u + v * v)
    engine_drag = car.mass * car.engine_drag * (1.0 - car.throttle) * min(speed / V_CLUTCH, 1.0)
    twist = asked.turn * car.yaw_inertia / car.half_track * car.front.radius  # N m at a wheel
    low = car.rear.radius * min(feel[2], feel[3])  # N m over load: the rear wheels select low
    per_load = 2.0 * car.torque_front / max(load[0] + load[1], 1.0)
    force_x, force_y, moment, held = 0.0, 0.0, 0.0, 0.0
    for w in range(4):
        front, left = w < 2, w % 2 == 0
        tyre = car.front if front else car.rear
        arm_x = car.a if front else -car.b
        arm_y = car.half_track if left else -car.half_track
        share = 0.5 * (car.drive_front if front else 1.0 - car.drive_front)
        vx, vy = u - r * arm_y, v + r * arm_x
        if front:
            vx, vy = vx * cd + vy * sd, vy * cd - vx * sd
        brake = car.torque_front if front else car.torque_rear
        if car.stability:
            if not front:
                brake = min(brake, per_load * load[w])
                if not car.cycling and not car.sensed:
                    brake = min(brake, low * load[w])
            if asked.rear != front:
                brake = max(brake + (twist if left else -twist), 0.0)
        left_on = 1.0  # share of brake torque and engine drag that anti-lock brakes leave on
        if car.cycling and speed > V_ABS_MIN:
            left_on = pressure[PRESSURE + w]
            brake *= left_on
        wheel = turn(
            Contact(vx, vy, omega[w], slip_y[w], load[w], feel[w], feel[STIFFNESS + w]),
            tyre,
            Torques(
                share * drive,
                brake,
                0.0 if front else car.torque_hand,
                car.rolling,
                share * engine_drag * left_on,
                tyre.inertia * abs(a_x) / tyre.radius,
                car.anti_lock and speed > V_ABS_MIN,
                car.stability and not car.sensed,
            ),
            h,
        )
        omega[w], slip_y[w], slide[w] = wheel.omega, wheel.slip_y, wheel.slide
        f_x, f_y = wheel.f_x - feel[WATER + w] * abs(vx) * vx, wheel.f_y
        if front:
            f_x, f_y = f_x * cd - f_y * sd, f_x * sd + f_y * cd
        force_x += f_x
        force_y += f_y
        moment += arm_x * f_y - arm_y * f_x
        held += wheel.held
    return Push(force_x, force_y, moment, held)


@inner_kernel
def _advance(
    i: int, states: ActorStates, wheels: WheelStates, car: Car, feel: Floats, g_x: float,
    g_y: float, turn_max: float, wind_x: float, wind_y: float, h: float, steps: int,
) -> None:  # fmt: skip
    """Moves vehicle i on through `steps` substeps of h seconds, in `states` and `wheels`.

    feel (12,): as in `params`; g_x, g_y: m/s^2 of a slope; turn_max: rad of the road wheels per substep.
    wind_x, wind_y: m/s of the air in the world.
    """
    windy, memory = wind_x != 0.0 or wind_y != 0.0, wheels.memory[i]
    steer_lag, load_lag = 1.0 - exp(-h / STEER_TIME), 1.0 - exp(-h / LOAD_TIME)
    omega, load, a_load = wheels.omega[i], wheels.load[i], wheels.a_load[i]
    body = _body(i, states, car.x_cog)
    x, y, yaw, vx, vy, r, a_x = body
    c, s = cos(yaw), sin(yaw)
    steer = wheels.steer[i]
    for _ in range(steps):
        u, v = vx * c + vy * s, vy * c - vx * s
        speed = sqrt(u * u + v * v)
        change = (car.steer * steer_share(speed) - steer) * steer_lag
        steer += min(max(change, -turn_max), turn_max)
        write_loads(car, a_load[0], a_load[1], load)
        if car.sensed:
            asked = _sense(car, memory, omega, r, a_load, steer, h)
        else:
            asked = _stability_correction(car, u, v, r, steer, feel)
        drive = _drive(car, u, speed, omega) * asked.drive
        if car.cycling:
            pedal = car.brake > 0.0 or (car.sensed and asked.turn != 0.0)
            regulate(memory, omega, car.front.radius, car.half_track, r, g_x - a_x, pedal, h)
        if memory[OVER] > 0.0:
            push = _slide(car, u, v, r, feel, h)
        else:
            push = _push(car, u, v, r, a_x, drive, asked, steer, omega, wheels.slip_y[i],
                         wheels.slide[i], load, feel, memory, h)  # fmt: skip
        u_air, v_air = u - (wind_x * c + wind_y * s), v - (wind_y * c - wind_x * s)
        air = sqrt(u_air * u_air + v_air * v_air)
        a_load[0] += load_lag * (push.x / car.mass - a_load[0])
        a_load[1] += load_lag * (push.y / car.mass - a_load[1])
        if car.tips and memory[OVER] == 0.0:
            arm = left_arm(car.half_track, car.cog_height, car.lean, a_load[1])
            down = car.weight / car.mass
            tip(memory, a_load[1], down, arm, car.cog_height, car.roll_inertia, h)
        a_x = (push.x - car.drag * air * u_air) / car.mass + g_x
        side, moment = car.drag * speed * v, push.moment
        if windy:
            side = car.side * air * v_air
            moment -= car.side_turn * u_air * v_air + 0.5 * (car.a - car.b) * side
        a_y = (push.y - side) / car.mass + g_y
        vx += h * (a_x * c - a_y * s)
        vy += h * (a_x * s + a_y * c)
        r += h * moment / car.yaw_inertia
        slow = speed < V_HOLD and abs(r) < V_HOLD and (car.brake > 0.0 or car.handbrake)
        if slow and push.held >= car.mass * sqrt(g_x * g_x + g_y * g_y) + abs(drive):
            vx, vy, r = 0.0, 0.0, 0.0
            omega[:] = 0.0
        x += h * vx
        y += h * vy
        yaw += h * r
        c, s = cos(yaw), sin(yaw)
    wheels.steer[i] = steer
    _keep(i, states, Body(x, y, yaw, vx, vy, r, a_x), car.x_cog, h * steps)


@inner_kernel
def _body(i: int, states: ActorStates, x_cog: float) -> Body:
    """Returns the motion of vehicle i at its centre of gravity."""
    yaw, r = states.yaw[i], states.yaw_rate[i]
    c, s = cos(yaw), sin(yaw)
    return Body(
        states.x[i] + x_cog * c,
        states.y[i] + x_cog * s,
        yaw,
        states.vx[i] - r * x_cog * s,
        states.vy[i] + r * x_cog * c,
        r,
        states.ax[i],
    )


@inner_kernel
def _keep(i: int, states: ActorStates, body: Body, x_cog: float, dt: float) -> None:
    """Writes the motion of vehicle i at its reference point, dt seconds after what is stored."""
    c, s = cos(body.yaw), sin(body.yaw)
    states.yaw[i] = pi - (pi - body.yaw) % (2.0 * pi)
    states.x[i] = body.x - x_cog * c
    states.y[i] = body.y - x_cog * s
    vx = body.vx + body.r * x_cog * s
    vy = body.vy - body.r * x_cog * c
    ax, ay = (vx - states.vx[i]) / dt, (vy - states.vy[i]) / dt
    states.ax[i] = ax * c + ay * s
    states.ay[i] = ay * c - ax * s
    states.vx[i], states.vy[i], states.yaw_rate[i] = vx, vy, body.r


@inner_kernel
def _lean(lean: float, memory: Floats) -> float:
    """Returns the roll in rad of a body that may tip: on its springs, or about its outer wheels.

    lean: rad on its springs, left out once it lies on its side.
    """
    return float(memory[TILT]) + (0.0 if memory[OVER] > 0.0 else lean)


@kernel
def step_vehicles(
    states: ActorStates,
    wheels: WheelStates,
    params: VehicleParams,
    commands: Floats,
    feel: Floats,
    grade: Floats,
    bank: Floats,
    active: NDArray[np.bool_],
    air: Floats,
    h: float,
    steps: int,
) -> None:
    """Moves all active vehicles on through one tick of `steps` substeps of h seconds, in place.

    commands (n, 5): throttle, brake, steer (left positive), handbrake, reverse. feel (n, 12): `params`.
    grade (n,): slope along the heading, rad, uphill positive. bank (n,): roll of the
    road about the heading, rad, left side up positive. air (n, 2): its velocity at each vehicle, m/s
    in world axes.
    """
    for i in range(active.shape[0]):
        if active[i]:
            car = car_of(i, params, commands[i], grade[i], bank[i])
            g_x, g_y = -G * sin(grade[i]), -G * sin(bank[i])
            turn_max = params.steer_rate[i] * h
            _advance(i, states, wheels, car, feel[i], g_x, g_y, turn_max, air[i, 0], air[i, 1],
                     h, steps)  # fmt: skip
            states.pitch[i] = -grade[i] - params.pitch_gradient[i] * wheels.a_load[i, 0]
            lean = params.roll_gradient[i] * wheels.a_load[i, 1]
            states.roll[i] = bank[i] + (
                lean if not params.tips[i] else _lean(lean, wheels.memory[i])
            )
