"""The loads of four wheels: quasi-static transfer by acceleration along and across."""

from __future__ import annotations

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel
from skidpad.physics.car import Car
from skidpad.physics.rollover import left_arm


@inner_kernel
def write_loads(car: Car, a_x: float, a_y: float, load: Floats) -> None:
    """Writes quasi-static loads in N into `load` (4,); no axle or wheel ever pulls on the road.

    a_x, a_y: m/s^2 behind the load transfer.
    """
    wheelbase = car.a + car.b
    front = (car.weight * car.b - car.mass * a_x * car.cog_height) / wheelbase
    front = min(max(front, 0.0), car.weight)
    moment = 0.5 * car.mass * a_y * car.cog_height / car.half_track
    if car.tips:
        _share_loads(car, front, moment, a_y, load)
        return
    for axle in range(2):
        axle_load = front if axle == 0 else car.weight - front
        share = car.roll_front if axle == 0 else 1.0 - car.roll_front
        transfer = min(max(share * moment, -0.5 * axle_load), 0.5 * axle_load)
        load[2 * axle] = 0.5 * axle_load - transfer
        load[2 * axle + 1] = 0.5 * axle_load + transfer


@inner_kernel
def _share_loads(car: Car, front: float, moment: float, a_y: float, load: Floats) -> None:
    """Writes the loads of a vehicle that can tip: what a lifted wheel does not take goes to the other axle.

    front: N on the front axle; moment: N to move from the left to the right wheels.
    """
    arm = left_arm(car.half_track, car.cog_height, car.lean, a_y)
    shift = 0.5 * car.weight * (1.0 - arm / car.half_track)
    moment = min(
        max(moment + (shift if a_y > 0.0 else -shift), -0.5 * car.weight), 0.5 * car.weight
    )
    half_front, half_rear = 0.5 * front, 0.5 * (car.weight - front)
    ahead = min(max(car.roll_front * moment, -half_front), half_front)
    behind = min(max(moment - ahead, -half_rear), half_rear)
    ahead = moment - behind
    load[0], load[1] = half_front - ahead, half_front + ahead
    load[2], load[3] = half_rear - behind, half_rear + behind
