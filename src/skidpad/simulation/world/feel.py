"""What the ego's own sensors feel of its motion, in one call."""

from __future__ import annotations

from math import cos, sin

from skidpad.core.kernels.jit import Held, kernel
from skidpad.simulation.world.step import Arena

Felt = tuple[
    float, float, float, float, float, float, float, float, float, float, float, float, float, float
]  # fmt: skip


@kernel
def feel_motion(arena: Held[Arena], i: int) -> Felt:
    """Returns x, y, z, roll, pitch, yaw; speed, yaw rate, ax, ay; rim speeds FL, FR, RL, RR of vehicle i.

    As `Fleet.speed` and `Fleet.wheel_speeds` have them.
    """
    s, w = arena.value.rows.states, arena.value.wheeled
    speed = s.vx[i] * cos(s.yaw[i]) + s.vy[i] * sin(s.yaw[i])
    omega, radius = w.wheels.omega, w.params.wheel_radius[i]
    return (
        s.x[i], s.y[i], s.z[i], s.roll[i], s.pitch[i], s.yaw[i],
        speed, s.yaw_rate[i], s.ax[i], s.ay[i],
        omega[i, 0] * radius, omega[i, 1] * radius, omega[i, 2] * radius, omega[i, 3] * radius,
    )  # fmt: skip
