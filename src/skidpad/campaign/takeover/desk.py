"""A person beside the stack: takes over and hands back, switches functions, changes the weather.

The desk stands around driver, supervisor and backend of the one loop. What the person does comes
from a source, live or recorded, as inputs by tick; so a drive with a person can be driven again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Protocol

from skidpad.campaign.driving.loop import Script, Supervising
from skidpad.campaign.driving.outdoors import ChangedBackend
from skidpad.campaign.driving.run_setup import StackAtWheel
from skidpad.campaign.takeover.density import Density
from skidpad.campaign.takeover.hands import Hands
from skidpad.core.errors import ConfigError
from skidpad.core.frames import SensorFrame
from skidpad.core.inputs import (
    Beam,
    Crowd,
    Functions,
    Input,
    Lamps,
    LampSwitch,
    Outside,
    Pedals,
    Sky,
    Timed,
    Wheel,
)
from skidpad.core.run import Function, Roads, RunSpec
from skidpad.core.setup import DT, ActorCommand
from skidpad.core.states import ActorTable, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Supervision
from skidpad.core.weather import Weather
from skidpad.physics.optics import visibility
from skidpad.simulation.backend import Backend
from skidpad.simulation.recovery import Action, Supervisor

LOW_VISIBILITY = 200.0  # m


class InputSource(Protocol):
    """Source of what a person does during a drive."""

    @property
    def ended(self) -> bool:
        """The person has ended the drive."""
        ...

    def at(self, tick: int) -> Sequence[Input]:
        """The inputs of this tick; asked once per tick, in order."""
        ...


class Recorded:
    """Inputs that were given before."""

    def __init__(self, inputs: Iterable[Timed]) -> None:
        self._by_tick: dict[int, list[Input]] = {}
        for timed in inputs:
            self._by_tick.setdefault(timed.tick, []).append(timed.input)

    @property
    def ended(self) -> bool:
        """Never: whoever drives again says how far."""
        return False

    def at(self, tick: int) -> Sequence[Input]:
        """What was done then."""
        return self._by_tick.get(tick, ())


def beam_of(switch: LampSwitch, weather: Weather) -> Beam:
    """What the headlights do: automatic is low beam by night and in low visibility (A-218, A-219)."""
    if switch is not LampSwitch.AUTO:
        return Beam[switch.name]
    dim = weather.is_night or visibility(weather) < LOW_VISIBILITY
    return Beam.LOW if dim else Beam.OFF


class Desk:
    """State: the driver in charge, what is switched on, what is outside, and all inputs so far."""

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
        """Take the inputs of a tick, once."""
        if tick == self._tick:
            return
        self._tick = tick
        self.handed_back = self.switched = self.changed = False
        for one in self.source.at(tick):
            self.inputs.append(Timed(tick, one))
            self._take(one)

    def _take(self, one: Input) -> None:
        """Takes over one input of the person; raises ConfigError for one that the course cannot follow."""
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
    """The stack and the person: the stack always sees and says what it would do."""

    def __init__(self, inner: StackAtWheel, desk: Desk) -> None:
        self.inner, self.desk = inner, desk

    @property
    def report(self) -> StackReport:
        """What the stack says; no tier acts while a person drives."""
        report = self.inner.report
        return replace(report, tier=None) if self.desk.manual else report

    @property
    def mode(self) -> str:
        """The stack's mode, or that a person drives, and by what (A-274)."""
        if self.desk.manual:
            return f"MANUAL [{self.desk.pedals.method.value}]"
        return self.inner.mode

    def begin(self, table: ActorTable) -> None:
        """The run begins."""
        self.inner.begin(table)

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """The person's command, or the stack's."""
        desk = self.desk
        desk.turn(frame.tick)
        if desk.switched or desk.handed_back:
            self._switch()
        command = self.inner.act(frame)
        return desk.hands.update(desk.pedals, frame.ego.speed) if desk.manual else command

    def _switch(self) -> None:
        """Our stack's controllers start afresh with these functions; a foreign stack has none."""
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
        """The phase of the tick that `truth` begins."""
        self.desk.turn(truth.tick)
        if self.desk.handed_back and isinstance(self.inner, Supervisor):
            self.inner.reset()
        return Supervision.NONE if self.desk.manual else self.inner.observe(truth)

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """What is applied in this tick."""
        return Action(command) if self.desk.manual else self.inner.act(command, report)


class DeskBackend(ChangedBackend):
    """The backend, which is told of the person's changes."""

    def __init__(self, inner: Backend, desk: Desk) -> None:
        super().__init__(inner, lambda: desk.outside if desk.changed else None)


class DeskScript:
    """A script that also ends when the person ends the drive, and thins out the traffic."""

    def __init__(self, inner: Script, desk: Desk) -> None:
        self.inner, self.desk = inner, desk

    @property
    def ended(self) -> bool:
        """It is over."""
        return self.desk.source.ended or self.inner.ended

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Words to actors for the coming step."""
        return [*self.inner.step(truth), *self.desk.density.words(truth)]
