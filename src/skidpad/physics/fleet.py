"""A fleet: the vehicles of a run with their wheels, stepped together, one tick at a time."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.states import ActorStates
from skidpad.physics.antilock import PRESSURE
from skidpad.physics.params import FEEL, STIFFNESS, WATER, WheelStates, vehicle_params
from skidpad.physics.rollover import OVER
from skidpad.physics.sensed import MEMORY
from skidpad.physics.types import TIRE_FRICTION_REFERENCE, VehicleType
from skidpad.physics.vehicle import step_vehicles

SUBSTEP = 0.01  # s; stopping distances and yaw rates within 3 % of 1 ms (docs/physics.md)
GEAR_UP_V = (4.0, 8.5, 14.0, 20.0, 27.0)  # m/s, full-load shift points of a compact car


class Fleet:
    """n vehicles. `states` is the one truth about their motion; whoever writes it, moves them.

    Height `z` belongs to the caller: it follows from the road.
    """

    def __init__(
        self,
        types: Sequence[VehicleType],
        dt: float,
        *,
        states: ActorStates | None = None,
        anti_lock: bool | None = None,
        stability: bool = False,
        cycling: bool = False,
        sensed: bool = False,
        roll_over: bool = False,
        substep: float = SUBSTEP,
    ) -> None:
        """A fleet at rest at the origin.

        states: arrays to work on whose first rows are these vehicles; None: own ones.
        anti_lock: None leaves it to each type. stability: stability and traction control and
        brake-force distribution. cycling: anti-lock brakes work from wheel speeds.
        sensed: stability control works from wheel speeds, too. roll_over: vehicles can tip
        over their outer wheels.
        substep: longest inner step, s.
        """
        n = len(types)
        self.types = tuple(types)
        self.substep = substep
        self.set_step(dt)
        rows = ActorStates.empty(n) if states is None else states
        self.states = ActorStates._make(column[:n] for column in rows)
        self.params = vehicle_params(self.types)
        if anti_lock is not None:
            self.params.anti_lock[:] = anti_lock
        self.params.stability[:] = stability
        self.params.cycling[:] = cycling
        self.params.sensed[:] = sensed
        self.params.tips[:] = roll_over
        self.wind = (0.0, 0.0)  # m/s of the air in world axes
        self.wheels = WheelStates(
            omega=np.zeros((n, 4)),
            steer=np.zeros(n),
            slip_y=np.zeros((n, 4)),
            a_load=np.zeros((n, 2)),
            slide=np.zeros((n, 4)),
            load=np.zeros((n, 4)),
            memory=np.zeros((n, MEMORY)),
        )
        self.tire_friction = np.array(
            [[t.tire_friction] * 4 for t in types], dtype=np.float64
        ).reshape(n, 4)
        self.feel = np.zeros((n, FEEL))  # what the tyres felt in the last step (decision L-6)
        self.mu, self.stiffness = self.feel[:, :STIFFNESS], self.feel[:, STIFFNESS:WATER]
        self.water = self.feel[:, WATER:]
        self.stiffness[:] = 1.0
        self._flat, self._air = np.zeros(n), np.zeros((n, 2))

    def __len__(self) -> int:
        return len(self.types)

    def set_step(self, dt: float) -> None:
        """Sets the s by which one `step` advances from now on, and its number of equal substeps."""
        self.dt = dt
        self.steps = max(1, round(dt / self.substep))
        if self.steps * self.substep < dt - 1e-9:
            self.steps += 1

    def place(self, i: int, pose: Pose, v: float = 0.0) -> None:
        """Puts vehicle i at `pose` with speed v along its heading, wheels straight and rolling, and present.

        What its controls and tyres remember starts anew.
        """
        s = self.states
        s.x[i], s.y[i], s.z[i] = pose.x, pose.y, pose.z
        s.roll[i], s.pitch[i], s.yaw[i] = pose.roll, pose.pitch, wrap_angle(pose.yaw)
        s.vx[i], s.vy[i] = v * cos(pose.yaw), v * sin(pose.yaw)
        s.yaw_rate[i] = s.ax[i] = s.ay[i] = 0.0
        s.present[i] = True
        w = self.wheels
        w.omega[i] = v / self.params.wheel_radius[i]
        for column in (w.steer, w.slip_y, w.a_load, w.slide, w.memory):
            column[i] = 0.0
        w.memory[i, PRESSURE : PRESSURE + 4] = 1.0

    def step(
        self,
        commands: Floats,
        mu: Floats,
        grade: Floats | None = None,
        bank: Floats | None = None,
        active: NDArray[np.bool_] | None = None,
    ) -> None:
        """Advances the active vehicles by dt, in place.

        commands (n, 5): throttle, brake, steer (left positive), handbrake, reverse. mu (n, 4) of a
        tyre with tire_friction 3.5 at FL, FR, RL, RR; each wheel's own scale is applied here, once.
        `stiffness` and `water` are as they were set.
        grade, bank (n,): rad, uphill and left side up positive; None: flat. active: None means all present.
        Raises ConfigError for other shapes of commands or mu.
        """
        if commands.shape != (len(self), 5) or mu.shape != (len(self), 4):
            raise ConfigError(
                f"fleet of {len(self)}: commands must be (n, 5) and mu (n, 4), "
                f"got {commands.shape} and {mu.shape}"
            )
        self._air[:] = self.wind
        np.multiply(mu, self.tire_friction, out=self.mu)
        self.mu /= TIRE_FRICTION_REFERENCE
        step_vehicles(
            self.states,
            self.wheels,
            self.params,
            commands,
            self.feel,
            self._flat if grade is None else grade,
            self._flat if bank is None else bank,
            self.states.present if active is None else active,
            self._air,
            self.dt / self.steps,
            self.steps,
        )

    def apply_impulse(
        self, i: int, impulse: tuple[float, float], point: tuple[float, float]
    ) -> None:
        """Changes the motion of vehicle i by an impulse (N s) at a point (m), both in world axes."""
        s, p = self.states, self.params
        c, sn = cos(s.yaw[i]), sin(s.yaw[i])
        x_cog = s.x[i] + p.x_cog[i] * c
        y_cog = s.y[i] + p.x_cog[i] * sn
        d_r = (point[0] - x_cog) * impulse[1] - (point[1] - y_cog) * impulse[0]
        d_r /= p.yaw_inertia[i]
        s.vx[i] += impulse[0] / p.mass[i] + d_r * p.x_cog[i] * sn
        s.vy[i] += impulse[1] / p.mass[i] - d_r * p.x_cog[i] * c
        s.yaw_rate[i] += d_r

    def on_side(self) -> NDArray[np.bool_]:
        """Returns (n,) which vehicles lie on their side."""
        return np.asarray(self.wheels.memory[:, OVER] > 0.0)

    def wheel_speeds(self, i: int) -> tuple[float, float, float, float]:
        """Returns the rim speeds of vehicle i in m/s: FL, FR, RL, RR."""
        fl, fr, rl, rr = (self.wheels.omega[i] * self.params.wheel_radius[i]).tolist()
        return fl, fr, rl, rr

    def speed(self, i: int) -> float:
        """Returns the speed of vehicle i along its body in m/s, negative in reverse."""
        s = self.states
        return float(s.vx[i] * cos(s.yaw[i]) + s.vy[i] * sin(s.yaw[i]))

    def gear(self, i: int, reverse: bool = False) -> int:
        """Returns the gear that the box of vehicle i shows, see `shown_gear`."""
        return shown_gear(self.speed(i), reverse)


def shown_gear(speed: float, reverse: bool) -> int:
    """Returns the gear that an automatic box shows: -1 in reverse, else 1 to 6 by speed in m/s."""
    if reverse:
        return -1
    gear = 1
    for limit in GEAR_UP_V:
        if limit < abs(speed):
            gear += 1
    return gear
