"""Anti-lock brakes that know wheel speeds, yaw rate and the body's deceleration, never the friction.

The reference speed is the fastest wheel, seen from the middle of the car by the yaw rate; it falls no
faster than the body slows by the accelerometer. A wheel whose slip or own deceleration is excessive
has its pressure relieved, is held until it recovers, and built up again (EP 0392686, [0002]). Either
rear wheel rules both (select-low; Mazda workshop manual 1990-1995, chapter 9, system operation). While
one front wheel cycles, the other's pressure may lead it by a gap that grows slowly: the driver has time
to steer. Engine drag is taken back with the pressure. Slip of 20 and 35 % as bounds: kfz-tech.de, "ABS
(additional information)"; rates of pressure, the gap, and the deceleration of a wheel that locks are
ours (assumptions).
"""

from __future__ import annotations

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel

# Columns of what the control remembers of a vehicle; the first three hold FL, FR, RL, RR
PRESSURE, RIM, PHASE = 0, 4, 8  # share of the torque asked for, m/s, one of the phases
REFERENCE, GAP, CYCLES, PRESSED = 12, 13, 14, 15  # m/s, lead of the other front wheel, count, pedal
MEMORY = 16
BUILD, RELEASE, HOLD = 0.0, 1.0, 2.0

SLIP_LOW, SLIP_HIGH = 0.20, 0.35  # kfz-tech.de
SLIP_SEEN = 0.05  # least slip with which a wheel's deceleration counts
LOCKING = 30.0  # m/s^2 of the rim, no body slows so
MARGIN = 0.5  # m/s^2 by which the reference may fall faster than the body slows
APPLY, RELIEVE = 1.0 / 0.15, 10.0  # 1/s: first pressure, and relief
RAISE, RAISE_FIRST = 1.5, 0.05  # 1/s of the pressure there is and a little, up again
GAP_FIRST, GAP_RATE = 0.15, 0.5  # of the torque asked for, and that per second
V_LEAST = 0.5  # m/s of the reference below which slip is not computed


@inner_kernel
def regulate(
    m: Floats, omega: Floats, radius: float, half_track: float, yaw_rate: float, slows: float,
    pedal: bool, h: float,
) -> None:  # fmt: skip
    """Moves the anti-lock brakes of a vehicle on by h seconds: pressures, phases, reference speed in `m`.

    m (MEMORY,): columns as above. omega (4,): spins of the wheels in rad/s, of this radius in m. slows:
    deceleration of the body in m/s^2. Without a pedal, pressures return to 1.
    """
    fastest = 0.0
    for w in range(4):
        arm = half_track if w % 2 == 0 else -half_track
        fastest = max(fastest, omega[w] * radius + yaw_rate * arm)
    if not pedal:
        for w in range(4):
            m[PRESSURE + w], m[PHASE + w], m[RIM + w] = 1.0, BUILD, omega[w] * radius
        m[REFERENCE], m[GAP], m[PRESSED] = fastest, GAP_FIRST, 0.0
        return
    if m[PRESSED] == 0.0:
        m[PRESSED], m[REFERENCE] = 1.0, fastest
        for w in range(4):
            m[PRESSURE + w], m[RIM + w] = 0.0, omega[w] * radius
    m[REFERENCE] = max(fastest, m[REFERENCE] - (max(slows, 0.0) + MARGIN) * h)
    for w in range(4):
        arm = half_track if w % 2 == 0 else -half_track
        _turn_phase(m, w, omega[w] * radius, max(m[REFERENCE] - yaw_rate * arm, V_LEAST), h)
    rear = min(m[PRESSURE + 2], m[PRESSURE + 3])
    m[PRESSURE + 2] = m[PRESSURE + 3] = rear
    _limit_lead(m, h)


@inner_kernel
def _turn_phase(m: Floats, w: int, rim: float, speed: float, h: float) -> None:
    """Updates phase and pressure of wheel w in `m`; rim: its speed in m/s, speed: of the road below it."""
    slip = 1.0 - rim / speed
    gains = (rim - m[RIM + w]) / h
    m[RIM + w] = rim
    phase, pressure = m[PHASE + w], m[PRESSURE + w]
    excessive = slip > SLIP_HIGH or (gains < -LOCKING and slip > SLIP_SEEN)
    if phase != RELEASE and excessive:
        if phase == BUILD:
            m[CYCLES] += 1.0
        phase = RELEASE
    elif phase == RELEASE and gains > 0.0:
        phase = HOLD
    elif phase == HOLD and slip < SLIP_LOW:
        phase = BUILD
    if phase == RELEASE:
        pressure -= RELIEVE * h
    elif phase == BUILD:
        pressure += (APPLY if m[CYCLES] == 0.0 else RAISE * (RAISE_FIRST + pressure)) * h
    m[PHASE + w], m[PRESSURE + w] = phase, min(max(pressure, 0.0), 1.0)


@inner_kernel
def _limit_lead(m: Floats, h: float) -> None:
    """Lowers the front wheel with more pressure to what the other has and the gap, which grows by h seconds.

    Nothing changes before the first cycle.
    """
    if m[CYCLES] == 0.0:
        return
    low, high = (0, 1) if m[PRESSURE] < m[PRESSURE + 1] else (1, 0)
    m[GAP] = min(m[GAP] + GAP_RATE * h, 1.0)
    m[PRESSURE + high] = min(m[PRESSURE + high], m[PRESSURE + low] + m[GAP])
