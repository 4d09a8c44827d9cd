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

from math import radians
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel
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


class BusModel(NamedTuple):
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


class BusRules(NamedTuple):
    """What holds for one bus in one run."""

    model: BusModel
    radii: tuple[float, float, float, float]  # over the nominal one, as `wheels`
    ax: float  # m/s^2, offset
    ay: float
    yaw: float  # rad/s
    steer: float  # rad
    torque: float  # factor
    steer_max: float  # rad at a steer of 1


BUS = np.dtype([("sent", np.int64), ("drawn", np.int64)], align=True)


class BusArrays(NamedTuple):
    """What a bus remembers, for kernels."""

    memory: NDArray[np.void]  # (1,) BUS: messages that were written, rows of `noise` that are used
    sent: Floats  # (delay + 1, 10) the newest messages, as a ring
    noise: Floats  # (BLOCK, 8) standard normal numbers


@kernel
def write_message(
    arrays: BusArrays, rules: BusRules,
    wheels: tuple[float, float, float, float], ax: float, ay: float, yaw_rate: float,
    steer: float, brake: float, drive: float, grade: float,
) -> CarSignals:  # fmt: skip
    """Writes a message with errors and returns the one that is `delay` ticks old.

    wheels, ax, ay, yaw_rate: of the ego, as `CarSignals`; steer, brake: of the command that is applied, as
    shares; drive: m/s^2 that its throttle asks for; grade: of the road, uphill > 0.
    """
    memory, model = arrays.memory[0], rules.model
    n = arrays.noise[memory.drawn]
    memory.drawn += 1
    row = arrays.sent[memory.sent % len(arrays.sent)]
    memory.sent += 1
    for i in range(4):
        wheel = wheels[i] * rules.radii[i] + model.wheel_noise * n[i]
        row[i] = round_to(wheel, model.wheel_step)
    row[4] = round_to(ax + G * grade + rules.ax + model.a_noise * n[4], model.a_step)
    row[5] = round_to(ay + rules.ay + model.a_noise * n[5], model.a_step)
    row[6] = round_to(yaw_rate + rules.yaw + model.yaw_noise * n[6], model.yaw_step)
    row[7] = round_to(steer * rules.steer_max + rules.steer, model.steer_step)
    bar = brake * BRAKE_BAR
    read = max(round_to(bar + model.bar_noise * n[7], model.bar_step), 0.0)
    row[8] = read if bar > 0.0 else 0.0
    row[9] = drive * rules.torque
    is_full = memory.sent >= len(arrays.sent)
    old = arrays.sent[memory.sent % len(arrays.sent) if is_full else 0]
    return CarSignals(
        (old[0], old[1], old[2], old[3]), old[4], old[5], old[6], old[7], old[8], old[9]
    )


@kernel
def round_to(value: float, step: float) -> float:
    """Returns the value rounded to a multiple of step; unchanged for a step of 0."""
    return float(np.rint(value / step)) * step if step > 0.0 else value


class CarBus:
    """The bus of one car in one run; equal seeds give equal errors."""

    def __init__(self, seed: int, model: BusModel | None = None, steer_max: float = 1.22) -> None:
        m = model or BusModel()
        u = stream(seed, "envelope/bus/offsets").uniform(-1.0, 1.0, 9).tolist()
        a, b, c, d = (1.0 + m.radius_offset * share for share in u[:4])
        self.rules = BusRules(
            m, (a, b, c, d), m.a_offset * u[4], m.a_offset * u[5], m.yaw_offset * u[6],
            m.steer_offset * u[7], 1.0 + m.torque_offset * u[8], steer_max,
        )  # fmt: skip
        self._noise = stream(seed, "envelope/bus/noise")
        self.arrays = BusArrays(np.zeros(1, BUS), np.zeros((m.delay + 1, 10)), np.zeros((BLOCK, 8)))
        self.arrays.memory["drawn"] = BLOCK

    def draw_noise(self) -> int:
        """Returns for how many messages there is noise; a new block is drawn where none is left."""
        memory = self.arrays.memory
        if memory["drawn"][0] == BLOCK:
            self.arrays.noise[:] = self._noise.standard_normal((BLOCK, 8))[::-1]
            memory["drawn"] = 0
        return BLOCK - int(memory["drawn"][0])

    def read(
        self, ego: EgoEstimate, command: VehicleCommand, drive: float, grade: float
    ) -> CarSignals:
        """Writes a message with errors and returns the one that is `delay` ticks old; call it once per tick.

        command: the one applied; drive: m/s^2 that its throttle asks for; grade: of the road, uphill > 0.
        """
        self.draw_noise()
        message: CarSignals = write_message(
            self.arrays, self.rules, ego.wheel_speeds, ego.ax, ego.ay, ego.yaw_rate,
            command.steer, command.brake, drive, grade,
        )  # fmt: skip
        return message
