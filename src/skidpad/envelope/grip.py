"""Grip from the car's own signals: what its wheels slip, what it gets, and what it asked for.

Three kinds of evidence go into one belief: slip against force, driving (against the wheels that are not
driven) and braking (against a speed that the inertial unit carries on: Mueller, Uchanski and Hedrick,
Journal of Dynamic Systems 125, 2003, doi 10.1115/1.1636773); what a car got, which its road has; and
a car that gets much less than its pedals or its steering ask for, which is at its limit.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, exp, isnan, nan, sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.constants import G
from skidpad.envelope.belief import (
    CAUTION,
    COLD_C,
    BeliefArrays,
    forget,
    measure_confidence,
    measure_softness,
    new_belief,
    prior_of,
    quantile,
    see_least,
    see_limit,
    see_slip,
    sum_grips,
)
from skidpad.envelope.signals import BRAKE_BAR, CarSignals

STIFFNESS = 22.0  # force over load per unit slip of the design's tyre; that of the simulator's, so
# results with it are a best case
WINDOW = 6  # ticks of one reading
V_LEAST = 2.0  # m/s, below which slip and engine tell nothing
SHORT, SHORT_LEAST, ASK_LEAST = (
    0.75,
    0.4,
    0.6,
)  # share, m/s^2 that are missing, m/s^2 asked at least
BLUNT, BLUNT_ASK = 0.5, 1.5  # share and m/s^2, for which wheels need not slip for sure
SLIPPING = 1.6  # times the slip that the force would need far from the limit
SLIP_LEAST = 0.004  # of wheels at their limit, beyond its error
USED_AT_LIMIT, LIMIT_SPREAD = 0.93, 0.12  # of the grip that controls take; relative error of that
LIMIT_LEAST = 0.04  # of the load; a car that gets less has an engine that drags or rolls
FORCE_LEAST = 0.05  # of the load, less tells nothing about the curve's shape
STEADY = 0.3  # share by which pedals move in a usable window
AY_MOST = 0.5  # m/s^2 across in a window whose slip is used
TURN_SHORT, TURN_ASK, V_CHARACTERISTIC = 0.6, 1.5, 25.0  # share, m/s^2, m/s of the single-track car
TURN_SPREAD = 0.2
USED_MUCH = 0.6  # of the grip; a car that gets so much shows it at its speed
WHEEL_SIGMA, RATIO_FIRST, RATIO_ERROR = 0.012, 0.007, 0.0008  # m/s of an axle; of front over rear
FORCE_SIGMA, FORCE_SHARE = 0.012, 0.06  # of the load: offset of the unit; loads, torque, shape
FOLLOW, LEARN = 0.2, 0.02  # 1 and 1/s, of the observer of speed and offset
OFFSET_FIRST, OFFSET_LEFT, OFFSET_TIME = 0.2, 0.03, 10.0  # m/s^2 at first, in the end, s
BRAKING_MOST = 3.0  # s over which the inertial unit carries the speed on
RISE = 3.0  # m/s above the speed of its evidence, to which a grip on wet roads holds


class Car(NamedTuple):
    """What a car knows about itself; the defaults are those of the ego's data sheet."""

    wheelbase: float = 2.47  # m
    a_brake: float = 11.0  # m/s^2, of full brake on perfect grip
    a_drive: float = 5.2  # m/s^2, of full throttle at low speed
    power_per_mass: float = 88.0  # W/kg
    front_share: float = 0.61  # of the weight, at rest
    height_ratio: float = 0.22  # of the centre of gravity over the wheelbase
    drag: float = 3.4e-4  # 1/m, of air: a = drag v^2
    rolling: float = 0.011  # of the load
    steer_max: float = 1.22  # rad


@kernel
def drive_at(car: Car, throttle: float, v: float) -> float:
    """Returns the m/s^2 that a throttle of 0 to 1 asks for at v in m/s."""
    return throttle * min(car.a_drive, car.power_per_mass / max(v, V_LEAST))


@dataclass(frozen=True, slots=True)
class Grip:
    """An estimate: `value` is a careful one; confidence 0 means no information, then shown is None."""

    value: float
    shown: float | None  # middle of the belief
    confidence: float
    prior: float


ESTIMATOR = np.dtype(
    [
        # speed over ground from free wheels, carried on by the inertial unit while they brake
        ("v", np.float64),  # m/s; -1 before the first message
        ("offset", np.float64),  # m/s^2 of the unit
        ("learned", np.float64),  # s over which the offset was learned
        ("braking", np.float64),  # s since the pedal was pressed
        # rolling radii
        ("ratio", np.float64),  # front over rear wheels, less 1
        ("ratio_variance", np.float64),
        # readings
        ("v_shown", np.float64),  # m/s at which the car showed its grip
        ("rows", np.int64),  # of the window that are filled
    ],
    align=True,
)
(V, AX, AY, FRONT, REAR, ASKED, STEER, YAW_RATE) = range(8)  # columns of the window


class GripArrays(NamedTuple):
    """What the estimator remembers, for kernels."""

    memory: NDArray[np.void]  # (1,) ESTIMATOR
    rows: Floats  # (WINDOW, 8) of the columns above
    means: Floats  # (8,) room: of the window
    belief: BeliefArrays


class Slip(NamedTuple):
    """A reading of a window."""

    along: float  # force over load
    slip: float
    sigma: float  # error of the slip


def new_estimator() -> GripArrays:
    """Returns what an estimator remembers that has read nothing."""
    memory = np.zeros(1, ESTIMATOR)
    memory["v"], memory["ratio_variance"] = -1.0, RATIO_FIRST**2
    return GripArrays(memory, np.zeros((WINDOW, 8)), np.zeros(8), new_belief())


@kernel
def leave_place(arrays: GripArrays) -> None:
    """Forgets speed and window of another place.

    Keeps the belief, the unit's offset and the wheel ratio.
    """
    m = arrays.memory[0]
    m.v, m.braking, m.rows = -1.0, 0.0, 0


@kernel
def observe_speed(arrays: GripArrays, signals: CarSignals, grade: float, dt: float) -> None:
    """Takes one message and moves speed and offset on by dt s; grade: of the map, uphill is > 0.

    While brakes are pressed, up to BRAKING_MOST s, the speed follows the inertial unit alone; below V_LEAST
    it is the speed of the rear wheels.
    """
    m = arrays.memory[0]
    rear = 0.5 * (signals.wheels[2] + signals.wheels[3])
    if m.v < 0.0 or (rear < V_LEAST and m.braking == 0.0):
        m.v = rear
        return
    m.v = max(m.v + (signals.ax - m.offset - G * grade) * dt, 0.0)
    if signals.brake > 0.0 and m.braking < BRAKING_MOST:
        m.braking += dt
        return
    error = rear - m.v
    if signals.brake > 0.0 or m.braking > 0.0:  # brakes are held for long, or just released
        m.v = rear
        if not signals.brake > 0.0:
            m.braking = 0.0
        return
    m.v += FOLLOW * error
    m.offset -= LEARN * error * (5.0 if m.learned < OFFSET_TIME else 1.0)
    m.learned += dt


@kernel
def estimate_grip(
    arrays: GripArrays, car: Car, stiffness: float, dt: float, signals: CarSignals, stage: int,
    prior: Floats, grade: float,
) -> tuple[float, float, float, float]:  # fmt: skip
    """Takes the signals of a tick and returns the fields of `Grip`, NaN for None.

    The belief changes every WINDOW ticks. stage: of the rain sensor, 0: dry; prior: (n,) what is expected
    without evidence; grade: of the map, uphill is > 0.
    """
    m = arrays.memory[0]
    observe_speed(arrays, signals, grade, dt)
    v = m.v
    forget(arrays.belief, v * dt, prior)
    row = arrays.rows[m.rows]
    row[V], row[AX], row[AY] = v, signals.ax - m.offset, signals.ay
    row[FRONT] = 0.5 * (signals.wheels[0] + signals.wheels[1]) * cos(signals.steer)
    row[REAR] = 0.5 * (signals.wheels[2] + signals.wheels[3])
    row[ASKED] = signals.drive - signals.brake / BRAKE_BAR * car.a_brake
    row[STEER], row[YAW_RATE] = signals.steer, signals.yaw_rate
    m.rows += 1
    if m.rows == WINDOW:
        if v > V_LEAST:
            judge_window(arrays, car, stiffness)
        m.rows = 0
    return say_grip(arrays, v, stage)


@kernel
def judge_window(arrays: GripArrays, car: Car, stiffness: float) -> None:
    """Updates the belief from one window's means: slip against force, limits reached, force used."""
    m, belief, mean = arrays.memory[0], arrays.belief, arrays.means
    for c in range(8):
        mean[c] = 0.0
        for i in range(WINDOW):
            mean[c] += arrays.rows[i, c] / WINDOW
    v, ay, asked = mean[V], mean[AY], mean[ASKED]
    force = mean[AX] + car.drag * v * v  # what the tyres give, over the mass
    use = sqrt(force * force + ay * ay) / G
    steady = is_steady(arrays.rows)
    usable = abs(ay) < AY_MOST and steady
    if asked >= 0.0 and m.braking == 0.0:
        reading = read_drive_slip(arrays, car, stiffness, force)
    else:
        reading = read_brake_slip(arrays, force)
        usable &= 0.0 < m.braking < BRAKING_MOST
    along = reading.along
    if usable and along > FORCE_LEAST:
        sigma_force = FORCE_SIGMA + FORCE_SHARE * abs(along)
        see_slip(belief, along, reading.slip, stiffness, reading.sigma, sigma_force)
    slip = reading.slip - reading.sigma
    at_limit = steady and see_limit_along(belief, stiffness, asked, force, along, slip)
    at_limit |= see_limit_across(belief, car, v, ay, mean[STEER], mean[YAW_RATE])
    see_least(belief, use, 0.02 + 0.05 * use)
    sum_grips(belief)
    if at_limit or use > USED_MUCH * quantile(belief.grips, CAUTION):
        m.v_shown = v


@kernel
def read_drive_slip(arrays: GripArrays, car: Car, stiffness: float, force: float) -> Slip:
    """Returns force over load and slip of the driven front wheels, and the slip's error.

    Learns the ratio of front to rear rolling radii where the force is small.
    """
    m, mean = arrays.memory[0], arrays.means
    v = mean[V]
    load = car.front_share - car.height_ratio * mean[AX] / G
    along = (force / G + car.rolling * (1.0 - load)) / load
    measured = mean[FRONT] / max(mean[REAR], V_LEAST) - 1.0
    noise = WHEEL_SIGMA / v
    soft = measure_softness(arrays.belief) / stiffness
    if abs(along) < 0.06 and v > 5.0:
        doubt = 0.3 * along * soft
        error = RATIO_ERROR * RATIO_ERROR + noise * noise + doubt * doubt
        gain = m.ratio_variance / (m.ratio_variance + error)
        m.ratio += gain * (measured - along * soft - m.ratio)
        m.ratio_variance = max((1.0 - gain) * m.ratio_variance, 1e-8)
    return Slip(along, measured - m.ratio, sqrt(m.ratio_variance + noise * noise + 1e-7))


@kernel
def read_brake_slip(arrays: GripArrays, force: float) -> Slip:
    """Returns force over load and slip of all wheels, braking positive, and the slip's error."""
    m, mean = arrays.memory[0], arrays.means
    v = mean[V]
    slip = (v - 0.5 * (mean[FRONT] / (1.0 + m.ratio) + mean[REAR])) / v
    # m/s^2 that the offset may be wrong by; it falls with the time of learning
    doubt = OFFSET_LEFT + OFFSET_FIRST * exp(-m.learned / (0.4 * OFFSET_TIME))
    drift = 0.01 + (doubt + 0.02 * abs(force)) * m.braking
    return Slip(-force / G, slip, sqrt(drift * drift / (v * v) + 0.25 * m.ratio_variance))


@kernel
def is_steady(rows: Floats) -> bool:
    """Returns whether pedals ask for more than ASK_LEAST in the window, moving less than STEADY of it."""
    low, high = rows[0, ASKED], rows[0, ASKED]
    for i in range(1, len(rows)):
        low, high = min(low, rows[i, ASKED]), max(high, rows[i, ASKED])
    most = max(abs(low), abs(high))
    return bool(most > ASK_LEAST and high - low < STEADY * most)


@kernel
def see_limit_along(
    belief: BeliefArrays, stiffness: float, asked: float, force: float, along: float, slip: float
) -> bool:
    """Returns whether steady pedals ask for much more than the car gets; if so, updates the belief."""
    got = force if asked > 0.0 else -force
    short = 0.0 < got < SHORT * abs(asked) and abs(asked) - got > SHORT_LEAST
    # so little that neither engine nor brakes can be the cause
    is_blunt = got < BLUNT * abs(asked) and abs(asked) > BLUNT_ASK and slip > -SLIP_LEAST
    linear = along * measure_softness(belief) / stiffness  # slip far from the limit
    slips = slip > max(SLIP_LEAST, SLIPPING * linear)
    found = short and (is_blunt or slips) and along > LIMIT_LEAST
    if found:
        see_limit(belief, along / USED_AT_LIMIT, LIMIT_SPREAD)
    return found


@kernel
def see_limit_across(
    belief: BeliefArrays, car: Car, v: float, ay: float, steer: float, yaw_rate: float
) -> bool:
    """Returns whether the car turns much less than its wheels are turned; if so, updates the belief."""
    ratio = v / V_CHARACTERISTIC
    wanted = v * steer / (car.wheelbase * (1.0 + ratio * ratio))
    short = abs(wanted) * v > TURN_ASK and abs(yaw_rate) < TURN_SHORT * abs(wanted)
    found = short and wanted * yaw_rate > 0.0
    if found:
        see_limit(belief, abs(ay) / G, TURN_SPREAD)
    return found


@kernel
def say_grip(arrays: GripArrays, v: float, stage: int) -> tuple[float, float, float, float]:
    """Returns the grip at v in m/s; `shown` is NaN while the confidence is 0.1 or less.

    stage: of the rain sensor, 0: dry. When wet and more than RISE m/s above the speed of the evidence,
    `value` is at most the prior's.
    """
    belief = arrays.belief
    sure = measure_confidence(belief)
    careful, prior = quantile(belief.grips, CAUTION), quantile(belief.prior, CAUTION)
    if stage > 0 and v > arrays.memory[0].v_shown + RISE:  # water takes more at a higher speed
        careful = min(careful, prior)
    return careful, quantile(belief.grips, 0.5) if sure > 0.1 else nan, sure, prior


class GripEstimator:
    """Call `update` once per tick while the driver's commands are the ones applied."""

    def __init__(self, dt: float, car: Car | None = None, stiffness: float = STIFFNESS) -> None:
        self.dt, self.car, self.stiffness = dt, car or Car(), stiffness
        self.arrays = new_estimator()

    def update(self, signals: CarSignals, stage: int, air_c: float, grade: float = 0.0) -> Grip:
        """Takes the signals of a tick and returns the estimate; the belief changes every WINDOW ticks.

        stage: of the rain sensor, 0: dry; air_c: air in deg C; grade: of the map, uphill is > 0.
        """
        prior = prior_of(stage, air_c < COLD_C)
        return make_grip(
            *estimate_grip(
                self.arrays, self.car, self.stiffness, self.dt, signals, stage, prior, grade
            )
        )


def make_grip(value: float, shown: float, confidence: float, prior: float) -> Grip:
    """Returns the answer of `estimate_grip`, None for NaN."""
    return Grip(value, None if isnan(shown) else shown, confidence, prior)
