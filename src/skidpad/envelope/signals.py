"""What the car's own bus says of its motion: noise, resolution, bias and delay of series sensors.

Sources, each looked up:

* Inertial unit: Bosch's SMI700 and SMI710 for driver assistance, "MEMS inertial sensors provide
  equilibrium sense to your car", eeNews Automotive, 7 November 2014: noise 6 mg and 0.2 deg/s (root mean
  square), acceleration within 50 mg over life and 20 mg in the short term. What a car has zeroed at
  rest, and a yaw rate's offset after it, is an assumption.
* Resolutions: a public description of the bus of Hyundai and Kia, opendbc `hyundai_kia_generic.dbc`:
  wheel speeds 0.03125 km/h (WHL_SPD11), steering wheel 0.1 deg (SAS11), accelerations 0.01 m/s^2 (TCS13,
  ESP12), temperature of the air 0.5 K (EMS19).
* Assumptions, as no data sheet was found: noise of a wheel speed 0.02 m/s, rolling radii within
  0.5 %, brake pressure (150 bar at full pedal, 0.1 bar steps, 0.5 bar of noise), drive torque within
  5 %, one tick of delay on the bus.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import radians
from typing import NamedTuple

from skidpad.core.maths.constants import G
from skidpad.core.maths.randomness import stream
from skidpad.core.states import EgoEstimate, VehicleCommand

MILLI_G = G / 1000.0
STEERING_RATIO = 14.5  # steering wheel over road wheel, as in `physics.types`
BRAKE_BAR = 150.0  # at full pedal
BLOCK = 512  # ticks for which noise is drawn at once


class CarSignals(NamedTuple):
    """One message of the bus."""

    wheels: tuple[float, float, float, float]  # m/s at the rim by nominal radius: FL, FR, RL, RR
    ax: float  # m/s^2, specific force along the body: uphill adds
    ay: float
    yaw_rate: float  # rad/s
    steer: float  # rad at the road wheels, left positive
    brake: float  # bar
    drive: float  # m/s^2 that the engine's torque asks for


@dataclass(frozen=True, slots=True)
class BusModel:
    """Errors of the signals: standard deviations, half ranges of a run's offsets, resolutions."""

    wheel_noise: float = 0.02  # m/s
    wheel_step: float = 0.03125 / 3.6
    radius_offset: float = 0.005  # of the nominal rolling radius
    a_noise: float = 6.0 * MILLI_G
    a_offset: float = 20.0 * MILLI_G
    a_step: float = 0.01
    yaw_noise: float = radians(0.2)
    yaw_offset: float = radians(0.3)
    yaw_step: float = radians(0.01)
    steer_step: float = radians(0.1) / STEERING_RATIO
    steer_offset: float = radians(1.0) / STEERING_RATIO
    bar_noise: float = 0.5
    bar_step: float = 0.1
    torque_offset: float = 0.05  # of the torque
    delay: int = 1  # ticks


EXACT = BusModel(
    wheel_noise=0.0, wheel_step=0.0, radius_offset=0.0, a_noise=0.0, a_offset=0.0, a_step=0.0,
    yaw_noise=0.0, yaw_offset=0.0, yaw_step=0.0, steer_step=0.0, steer_offset=0.0, bar_noise=0.0,
    bar_step=0.0, torque_offset=0.0, delay=0,
)  # fmt: skip


class CarBus:
    """The bus of one car in one run; equal seeds give equal errors."""

    def __init__(self, seed: int, model: BusModel | None = None, steer_max: float = 1.22) -> None:
        self.model, self.steer_max = model or BusModel(), steer_max
        m = self.model
        fixed = stream(seed, "envelope/bus/offsets").uniform(-1.0, 1.0, 9).tolist()
        self.radii = [1.0 + m.radius_offset * u for u in fixed[:4]]
        self.ax, self.ay = m.a_offset * fixed[4], m.a_offset * fixed[5]
        self.yaw, self.steer = m.yaw_offset * fixed[6], m.steer_offset * fixed[7]
        self.torque = 1.0 + m.torque_offset * fixed[8]
        self._noise = stream(seed, "envelope/bus/noise")
        self._block: list[list[float]] = []
        self._sent: deque[CarSignals] = deque(maxlen=m.delay + 1)

    def read(
        self, ego: EgoEstimate, command: VehicleCommand, drive: float, grade: float
    ) -> CarSignals:
        """Writes a message with errors and returns the one that is `delay` ticks old; call it once per tick.

        command: the one applied; drive: m/s^2 that its throttle asks for; grade: of the road, uphill > 0.
        """
        m, n = self.model, self._draw()
        fl, fr, rl, rr = (
            _round(w * r + m.wheel_noise * u, m.wheel_step)
            for w, r, u in zip(ego.wheel_speeds, self.radii, n, strict=False)
        )
        bar = command.brake * BRAKE_BAR
        self._sent.append(
            CarSignals(
                (fl, fr, rl, rr),
                _round(ego.ax + G * grade + self.ax + m.a_noise * n[4], m.a_step),
                _round(ego.ay + self.ay + m.a_noise * n[5], m.a_step),
                _round(ego.yaw_rate + self.yaw + m.yaw_noise * n[6], m.yaw_step),
                _round(command.steer * self.steer_max + self.steer, m.steer_step),
                max(_round(bar + m.bar_noise * n[7], m.bar_step), 0.0) if bar > 0.0 else 0.0,
                drive * self.torque,
            )
        )
        return self._sent[0]

    def _draw(self) -> list[float]:
        """Returns the next eight standard normal numbers, drawn in blocks."""
        if not self._block:
            self._block = self._noise.standard_normal((BLOCK, 8)).tolist()
        return self._block.pop()


def _round(value: float, step: float) -> float:
    """Returns the value rounded to a multiple of step; unchanged for a step of 0."""
    return round(value / step) * step if step > 0.0 else value
