"""From the pedals and the wheel of a person to a command: reverse, and a wheel that keys can turn."""

from __future__ import annotations

from skidpad.core.inputs import Method, Pedals
from skidpad.core.states import VehicleCommand

STANDSTILL = 0.3  # m/s
HOLD_TO_REVERSE = 0.5  # s of braking at standstill (A-274 leaves the time open)
PRESSED = 0.5  # pedal
TURN, RETURN = 1.6, 3.2  # 1/s of full lock by keys, our choice: lock to lock in 1.25 s
# Keys know all or nothing, so at speed they ask for no more than this lateral acceleration.
KEY_A_LAT = 6.0  # m/s^2, our choice: below what a dry road carries, above what a wet one does
WHEELBASE, MAX_STEER = 2.9, 1.22  # m, rad: of a sedan with CARLA's 70 degrees, for that limit only


class Hands:
    """One person's hands and feet; `reset` when the person takes over."""

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.reset()

    def reset(self, steer: float = 0.0) -> None:
        """Begin, with the wheel turned to `steer`."""
        self.reverse = False
        self.pressed = 0.0  # s for which the brake has been held at standstill
        self.steer = steer

    def update(self, pedals: Pedals, v: float) -> VehicleCommand:
        """The command of this tick. v: m/s along the body, negative in reverse."""
        self._select_gear(pedals, v)
        self._turn(pedals, v)
        throttle, brake = pedals.throttle, pedals.brake
        if self.reverse:
            throttle, brake = brake, throttle
        return VehicleCommand(throttle, brake, self.steer, pedals.handbrake, self.reverse)

    def _select_gear(self, pedals: Pedals, v: float) -> None:
        """Reverse by holding the brake at standstill; forward again by the throttle."""
        standing = abs(v) < STANDSTILL
        if self.reverse:
            if standing and pedals.throttle >= PRESSED > pedals.brake:
                self.reverse = False
            return
        if not standing or pedals.brake < PRESSED or pedals.throttle > 0.0:
            self.pressed = 0.0
            return
        self.pressed += self.dt
        if self.pressed >= HOLD_TO_REVERSE - 1e-9:
            self.reverse, self.pressed = True, 0.0

    def _turn(self, pedals: Pedals, v: float) -> None:
        """Turns the wheel by the pedals at `v` m/s: directly, or by keys at a limited rate."""
        if pedals.method is not Method.KEYBOARD:
            self.steer = pedals.steer
            return
        limit = min(1.0, KEY_A_LAT * WHEELBASE / max(v * v, 1e-6) / MAX_STEER)
        wanted = pedals.steer * limit
        back = abs(wanted) < abs(self.steer) or wanted * self.steer < 0.0
        most = (RETURN if back else TURN) * self.dt * max(limit, 0.05)
        self.steer += min(max(wanted - self.steer, -most), most)
