"""Grip from the car's own signals: what it asked for, what it got, and how far its wheels slipped.

Three sources, of falling trust: a car that gets less than it asks for is at its limit; one that
gets something has at least that much; slip against force tells of a limit not yet reached. The last
inverts the brush tyre, whose force bends away from its initial slope as the limit comes near
(Pacejka, Tire and Vehicle Dynamics, chapter 3; slip slopes as a sign of grip: Gustafsson, Automatica
33, 1997; Rajamani et al., IEEE Control Systems 30, 2010; braking: Mueller, Uchanski and Hedrick, Journal
of Dynamic Systems 125, 2003, doi 10.1115/1.1636773). Knowledge fades with the distance driven.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import exp, sqrt

from skidpad.core.constants import G
from skidpad.core.states import EgoEstimate, VehicleCommand

STIFFNESS = 22.0  # force over load per unit slip of the design's tyre; that of the simulator's, so
# results with it are a best case
GRIPS = (0.05, 1.0)  # least and highest grip that is believed
WINDOW = 6  # ticks over which signals are averaged
SETTLED = 6  # ticks for which a shortfall must last: pedals and gears take up to 0.3 s
SHORT, SHORT_LEAST = 0.8, 0.4  # share of the wanted acceleration, and m/s^2, that are missing
ASK_LEAST = 0.6  # m/s^2 that a car asks for at least
V_LEAST = 2.0  # m/s, below which slip and engine tell nothing
BRAKE_USE, DRIVE_USE = 0.97, 0.93  # of the grip that anti-lock and traction control take
LIMIT_LEAST = 0.04  # of the load; a car that gets less has an engine that drags or rolls
FORCE_LEAST = 0.06  # of the load, less tells nothing about the curve's shape
SLIPPING = 1.6  # times the slip that the force would need far from the limit
AY_MOST, STEADY = 0.5, 0.3  # m/s^2 across, and share by which pedals move, in a usable window
SIGMA_LEAST, SIGMA_SURE = 0.35, 0.75  # shares of full sliding: less tells nothing, more is sure
TURN_SHORT, TURN_ASK, V_CHARACTERISTIC = 0.6, 1.0, 25.0  # share, m/s^2, m/s of the single-track car
FADE_LOW, FADE_HIGH = 3000.0, 400.0  # m over which low and high grip are believed; our assumption
RISE = 3.0  # m/s above the speed of its evidence, to which a grip on wet roads holds
COLD_C = 3.0  # deg C that a thermometer with 2 K of error says where the road may be frozen
COLD_PRIOR = 0.25  # packed snow: between ice and the tests that docs/physics.md lists
# By stage of the rain sensor: dry, wet (0.2 mm), in between, 1 mm at 90 km/h; friction table of the
# Bosch Automotive Handbook, as in docs/physics.md
RAIN_PRIORS = (0.8, 0.6, 0.45, 0.3)


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
    steer_max: float = 1.22  # rad


@dataclass(frozen=True, slots=True)
class Grip:
    """An estimate: `value` mixes what was shown with the prior; confidence 0 means no information."""

    value: float
    shown: float | None
    confidence: float
    prior: float


def prior_grip(stage: int, air_c: float) -> float:
    """Returns the grip that rain sensor and thermometer let a careful driver expect."""
    if air_c < COLD_C:
        return min(COLD_PRIOR, RAIN_PRIORS[stage])
    return RAIN_PRIORS[stage]


def brush_grip(force: float, slip: float, stiffness: float = STIFFNESS) -> tuple[float, float]:
    """Returns the grip of a brush tyre with this force over load and slip, and the share of sliding.

    force / (C slip) = 1 - sigma + sigma^2 / 3 with sigma = C slip / (3 mu), solved for mu.
    """
    wanted = stiffness * slip
    secant = min(force / wanted, 1.0)
    root = 1.0 - 4.0 * (1.0 - secant) / 3.0
    sigma = 1.0 if root <= 1.0 / 9.0 else 1.5 * (1.0 - sqrt(root))
    if sigma >= 1.0:
        return force, 1.0
    return (wanted / (3.0 * sigma) if sigma > 1e-6 else GRIPS[1]), sigma


class GripEstimator:
    """Call `update` once per tick while the driver's commands are the ones applied."""

    def __init__(self, dt: float, car: Car | None = None, stiffness: float = STIFFNESS) -> None:
        self.dt, self.car, self.stiffness = dt, car or Car(), stiffness
        self.shown: float | None = None
        self.confidence, self.v_shown, self.prior = 0.0, 0.0, RAIN_PRIORS[0]
        self.reset()

    def reset(self) -> None:
        """Forgets the signals of another place; what was learned stays."""
        self.rows: deque[tuple[float, ...]] = deque(maxlen=WINDOW)
        self.short_ticks = self.turn_ticks = 0

    def update(
        self,
        ego: EgoEstimate,
        command: VehicleCommand,
        stage: int,
        air_c: float,
        grade: float = 0.0,
    ) -> Grip:
        """Returns the estimate after a tick; command: the one applied before it; grade: uphill is > 0."""
        v = max(ego.speed, 0.0)
        self.prior = prior_grip(stage, air_c)
        self._fade(v * self.dt)
        front = 0.5 * (ego.wheel_speeds[0] + ego.wheel_speeds[1])
        rear = 0.5 * (ego.wheel_speeds[2] + ego.wheel_speeds[3])
        asked = self._wanted_acceleration(v, command)
        self.rows.append(
            (v, ego.ax + G * grade, ego.ay, front, rear, asked, command.steer, ego.yaw_rate)
        )
        if len(self.rows) == WINDOW and v > V_LEAST:
            self._judge(*(sum(column) / WINDOW for column in zip(*self.rows, strict=True)))
        return self._estimate(v, stage)

    def _wanted_acceleration(self, v: float, command: VehicleCommand) -> float:
        """m/s^2 that the pedals ask for."""
        if command.brake > 0.0:
            return -command.brake * self.car.a_brake
        return command.throttle * min(self.car.a_drive, self.car.power_per_mass / max(v, V_LEAST))

    def _judge(
        self, v: float, ax: float, ay: float, front: float, rear: float, asked: float,
        steer: float, yaw_rate: float,
    ) -> None:  # fmt: skip
        force = ax + self.car.drag * v * v  # what the tyres give, over the mass
        use = sqrt(force * force + ay * ay) / G
        load = self.car.front_share - self.car.height_ratio * ax / G  # of the driven axle
        drives = asked > 0.0
        along = force / (G * load) if drives else -force / G
        slip = ((front - v) if drives else v - 0.5 * (front + rear)) / v
        self._limit_along(v, force, asked, along, drives, slip)
        self._limit_across(v, ay, steer, yaw_rate)
        if along > FORCE_LEAST and slip > 1e-4 and abs(ay) < AY_MOST and self._is_steady():
            grip, sigma = brush_grip(along, slip, self.stiffness)
            sure = min(max((sigma - SIGMA_LEAST) / (SIGMA_SURE - SIGMA_LEAST), 0.0), 1.0)
            if sure > 0.0:
                self._learn(max(grip, use), 0.3 * sure, v)
        if use > (self.prior if self.shown is None else self.shown):  # at least what it got
            self._learn(use, 1.0, v)

    def _is_steady(self) -> bool:
        """Tells whether pedals hold still in the window, or slip and force belong to two moments."""
        asked = [row[5] for row in self.rows]
        steady = max(asked) - min(asked) < STEADY * max(map(abs, asked))
        return steady and min(map(abs, asked)) > ASK_LEAST

    def _limit_along(
        self, v: float, force: float, asked: float, along: float, drives: bool, slip: float
    ) -> None:
        """Learns where the car gets much less than its pedals ask for, with wheels that slip."""
        got = force if drives else -force
        missing = abs(asked) - got
        short = abs(asked) > ASK_LEAST and got > 0.0 and got < SHORT * abs(asked)
        # without slip the engine or the brakes give less, or are on their way
        slipping = slip * self.stiffness > SLIPPING * along and self._is_steady()
        is_limit = short and missing > SHORT_LEAST and slipping and along > LIMIT_LEAST
        self.short_ticks = self.short_ticks + 1 if is_limit else 0
        if self.short_ticks >= SETTLED:
            self._learn(along / (DRIVE_USE if drives else BRAKE_USE), 0.5, v)

    def _limit_across(self, v: float, ay: float, steer: float, yaw_rate: float) -> None:
        """Learns where the car turns much less than its wheels are turned."""
        angle = steer * self.car.steer_max
        wanted = v * angle / (self.car.wheelbase * (1.0 + (v / V_CHARACTERISTIC) ** 2))
        short = abs(wanted) * v > TURN_ASK and abs(yaw_rate) < TURN_SHORT * abs(wanted)
        self.turn_ticks = self.turn_ticks + 1 if short and wanted * yaw_rate > 0.0 else 0
        if self.turn_ticks >= 2 * SETTLED:
            self._learn(abs(ay) / G, 0.3, v)

    def _learn(self, grip: float, weight: float, v: float) -> None:
        grip = min(max(grip, GRIPS[0]), GRIPS[1])
        known = grip if self.shown is None or self.confidence < 0.1 else self.shown
        self.shown = known + weight * (grip - known)
        self.confidence = max(self.confidence, weight + (1.0 - weight) * self.confidence)
        self.v_shown = v

    def _fade(self, way: float) -> None:
        if self.shown is not None:
            length = FADE_LOW if self.shown < self.prior else FADE_HIGH
            self.confidence *= exp(-way / length)

    def _estimate(self, v: float, stage: int) -> Grip:
        if self.shown is None:
            return Grip(self.prior, None, 0.0, self.prior)
        shown = self.shown
        if stage and v > self.v_shown + RISE:  # water takes more at a higher speed
            shown = min(shown, self.prior)
        value = self.confidence * shown + (1.0 - self.confidence) * self.prior
        return Grip(value, self.shown, self.confidence, self.prior)
