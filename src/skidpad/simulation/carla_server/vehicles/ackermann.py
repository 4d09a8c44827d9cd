"""Ackermann commands: two controllers turn speed and acceleration into pedals, one angle into steer.

The client's settings are the gains of the speed and the acceleration controller.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from skidpad.physics.fleet import Fleet
from skidpad.physics.vehicle import steer_share
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.vehicles.control import Control

A_MAX = 3.0  # m/s^2 that the speed controller may ask for
A_MIN = -6.0
V_STANDING = 0.1  # m/s


@dataclass(frozen=True, slots=True)
class AckermannSettings:
    """AckermannControllerSettings; defaults as CARLA documents them."""

    speed_kp: float = 0.15
    speed_ki: float = 0.0
    speed_kd: float = 0.25
    accel_kp: float = 0.01
    accel_ki: float = 0.0
    accel_kd: float = 0.01

    def pack(self) -> list[float]:
        """Returns the settings as CARLA's wire sends them."""
        return [
            self.speed_kp,
            self.speed_ki,
            self.speed_kd,
            self.accel_kp,
            self.accel_ki,
            self.accel_kd,
        ]


@dataclass(frozen=True, slots=True)
class AckermannTarget:
    """VehicleAckermannControl; ISO steer in rad. 0 for a rate or the acceleration: no limit given."""

    steer: float
    steer_speed: float  # rad/s
    speed: float  # m/s, negative in reverse
    acceleration: float  # m/s^2
    jerk: float


def parse_target(value: Any) -> AckermannTarget:
    """Returns the target of a call in ISO axes; newer clients send a time stamp, which is not used.

    WireError for another shape.
    """
    v = wire.items(value, "ackermann control")[:5]
    steer, steer_speed, speed, acceleration, jerk = wire.numbers(v, "ackermann control", 5)
    return AckermannTarget(wire.iso_steer(steer), abs(steer_speed), speed, abs(acceleration), jerk)


class AckermannDriver:
    """Drives one vehicle to its target, a tick at a time."""

    def __init__(self, settings: AckermannSettings) -> None:
        self.settings = settings
        self.target = AckermannTarget(0.0, 0.0, 0.0, 0.0, 0.0)
        self._integral = 0.0
        self._effort = 0.0  # pedal, positive drives
        self._angle = 0.0

    def drive(self, control: Control, fleet: Fleet, slot: int, dt: float) -> None:
        """Writes throttle, brake, reverse and steer for the coming tick of dt s into `control`.

        slot: row of the vehicle in the fleet.
        """
        v = fleet.speed(slot)
        target = self.target
        backwards = target.speed < 0.0
        speed, wanted = (-v, -target.speed) if backwards else (v, target.speed)
        error = wanted - speed
        self._integral += error * dt
        limit = target.acceleration or A_MAX
        a_target = self.settings.speed_kp * error * 10.0 + self.settings.speed_ki * self._integral
        a_target = min(max(a_target, max(A_MIN, -limit) if target.acceleration else A_MIN), limit)
        a_now = float(fleet.states.ax[slot]) * (-1.0 if backwards else 1.0)
        self._effort += self.settings.accel_kp * (a_target - a_now) * dt / 0.05
        self._effort = min(max(self._effort, -1.0), 1.0)
        if wanted == 0.0 and speed < V_STANDING:
            self._effort = -1.0
        control.throttle = max(self._effort, 0.0)
        control.brake = max(-self._effort, 0.0)
        control.reverse = backwards
        self._angle = _towards(self._angle, target.steer, target.steer_speed * dt)
        full = fleet.types[slot].steer_max * steer_share(abs(v))
        control.steer = min(max(self._angle / full, -1.0), 1.0)


def _towards(value: float, target: float, step: float) -> float:
    """Returns `value` moved to `target` by at most `step`; a step of 0 is no limit."""
    if step <= 0.0:
        return target
    return value + min(max(target - value, -step), step)
