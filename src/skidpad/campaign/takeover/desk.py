"""A person beside the stack: takes over and hands back, switches functions, changes the weather.

The desk stands around driver, supervisor and backend of the one loop. What the person does comes
from a source, live or recorded, as inputs by tick; so a drive with a person can be driven again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from skidpad.campaign.driving.loop import Script, Supervising
from skidpad.campaign.driving.outdoors import ChangedBackend
from skidpad.campaign.driving.stack_at_wheel import StackAtWheel
from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.frames import SensorFrame
from skidpad.core.inputs import (
    Beam,
    Crowd,
    Functions,
    Input,
    Lamps,
    LampSwitch,
    Method,
    Outside,
    Pedals,
    Sky,
    Timed,
    Wheel,
)
from skidpad.core.run import Function, RunSpec
from skidpad.core.setup import DT, RESERVE_NAME, ActorCommand
from skidpad.core.states import ActorTable, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Supervision
from skidpad.core.weather import Weather
from skidpad.physics.optics import visibility
from skidpad.simulation.backend import Backend
from skidpad.simulation.recovery import Action, Supervisor

STANDSTILL = 0.3  # m/s
HOLD_TO_REVERSE = 0.5  # s of braking at standstill (A-274 leaves the time open)
PRESSED = 0.5  # pedal
TURN, RETURN = 1.6, 3.2  # 1/s of full lock by keys, our choice: lock to lock in 1.25 s
# Keys know all or nothing, so at speed they ask for no more than this lateral acceleration.
KEY_A_LAT = 6.0  # m/s^2, our choice: below what a dry road carries, above what a wet one does
WHEELBASE, MAX_STEER = 2.9, 1.22  # m, rad: of a sedan with CARLA's 70 degrees, for that limit only
ROOM = 25.0  # m to everybody, which a vehicle needs to come back
FROM_EGO = 60.0  # m to the ego, so that nobody appears before its bumper
LOW_VISIBILITY = 200.0  # m


class InputSource(Protocol):
    """Source of what a person does during a drive."""

    @property
    def ended(self) -> bool:
        """Returns True when the person has ended the drive."""
        ...

    def at(self, tick: int) -> Sequence[Input]:
        """Returns the inputs of this tick; to be called once per tick, in order."""
        ...


class Recorded:
    """Repeats inputs that were given in a drive before."""

    def __init__(self, inputs: Iterable[Timed]) -> None:
        self._by_tick: dict[int, list[Input]] = {}
        for timed in inputs:
            self._by_tick.setdefault(timed.tick, []).append(timed.input)

    @property
    def ended(self) -> bool:
        """Returns False always: the length of the run ends it."""
        return False

    def at(self, tick: int) -> Sequence[Input]:
        """Returns the inputs that were recorded for a tick."""
        return self._by_tick.get(tick, ())


def beam_of(switch: LampSwitch, weather: Weather) -> Beam:
    """Returns the beam of a switch: automatic is low beam at night or below LOW_VISIBILITY, else off.

    See A-218 and A-219.
    """
    if switch is not LampSwitch.AUTO:
        return Beam[switch.name]
    dim = weather.is_night or visibility(weather) < LOW_VISIBILITY
    return Beam.LOW if dim else Beam.OFF


class Desk:
    """Holds what a person has set in a drive: driver in charge, functions, surroundings, all inputs."""

    def __init__(self, source: InputSource, spec: RunSpec, dt: float = DT) -> None:
        self.source, self.hands, self.course = source, Hands(dt), spec.course
        self.density = Density(spec.course.vehicles if isinstance(spec.course, Roads) else 0)
        range_model = spec.settings.sensors.range
        self.outside = Outside(weather=spec.weather, grip=spec.grip, range_model=range_model)
        self.manual = False
        self.pedals = Pedals()
        self.functions: frozenset[Function] | None = None  # None: as the stack began
        self.switch: LampSwitch | None = None  # None: nobody has touched it
        self.inputs: list[Timed] = []
        self.handed_back = self.switched = self.changed = False  # in this tick
        self._tick = -1

    def turn(self, tick: int) -> None:
        """Takes the inputs of a tick, once; sets `handed_back`, `switched` and `changed` for this tick."""
        if tick == self._tick:
            return
        self._tick = tick
        self.handed_back = self.switched = self.changed = False
        for one in self.source.at(tick):
            self.inputs.append(Timed(tick, one))
            self._take(one)

    def _take(self, one: Input) -> None:
        """Takes over one input; ConfigError for one that the course cannot follow."""
        match one:
            case Wheel():
                self.handed_back = self.manual and not one.manual
                if one.manual and not self.manual:
                    self.hands.reset()
                    self.pedals = Pedals()
                self.manual = one.manual
            case Pedals():
                self.pedals = one
            case Functions():
                self.functions, self.switched = frozenset(one.on), True
            case Sky():
                beam = None if self.switch is None else beam_of(self.switch, one.weather)
                self.outside = Outside(
                    weather=one.weather, grip=one.grip, range_model=one.range, beam=beam
                )
                self.changed = True
            case Crowd():
                if not isinstance(self.course, Roads):
                    raise ConfigError("only on roads with background traffic can vehicles leave")
                self.density.wanted = one.vehicles
            case Lamps():
                self.switch = one.switch
                beam = beam_of(one.switch, self.outside.weather)
                self.outside, self.changed = replace(self.outside, beam=beam), True


class DeskDriver:
    """Drives by the person or the stack; the stack always sees and reports what it would do."""

    def __init__(self, inner: StackAtWheel, desk: Desk) -> None:
        self.inner, self.desk = inner, desk

    @property
    def report(self) -> StackReport:
        """Returns the stack's report, without a tier while a person drives."""
        report = self.inner.report
        return replace(report, tier=None) if self.desk.manual else report

    @property
    def mode(self) -> str:
        """Returns the stack's mode, or "MANUAL [method]" while a person drives (A-274)."""
        if self.desk.manual:
            return f"MANUAL [{self.desk.pedals.method.value}]"
        return self.inner.mode

    def begin(self, table: ActorTable) -> None:
        """Passes the begin of a run on to the driver."""
        self.inner.begin(table)

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Takes the tick's inputs and returns the person's command while one drives, else the stack's."""
        desk = self.desk
        desk.turn(frame.tick)
        if desk.switched or desk.handed_back:
            self._switch()
        command = self.inner.act(frame)
        return desk.hands.update(desk.pedals, frame.ego.speed) if desk.manual else command

    def _switch(self) -> None:
        """Restarts our stack's controllers with the desk's functions; does nothing to another stack."""
        stack = self.inner.stack.stack
        switch = getattr(stack, "switch", None)
        if callable(switch):
            functions = self.desk.functions
            switch(getattr(stack, "functions", frozenset()) if functions is None else functions)


class DeskSupervisor:
    """Puts no person back on the road; supervises again after handing back."""

    def __init__(self, inner: Supervising, desk: Desk) -> None:
        self.inner, self.desk = inner, desk

    def observe(self, truth: WorldTruth) -> Supervision:
        """Takes the tick's inputs and returns its phase: none while a person drives."""
        self.desk.turn(truth.tick)
        if self.desk.handed_back and isinstance(self.inner, Supervisor):
            self.inner.reset()
        return Supervision.NONE if self.desk.manual else self.inner.observe(truth)

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """Returns the person's command as it is, else what the supervisor makes of the stack's."""
        return Action(command) if self.desk.manual else self.inner.act(command, report)


class DeskBackend(ChangedBackend):
    """Wraps a backend and changes its surroundings as the person does at the desk."""

    def __init__(self, inner: Backend, desk: Desk) -> None:
        super().__init__(inner, lambda: desk.outside if desk.changed else None)


class DeskScript:
    """Wraps a script so that the person may end the drive and change the number of vehicles."""

    def __init__(self, inner: Script, desk: Desk) -> None:
        self.inner, self.desk = inner, desk

    @property
    def ended(self) -> bool:
        """Returns True when the person or the script has ended the drive."""
        return self.desk.source.ended or self.inner.ended

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Returns the script's commands to actors and those that change the number of vehicles."""
        return [*self.inner.step(truth), *self.desk.density.words(truth)]


# How many background vehicles are on the road, changed while a run is driven.
#
# Who leaves and who comes back follows from the moment alone, so the same inputs at the same ticks
# give the same run. Vehicles come back where they left, as soon as there is room; if more are wanted
# than the run began with, its reserve is called in, and enters where traffic lets in those who are late.


class Density:
    """Sends background vehicles away or calls them, as many as `wanted` (None: as the run has them)."""

    def __init__(self, vehicles: int = 0) -> None:
        """vehicles: that the run begins with."""
        self.vehicles = vehicles
        self.wanted: int | None = None
        self.away: set[int] = set()
        self.called = 0  # of the reserve

    def words(self, truth: WorldTruth) -> list[ActorCommand]:
        """Returns commands that bring the number of vehicles to `wanted`; none where that is None.

        The farthest from the ego leave first. The nearest come back first, where they left, with ROOM m to
        all others and FROM_EGO m to the ego; missing ones are called from the reserve. Changes `away` and
        `called`: call it once per tick.
        """
        if self.wanted is None:
            return []
        return [*self._call(truth), *self._leave_or_come(truth, self.wanted)]

    def _call(self, truth: WorldTruth) -> list[ActorCommand]:
        """Returns commands that call vehicles of the reserve which are wanted for the first time."""
        assert self.wanted is not None
        reserve = [name for name in truth.table.names if name.startswith(RESERVE_NAME)]
        first, self.called = self.called, max(self.called, self.wanted - self.vehicles)
        return [ActorCommand(name, present=True) for name in reserve[first : self.called]]

    def _leave_or_come(self, truth: WorldTruth, wanted: int) -> list[ActorCommand]:
        """Returns commands that send vehicles away, or call back those with room and far from the ego.

        ROOM m to all others and FROM_EGO m to the ego.
        """
        states, names = truth.states, truth.table.names
        here = [i for i in np.flatnonzero(states.present).tolist() if i > 0]
        from_ego = np.hypot(states.x - states.x[0], states.y - states.y[0])
        if len(here) > wanted:
            leaving = sorted(here, key=lambda i: (-from_ego[i], i))[: len(here) - wanted]
            self.away.update(leaving)
            return [ActorCommand(names[i], present=False) for i in leaving]
        coming: list[int] = []
        for i in sorted(self.away, key=lambda i: (from_ego[i], i)):
            if len(here) == wanted:
                break
            others = [0, *here]
            near = np.hypot(states.x[others] - states.x[i], states.y[others] - states.y[i])
            if near.min() > ROOM and from_ego[i] > FROM_EGO:
                coming.append(i)
                here.append(i)
        self.away.difference_update(coming)
        return [ActorCommand(names[i], present=True) for i in coming]


# From the pedals and the wheel of a person to a command: reverse, and a wheel that keys can turn.


class Hands:
    """Turns a person's pedals into commands; `reset` when the person takes over."""

    def __init__(self, dt: float) -> None:
        self.dt = dt
        self.reset()

    def reset(self, steer: float = 0.0) -> None:
        """Starts forward, with the wheel turned to `steer`, -1 to 1."""
        self.reverse = False
        self.pressed = 0.0  # s for which the brake has been held at standstill
        self.steer = steer

    def update(self, pedals: Pedals, v: float) -> VehicleCommand:
        """Returns the command of this tick. v: m/s along the body, negative in reverse."""
        self._select_gear(pedals, v)
        self._turn(pedals, v)
        throttle, brake = pedals.throttle, pedals.brake
        if self.reverse:
            throttle, brake = brake, throttle
        return VehicleCommand(throttle, brake, self.steer, pedals.handbrake, self.reverse)

    def _select_gear(self, pedals: Pedals, v: float) -> None:
        """Selects reverse after HOLD_TO_REVERSE s of brake at standstill, forward by the throttle."""
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
        """Turns the wheel by the pedals at `v` m/s: directly, or by keys or fingers at a limited rate."""
        if pedals.method not in (Method.KEYBOARD, Method.TOUCH):
            self.steer = pedals.steer
            return
        limit = min(1.0, KEY_A_LAT * WHEELBASE / max(v * v, 1e-6) / MAX_STEER)
        wanted = pedals.steer * limit
        back = abs(wanted) < abs(self.steer) or wanted * self.steer < 0.0
        most = (RETURN if back else TURN) * self.dt * max(limit, 0.05)
        self.steer += min(max(wanted - self.steer, -most), most)
