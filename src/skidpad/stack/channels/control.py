"""From a plan to pedals and steering: pure pursuit and a feedforward with integral."""

from __future__ import annotations

from math import atan, atan2, cos, hypot, sin

from skidpad.core.states import VehicleCommand
from skidpad.stack.channels.route import PathPoints
from skidpad.stack.channels.settings import CarModel

LOOKAHEAD_TIME = 0.8  # s
LOOKAHEAD_MIN = 4.5  # m
PEDAL_GAIN = 0.4  # 1/s
TRIM_MAX = 1.5  # m/s^2
RESISTANCE = 0.25  # m/s^2, rolling and drag at town speeds
V_STANDING = 0.3  # m/s
BRAKE_STANDING = 0.5
YAW_GAIN = 0.15  # rad of wheel angle per rad/s of missing yaw rate
THROTTLE_MAX = 0.85


class Controller:
    """Follows path and acceleration with the car's own sensors."""

    def __init__(self, car: CarModel, dt: float) -> None:
        self.car, self.dt = car, dt
        self.reset()

    def reset(self) -> None:
        """Resets the trim of the pedals and the last measured speed."""
        self.trim = 0.0
        self.v_before: float | None = None
        self.a_wanted = 0.0

    def update(
        self,
        path: PathPoints,
        at: int,
        pose: tuple[float, float, float],
        v: float,
        yaw_rate: float,
        a: float,
    ) -> VehicleCommand:
        """Returns the command for acceleration `a` in m/s^2; call it once per step of dt.

        path: points STEP apart; at: the one near the ego; pose: x, y, yaw of its centre; v: m/s.
        """
        steer = self._steer(path, at, pose, v, yaw_rate)
        return self._pedals(v, a, steer)

    def _steer(
        self, path: PathPoints, at: int, pose: tuple[float, float, float], v: float, rate: float
    ) -> float:
        """Returns steer by pure pursuit from the rear axle (Coulter 1992), corrected by the yaw rate."""
        car = self.car
        x = pose[0] - 0.5 * car.wheelbase * cos(pose[2])
        y = pose[1] - 0.5 * car.wheelbase * sin(pose[2])
        reach = max(LOOKAHEAD_TIME * v, LOOKAHEAD_MIN) + 0.5 * car.wheelbase
        j = min(at + round(reach - 0.5 * car.wheelbase), len(path.x) - 1)
        dx, dy = float(path.x[j]) - x, float(path.y[j]) - y
        distance = max(hypot(dx, dy), 1.0)
        kappa = 2.0 * sin(atan2(dy, dx) - pose[2]) / distance
        angle = atan(car.wheelbase * kappa) + YAW_GAIN * min(v / 10.0, 1.0) * (kappa * v - rate)
        return min(max(angle / car.steer_max, -1.0), 1.0)

    def _pedals(self, v: float, a: float, steer: float) -> VehicleCommand:
        """Returns the command for an acceleration a in m/s^2 at v in m/s, trimmed by the measured one.

        Holds the brake below V_STANDING unless it is to start.
        """
        if v < V_STANDING and a <= 0.05:
            self.trim, self.v_before = 0.0, None
            return VehicleCommand(brake=BRAKE_STANDING, steer=steer)
        if self.v_before is not None:
            measured = (v - self.v_before) / self.dt
            trim = self.trim + PEDAL_GAIN * (self.a_wanted - measured) * self.dt
            self.trim = min(max(trim, -TRIM_MAX), TRIM_MAX)
        self.v_before, self.a_wanted = v, a
        force = a + RESISTANCE + self.trim
        if force >= 0.0:
            return VehicleCommand(throttle=min(force / self.car.a_drive, THROTTLE_MAX), steer=steer)
        return VehicleCommand(brake=min(-force / self.car.a_brake, 1.0), steer=steer)
