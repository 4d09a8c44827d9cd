"""Drivers of scripted actors: from a demanded speed and path to pedals and steer, through the tyres.

A scenario player says where an actor should be; this driver tries, and the road decides how well it
succeeds. On every backend, as it only sees poses and velocities.
"""

from __future__ import annotations

from math import atan, cos, hypot, sin
from typing import NamedTuple

from msgspec import Struct

from skidpad.core.errors import ConfigError
from skidpad.core.kernels.jit import Held, hold, inner_kernel, kernel
from skidpad.core.maths.constants import G
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import ActorKind
from skidpad.physics.types import VehicleType, vehicle_type, vehicle_types
from skidpad.physics.vehicle import V_CLUTCH, steer_share
from skidpad.physics.wind import AIR_DENSITY

OMEGA, ZETA = 1.2, 0.9  # rad/s and damping of the lateral control, half the yaw response's
V_LATERAL_MIN = 4.0  # m/s, keeps gains finite at walking speed
A_LATERAL_MAX = 7.0  # m/s^2, the most that a driver steers for
SPEED_GAIN = 1.2  # 1/s
V_STANDING = 0.3  # m/s
HOLD_BRAKE = 0.6
LOOK_BACK, LOOK_BACK_TIME = 5.0, 1.5  # m at least, and s, over which a reversing driver corrects


class Demand(Struct, frozen=True):
    """What a scenario asks of an actor in a tick, relative to a point of its path."""

    v: float  # m/s
    a: float  # m/s^2, rate of v
    curvature: float  # 1/m of the path
    error: float  # m, the actor lies left of where it should be
    error_rate: float  # m/s
    a_lateral: float  # m/s^2 of the demanded sideways motion
    reverse: bool = False  # the actor shall go backwards


class Motion(Struct, frozen=True):
    """State of an actor as its driver knows it."""

    x: float
    y: float
    yaw: float
    vx: float
    vy: float

    @property
    def speed(self) -> float:
        """Returns the speed along the body, m/s."""
        return self.vx * cos(self.yaw) + self.vy * sin(self.yaw)


class Hands(NamedTuple):
    """What a driver knows of its vehicle, and how firmly it corrects; SI."""

    speed_gain: float  # 1/s
    omega: float  # rad/s
    a_drive: float
    p_drive: float  # W/kg
    a_brake: float
    drag: float  # 1/m
    rolling: float  # m/s^2
    engine_drag: float  # m/s^2
    wheelbase: float
    steer_max: float  # rad
    understeer: float  # rad s^2/m


class ActorDriver:
    """Feedforward through the vehicle's own dynamics plus feedback; no state between ticks.

    skill: scales both gains, 1 is nominal; repeats of a scenario vary it.
    """

    def __init__(self, kind: str, skill: float = 1.0) -> None:
        t = vehicle_type(kind)
        self.type = t
        self.own_hands = Hands(
            speed_gain=SPEED_GAIN * skill,
            omega=OMEGA * skill,
            a_drive=t.a_drive,
            p_drive=t.power / t.mass,
            a_brake=t.a_brake,
            drag=0.5 * AIR_DENSITY * t.drag_area / t.mass,
            rolling=t.rolling_resistance * G,
            engine_drag=t.engine_drag,
            wheelbase=t.wheelbase,
            steer_max=t.steer_max,
            understeer=t.understeer,
        )
        self.hands = hold(self.own_hands)

    def command(self, motion: Motion, demand: Demand) -> VehicleCommand:
        """Returns pedals and steer for the coming step."""
        d = demand
        if d.reverse and motion.speed < V_STANDING:
            return self._backwards(motion, d)
        return VehicleCommand(
            *drive_forwards(
                self.hands, motion.yaw, motion.vx, motion.vy, d.v, d.a, d.curvature, d.error,
                d.error_rate, d.a_lateral,
            )
        )  # fmt: skip

    def _backwards(self, motion: Motion, d: Demand) -> VehicleCommand:
        """Returns pedals as forwards, seen the other way round; steer leads the rear axle to the path.

        Over the way driven the offset obeys e'' = -2 (e + L e') / L^2, as in pure pursuit.
        """
        v, look = abs(motion.speed), max(LOOK_BACK, LOOK_BACK_TIME * abs(motion.speed))
        throttle, brake = press_pedals(self.hands, -motion.speed, -d.v, -d.a)
        slope = d.error_rate / max(v, V_STANDING)
        kappa = d.curvature - 2.0 * (d.error + look * slope) / (look * look)
        angle = atan(self.type.wheelbase * kappa)
        steer = min(max(angle / (self.type.steer_max * steer_share(v)), -1.0), 1.0)
        return VehicleCommand(throttle=throttle, brake=brake, steer=float(steer), reverse=True)


@kernel
def drive_forwards(
    held: Held[Hands],
    yaw: float,
    vx: float,
    vy: float,
    v_told: float,
    a_told: float,
    curvature: float,
    error: float,
    error_rate: float,
    a_lateral: float,
) -> tuple[float, float, float]:
    """Returns throttle, brake and steer for a motion and what is asked, as in `Motion` and `Demand`."""
    return drive_by(
        held.value, yaw, vx, vy, v_told, a_told, curvature, error, error_rate, a_lateral
    )


@kernel
def press_pedals(held: Held[Hands], v: float, v_told: float, a_told: float) -> tuple[float, float]:
    """Returns throttle and brake at speed v, m/s, for a speed and its rate that are told."""
    return press_by(held.value, v, v_told, a_told)


@inner_kernel
def drive_by(
    h: Hands, yaw: float, vx: float, vy: float, v_told: float, a_told: float,
    curvature: float, error: float, error_rate: float, a_lateral: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Returns throttle, brake and steer of these hands, or of a record with their fields."""
    speed = vx * cos(yaw) + vy * sin(yaw)
    v, w = max(speed, V_LATERAL_MIN), h.omega
    a = a_lateral - w * w * error - 2.0 * ZETA * w * error_rate
    most = A_LATERAL_MAX / (v * v)
    kappa = min(max(curvature + a / (v * v), -most), most)
    angle = atan(h.wheelbase * kappa) + h.understeer * v * v * kappa
    steer = min(max(angle / (h.steer_max * steer_share(v)), -1.0), 1.0)
    throttle, brake = press_by(h, speed, v_told, a_told)
    return throttle, brake, steer


@inner_kernel
def press_by(h: Hands, v: float, v_told: float, a_told: float) -> tuple[float, float]:
    """Returns throttle and brake at speed v, m/s; HOLD_BRAKE where both speeds are below V_STANDING."""
    if v_told < V_STANDING and v < V_STANDING:
        return 0.0, HOLD_BRAKE
    a = a_told + h.speed_gain * (v_told - v)
    dragged = h.engine_drag * min(abs(v) / V_CLUTCH, 1.0)  # by a closed throttle
    wanted = a + h.drag * v * v + h.rolling + dragged
    if wanted >= 0.0:
        most = min(h.a_drive, h.p_drive / max(v, 1.0))
        return min(wanted / (most + dragged), 1.0), 0.0
    return 0.0, min(-wanted / h.a_brake, 1.0)


def nearest_type(kind: ActorKind, length: float, width: float, height: float) -> str:
    """Returns the id of the vehicle type of this kind whose body is nearest in size, m.

    ConfigError for a kind that no type has.
    """
    of_kind = {k: t for k, t in vehicle_types().items() if t.actor_kind is kind}
    if not of_kind:
        raise ConfigError(f"there is no vehicle type of kind {kind.name.lower()}")

    def distance(t: VehicleType) -> float:
        return hypot(t.length - length, t.width - width, t.height - height)

    return min(of_kind, key=lambda k: distance(of_kind[k]))


def steering_geometry(kind: str) -> tuple[float, float]:
    """Returns distance of the axles, m, and largest angle of the front wheels, rad, of a vehicle type."""
    found = vehicle_type(kind)
    return found.wheelbase, found.steer_max
