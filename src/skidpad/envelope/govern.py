"""`govern(stack, settings)`: any stack, kept inside the envelope of its grip and sight.

It lowers acceleration and nothing else: it takes throttle away and adds brake, never steers, and never
takes away the stack's own braking. It sees the frame that the stack sees, the map, two sensors of its
own, and the commands that it returned: no weather, no friction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite, nan
from typing import Any

from skidpad.core.frames import SensorFrame
from skidpad.core.specs import SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import Supervision
from skidpad.envelope.envelope import SENSORS, Envelope, EnvelopeSettings, read_pedals
from skidpad.envelope.govern_kernel import V_CREEP, Told, keep_inside
from skidpad.envelope.grip import Grip, make_grip
from skidpad.envelope.limits import Binding
from skidpad.roads.queries import RoadMap
from skidpad.stack.interface import Stack


@dataclass(frozen=True, slots=True)
class Allowed:
    """What the envelope said in a tick."""

    speed: float  # m/s
    binding: Binding
    grip: Grip
    reach: float  # m that is seen
    v: float = 0.0  # m/s that the car drives
    further: Mapping[str, float] = field(
        default_factory=dict
    )  # sight of lanes and walkers, bridges

    def numbers(self) -> dict[str, float]:
        """Returns what the envelope said as the columns of its recording."""
        return {
            "speed_mps": self.speed, "binding": float(self.binding), "grip": self.grip.value,
            "confidence": self.grip.confidence, "prior": self.grip.prior, "reach_m": self.reach,
            "ego_mps": self.v, **self.further,
        }  # fmt: skip


def with_pedals(command: VehicleCommand, throttle: float, brake: float) -> VehicleCommand:
    """Returns the command with these pedals, all else as it was; the very command where they are its own."""
    if throttle == command.throttle and brake <= command.brake:
        return command
    return replace(command, throttle=throttle, brake=brake)


class GovernedStack:
    """A stack inside the envelope; to all others it looks like the stack itself."""

    def __init__(
        self, inner: Stack, specs: Sequence[SensorSpec], map: RoadMap, settings: EnvelopeSettings
    ) -> None:
        self.inner, self.settings = inner, settings
        self.envelope = Envelope(specs, map, settings)
        self.applied = VehicleCommand()
        self.supervision = Supervision.NONE
        self.allowed: Allowed | None = None

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the specs of what the stack itself asks for, and the two sensors of the envelope."""
        ask = getattr(self.inner, "sensors", None)
        return (*(() if ask is None else ask()), *SENSORS)

    @property
    def report(self) -> StackReport:
        """What the stack says about its last tick; an empty report where it says nothing."""
        return getattr(self.inner, "report", None) or StackReport()

    @property
    def mode(self) -> str:
        """The stack's mode in its own words; "" for a stack without one."""
        return str(getattr(self.inner, "mode", ""))

    def __getattr__(self, name: str) -> Any:
        """Returns any other attribute of the stack, such as a switch; AttributeError where it has none."""
        if name == "inner":  # it could not be built
            raise AttributeError(name)
        return getattr(self.inner, name)

    def why_not_quick(self) -> str:
        """Returns the first reason why the envelope is asked tick by tick; "": kernels do it."""
        further = self.envelope.further is not None or self.envelope.bridges is not None
        return "its envelope looks for walkers, lane boundaries and bridges" if further else ""

    def pass_ticks(self, ticks: int, applied: VehicleCommand) -> None:
        """Takes in that kernels drove so many ticks; applied: the last command."""
        row = self.envelope.newest(ticks)[-1].tolist()
        speed, binding, value, confidence, prior, reach, v, shown = row
        grip = make_grip(value, shown, confidence, prior)
        self.applied, self.allowed = applied, Allowed(speed, Binding(int(binding)), grip, reach, v)

    def close(self) -> None:
        """Calls the stack's `close` where it has one."""
        close = getattr(self.inner, "close", None)
        if callable(close):
            close()

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the stack's command, with less acceleration where the envelope asks for it.

        Unchanged while a supervisor has the car, and with `watches`. A stack that has `limit_speed` is told
        the allowed speed first. A change of supervision resets the envelope.
        """
        if frame.supervision is not self.supervision:
            self.envelope.reset()
            self.supervision = frame.supervision
        driven, rules = frame.supervision is Supervision.NONE, self.envelope.rules
        told = self.envelope.update(frame, self.applied if driven else VehicleCommand())
        self.allowed = make_allowed(told, max(frame.ego.speed, 0.0), self.envelope.numbers())
        tell = getattr(self.inner, "limit_speed", None)
        if callable(tell) and rules.acts:
            tell(max(told.speed, V_CREEP))
        command = self.inner.tick(frame)
        acts = driven and rules.acts and isinstance(command, VehicleCommand)
        pedals = read_pedals(command) if acts else (nan, nan)
        if isfinite(sum(pedals) + frame.ego.speed):  # the guard refuses what is no number
            throttle, brake = keep_inside(
                self.envelope.held, told, float(frame.ego.speed), float(frame.ego.ay), *pedals,
                bool(command.reverse),
            )  # fmt: skip
            command = with_pedals(command, throttle, brake)
        self.applied = command
        return command


def make_allowed(told: Told, v: float, further: Mapping[str, float]) -> Allowed:
    """Returns what the envelope said at v in m/s, with names."""
    grip = make_grip(told.value, told.shown, told.confidence, told.prior)
    return Allowed(told.speed, Binding(told.binding), grip, told.reach, v, further)


def govern(stack: type[Stack], settings: EnvelopeSettings | None = None) -> type[Stack]:
    """Returns a class like `stack`, of the same name, whose stacks stay inside the envelope.

    Defaults of EnvelopeSettings hold where none are given.
    """
    set_to = settings or EnvelopeSettings()

    class Governed(GovernedStack):
        def __init__(
            self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
        ) -> None:
            super().__init__(stack(specs, map, settings), specs, map, set_to)

    Governed.__name__ = Governed.__qualname__ = stack.__name__
    return Governed
