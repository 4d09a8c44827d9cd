"""Grip from the car's own signals: what its wheels slip, what it gets, and what it asked for.

Three kinds of evidence go into one belief: slip against force, driving (against the wheels that are not
driven) and braking (against a speed that the inertial unit carries on: Mueller, Uchanski and Hedrick,
Journal of Dynamic Systems 125, 2003, doi 10.1115/1.1636773); what a car got, which its road has; and
a car that gets much less than its pedals or its steering ask for, which is at its limit.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, exp, sqrt

from skidpad.core.maths.constants import G
from skidpad.envelope.belief import CAUTION, COLD_C, GripBelief, prior_of, quantile
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


@dataclass(frozen=True, slots=True)
class Car:
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

    def drive_at(self, throttle: float, v: float) -> float:
        """Returns the m/s^2 that a throttle of 0 to 1 asks for at v in m/s."""
        return throttle * min(self.a_drive, self.power_per_mass / max(v, V_LEAST))


@dataclass(frozen=True, slots=True)
class Grip:
    """An estimate: `value` is a careful one; confidence 0 means no information, then shown is None."""

    value: float
    shown: float | None  # middle of the belief
    confidence: float
    prior: float


@dataclass(slots=True)
class SpeedObserver:
    """Speed over ground from free wheels, carried on by the inertial unit while they brake."""

    v: float = -1.0  # before the first message
    offset: float = 0.0  # m/s^2 of the unit
    learned: float = 0.0  # s over which the offset was learned
    braking: float = 0.0  # s since the pedal was pressed

    def update(self, signals: CarSignals, grade: float, dt: float) -> None:
        """Takes one message and moves `v` and `offset` on by dt s; grade: of the map, uphill is > 0.

        While brakes are pressed, up to BRAKING_MOST s, `v` follows the inertial unit alone; below V_LEAST it
        is the speed of the rear wheels.
        """
        rear = 0.5 * (signals.wheels[2] + signals.wheels[3])
        if self.v < 0.0 or (rear < V_LEAST and self.braking == 0.0):
            self.v = rear
            return
        self.v = max(self.v + (signals.ax - self.offset - G * grade) * dt, 0.0)
        if signals.brake > 0.0 and self.braking < BRAKING_MOST:
            self.braking += dt
            return
        error = rear - self.v
        if signals.brake > 0.0 or self.braking > 0.0:  # brakes are held for long, or just released
            self.v = rear
            self.braking = self.braking if signals.brake > 0.0 else 0.0
            return
        self.v += FOLLOW * error
        self.offset -= LEARN * error * (5.0 if self.learned < OFFSET_TIME else 1.0)
        self.learned += dt

    @property
    def sigma_offset(self) -> float:
        """Error in m/s^2 that `offset` may have; it falls with the time of learning."""
        return OFFSET_LEFT + OFFSET_FIRST * exp(-self.learned / (0.4 * OFFSET_TIME))


class GripEstimator:
    """Call `update` once per tick while the driver's commands are the ones applied."""

    def __init__(self, dt: float, car: Car | None = None, stiffness: float = STIFFNESS) -> None:
        self.dt, self.car, self.stiffness = dt, car or Car(), stiffness
        self.belief = GripBelief()
        self.ratio, self.ratio_variance = 0.0, RATIO_FIRST**2  # front over rear wheels, less 1
        self.v_shown = 0.0
        self.reset()

    def reset(self) -> None:
        """Forgets speed and window of another place.

        Keeps the belief, the unit's offset and the wheel ratio.
        """
        self.rows: deque[tuple[float, ...]] = deque(maxlen=WINDOW)
        known = getattr(self, "speed", None) or SpeedObserver()
        self.speed = SpeedObserver(offset=known.offset, learned=known.learned)

    def update(self, signals: CarSignals, stage: int, air_c: float, grade: float = 0.0) -> Grip:
        """Takes the signals of a tick and returns the estimate; the belief changes every WINDOW ticks.

        stage: of the rain sensor, 0: dry; air_c: air in deg C; grade: of the map, uphill is > 0.
        """
        self.speed.update(signals, grade, self.dt)
        v = self.speed.v
        self.belief.forget(v * self.dt, prior_of(stage, air_c < COLD_C))
        front = 0.5 * (signals.wheels[0] + signals.wheels[1]) * cos(signals.steer)
        rear = 0.5 * (signals.wheels[2] + signals.wheels[3])
        asked = signals.drive - signals.brake / BRAKE_BAR * self.car.a_brake
        self.rows.append(
            (v, signals.ax - self.speed.offset, signals.ay, front, rear, asked, signals.steer,
             signals.yaw_rate)
        )  # fmt: skip
        if len(self.rows) == WINDOW:
            if v > V_LEAST:
                self._judge(*(sum(column) / WINDOW for column in zip(*self.rows, strict=True)))
            self.rows.clear()
        return self._estimate(v, stage)

    def _judge(
        self, v: float, ax: float, ay: float, front: float, rear: float, asked: float,
        steer: float, yaw_rate: float,
    ) -> None:  # fmt: skip
        """Updates the belief from one window's means: slip against force, limits reached, force used."""
        force = ax + self.car.drag * v * v  # what the tyres give, over the mass
        use = sqrt(force * force + ay * ay) / G
        steady = self._is_steady()
        if asked >= 0.0 and self.speed.braking == 0.0:
            along, slip, sigma = self._drive_slip(v, ax, force, front, rear)
            usable = abs(ay) < AY_MOST and steady
        else:
            along, slip, sigma = self._brake_slip(v, force, front, rear)
            usable = abs(ay) < AY_MOST and steady and 0.0 < self.speed.braking < BRAKING_MOST
        if usable and along > FORCE_LEAST:
            self.belief.see_slip(
                along, slip, self.stiffness, sigma, FORCE_SIGMA + FORCE_SHARE * abs(along)
            )
        at_limit = self._see_limit_along(asked, force, along, slip - sigma, steady)
        at_limit |= self._see_limit_across(v, ay, steer, yaw_rate)
        self.belief.see_least(use, 0.02 + 0.05 * use)
        if at_limit or use > USED_MUCH * quantile(self.belief.grips, CAUTION):
            self.v_shown = v

    def _drive_slip(
        self, v: float, ax: float, force: float, front: float, rear: float
    ) -> tuple[float, float, float]:
        """Returns force over load and slip of the driven front wheels, and the slip's error.

        Learns the ratio of front to rear rolling radii where the force is small.
        """
        load = self.car.front_share - self.car.height_ratio * ax / G
        along = (force / G + self.car.rolling * (1.0 - load)) / load
        measured = front / max(rear, V_LEAST) - 1.0
        noise = WHEEL_SIGMA / v
        soft = self.belief.softness / self.stiffness
        if abs(along) < 0.06 and v > 5.0:
            error = RATIO_ERROR**2 + noise**2 + (0.3 * along * soft) ** 2
            gain = self.ratio_variance / (self.ratio_variance + error)
            self.ratio += gain * (measured - along * soft - self.ratio)
            self.ratio_variance = max((1.0 - gain) * self.ratio_variance, 1e-8)
        sigma = sqrt(self.ratio_variance + noise**2 + 1e-7)
        return along, measured - self.ratio, sigma

    def _brake_slip(
        self, v: float, force: float, front: float, rear: float
    ) -> tuple[float, float, float]:
        """Returns force over load and slip of all wheels, braking positive, and the slip's error."""
        slip = (v - 0.5 * (front / (1.0 + self.ratio) + rear)) / v
        drift = (self.speed.sigma_offset + 0.02 * abs(force)) * self.speed.braking
        return -force / G, slip, sqrt((0.01 + drift) ** 2 / (v * v) + 0.25 * self.ratio_variance)

    def _is_steady(self) -> bool:
        """Returns whether pedals ask for more than ASK_LEAST in the window, moving less than STEADY of it."""
        asked = [row[5] for row in self.rows]
        most = max(map(abs, asked))
        return most > ASK_LEAST and max(asked) - min(asked) < STEADY * most

    def _see_limit_along(
        self, asked: float, force: float, along: float, slip: float, steady: bool
    ) -> bool:
        """Returns whether the pedals ask for much more than the car gets; if so, updates the belief."""
        got = force if asked > 0.0 else -force
        short = 0.0 < got < SHORT * abs(asked) and abs(asked) - got > SHORT_LEAST
        # so little that neither engine nor brakes can be the cause
        is_blunt = got < BLUNT * abs(asked) and abs(asked) > BLUNT_ASK and slip > -SLIP_LEAST
        linear = along * self.belief.softness / self.stiffness  # slip far from the limit
        slips = slip > max(SLIP_LEAST, SLIPPING * linear)
        found = steady and short and (is_blunt or slips) and along > LIMIT_LEAST
        if found:
            self.belief.see_limit(along / USED_AT_LIMIT, LIMIT_SPREAD)
        return found

    def _see_limit_across(self, v: float, ay: float, steer: float, yaw_rate: float) -> bool:
        """Returns whether the car turns much less than its wheels are turned; if so, updates the belief."""
        wanted = v * steer / (self.car.wheelbase * (1.0 + (v / V_CHARACTERISTIC) ** 2))
        short = abs(wanted) * v > TURN_ASK and abs(yaw_rate) < TURN_SHORT * abs(wanted)
        found = short and wanted * yaw_rate > 0.0
        if found:
            self.belief.see_limit(abs(ay) / G, TURN_SPREAD)
        return found

    def _estimate(self, v: float, stage: int) -> Grip:
        """Returns the grip at v in m/s; `shown` is None while the confidence is 0.1 or less.

        stage: of the rain sensor, 0: dry. When wet and more than RISE m/s above the speed of the evidence,
        `value` is at most the prior's.
        """
        belief = self.belief
        careful, prior = quantile(belief.grips, CAUTION), quantile(belief.prior, CAUTION)
        if stage and v > self.v_shown + RISE:  # water takes more at a higher speed
            careful = min(careful, prior)
        sure = belief.confidence
        return Grip(careful, quantile(belief.grips, 0.5) if sure > 0.1 else None, sure, prior)
