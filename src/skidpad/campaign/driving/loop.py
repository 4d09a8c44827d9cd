"""The one loop: world, driver, supervisor, script, sinks. Everything that Skidpad finds out begins here.

    each tick:  frame, truth = backend.step(command)       the first tick has those of the start
                phase   = supervisor.observe(truth)        who drives now: the driver, or recovery
                command = driver.act(frame)                no driver is given the truth
                action  = supervisor.act(command)
                each sink sees the moment                  logs, recordings, snapshots, clocks
                words   = script.step(truth)               what other actors are told, and the end

What the sinks keep is the only result. Whatever is said about a drive later is computed from it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from skidpad.core.errors import StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.objects.slots import fill_slots
from skidpad.core.setup import ActorCommand
from skidpad.core.states import ActorTable, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Supervision
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.roads.journeys import Journey
from skidpad.simulation.backend import Backend
from skidpad.simulation.recovery import Action


class Driver(Protocol):
    """A driver of the ego: gives a command for each tick."""

    @property
    def report(self) -> StackReport:
        """Returns what it reports of its last tick."""
        ...

    @property
    def mode(self) -> str:
        """Returns the mode of its last tick in its own words; "" when it has none."""
        ...

    def begin(self, table: ActorTable) -> None:
        """Takes the actors of a run that begins."""
        ...

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the command for the coming step; the frame is all that a driver knows."""
        ...


class Supervising(Protocol):
    """Stands between driver and world: sees the truth and may replace commands."""

    def observe(self, truth: WorldTruth) -> Supervision:
        """Returns the phase of supervision in the tick that `truth` begins."""
        ...

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """Returns the action of this tick: the driver's command or another, and perhaps a relocation."""
        ...


class Script(Protocol):
    """Moves other actors and says when the run is over."""

    @property
    def ended(self) -> bool:
        """Returns True when the moment of the last step was the last one."""
        ...

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Returns the commands to actors for the coming step."""
        ...


@fill_slots
@dataclass(frozen=True, slots=True)
class Moment:
    """One tick once it is answered; its arrays are valid until the next step (decision X-11)."""

    frame: SensorFrame
    truth: WorldTruth
    driver: Driver
    command: VehicleCommand  # what the driver asks for
    report: StackReport  # what it says
    action: Action  # what the supervisor makes of it


class Sink:
    """Looks on and keeps what it wants; it changes nothing.

    sees_all: it is shown each tick. If not, `pass_ticks` may tell of many in which nothing happened.
    """

    sees_all = True

    def begin(self, table: ActorTable) -> None:
        """Takes the actors of a run that begins; does nothing unless overridden."""

    def follow_readings(self, latest: Callable[[], list[tuple[str, str]]]) -> None:
        """Takes a function that gives the latest readings of further sensors and functions, in words.

        It is called before `begin`, and only in runs that have any; does nothing unless overridden.
        """

    def follow_surface(self, laid: Sequence[LaidSurface]) -> None:
        """Takes the sequence that grows, before its tick is seen, by what events lay on the road.

        It is called before the first tick; does nothing unless overridden.
        """

    def see(self, moment: Moment) -> None:
        """Takes in what happened in one tick."""
        raise NotImplementedError

    def pass_ticks(self, ticks: int) -> None:
        """Takes in that so many ticks went by without an event; does nothing unless overridden."""


class Unsupervised:
    """No supervisor: the driver's command is what happens, to the end of the run."""

    def observe(self, truth: WorldTruth) -> Supervision:
        """Returns that the driver drives, always."""
        del truth
        return Supervision.NONE

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """Returns an action that is the command unchanged."""
        del report
        return Action(command)


class Timer:
    """A run that lasts so many ticks, in which actors are left to `script` or to the backend."""

    def __init__(self, ticks: int, script: Script | None = None) -> None:
        self.left, self.script = ticks, script

    @property
    def ended(self) -> bool:
        """Returns True when the ticks are over, or the script has ended before."""
        return self.left <= 0 or (self.script is not None and self.script.ended)

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Counts one tick down and returns the script's commands."""
        self.left -= 1
        return () if self.script is None else self.script.step(truth)


class Arrival:
    """A script without commands that ends when the ego has come to the end of its way."""

    def __init__(self, journey: Journey) -> None:
        self.journey, self.ended = journey, False

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Follows the ego and returns no commands."""
        s = truth.states
        self.journey.follow(float(s.x[0]), float(s.y[0]), float(s.z[0]))
        self.ended = self.journey.is_done
        return ()


def loop(
    backend: Backend,
    frame: SensorFrame,
    driver: Driver,
    supervisor: Supervising,
    script: Script,
    sinks: Sequence[Sink],
) -> StackError | None:
    """Drives from the frame of the backend's reset until the script ends or the driver fails.

    Returns None, or how the driver failed; the sinks do not see that moment.
    """
    stepper = Stepper(backend, frame, driver, supervisor, script, sinks)
    while stepper.step() is not None:
        pass
    return stepper.failure


class Stepper:
    """The loop, stopped after each tick: what the script says of the tick is known by then.

    Attributes:
        frame: of this tick.
        truth: of this tick.
        failure: how the driver failed, which ended the run; None: it did not.
    """

    def __init__(
        self,
        backend: Backend,
        frame: SensorFrame,
        driver: Driver,
        supervisor: Supervising,
        script: Script,
        sinks: Sequence[Sink],
    ) -> None:
        self.backend, self.driver, self.supervisor = backend, driver, supervisor
        self.script, self.sinks, self.frame = script, sinks, frame
        self.truth = backend.truth()
        self.failure: StackError | None = None
        self.action: Action | None = None  # of the last tick; None before the first one
        self.words: Sequence[ActorCommand] = ()  # what the script said in it
        self.next_frame: SensorFrame | None = (
            None  # of the next tick, if the world is there already
        )
        driver.begin(self.truth.table)
        for sink in sinks:
            sink.begin(self.truth.table)

    def step(self) -> Moment | None:
        """Drives one tick and returns its moment; None when the run is over."""
        return self.answer() if self.sense() else None

    def sense(self) -> bool:
        """Steps the world to the next tick; returns False when the run is over."""
        action = self.action
        if self.failure is not None or (action is not None and self.script.ended):
            return False
        if action is not None:
            if self.next_frame is not None:
                self.frame, self.next_frame = self.next_frame, None
            else:
                if action.relocate is not None:
                    self.backend.relocate(action.relocate.pose, action.relocate.v)
                self.frame = self.backend.step(action.command, self.words)
            self.truth = self.backend.truth()
        phase = self.supervisor.observe(self.truth)
        if phase is not Supervision.NONE:
            self.frame = replace(self.frame, supervision=phase)
        return True

    def answer(self) -> Moment | None:
        """Lets driver, supervisor, sinks and script answer this tick; None when the driver fails."""
        try:
            command = self.driver.act(self.frame)
            report = self.driver.report
        except StackError as failure:
            self.failure = failure
            return None
        action = self.action = self.supervisor.act(command, report)
        moment = Moment(self.frame, self.truth, self.driver, command, report, action)
        for sink in self.sinks:
            sink.see(moment)
        self.words = self.script.step(self.truth)
        return moment
