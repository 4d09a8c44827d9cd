"""Runs that one stack drives together: tick by tick, and it answers all of a tick in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from skidpad.campaign.runs.run import OpenRun, Run
from skidpad.core.frames import SensorFrame
from skidpad.core.run import RunSpec
from skidpad.core.states import VehicleCommand
from skidpad.stack.interface import Stack, VectorStack
from skidpad.stack.loading import FOREIGN


class Answers:
    """What a stack of several runs answered in this tick, or how it failed."""

    def __init__(self, stack: VectorStack) -> None:
        self.stack = stack
        self.failure: BaseException | None = None
        self.commands: Mapping[int, VehicleCommand] = {}

    def ask(self, frames: Mapping[int, SensorFrame]) -> None:
        """Asks for the commands of all runs that go on."""
        try:
            self.commands = self.stack.tick(frames)
        except FOREIGN as error:
            self.failure = error

    def command_of(self, run: int) -> VehicleCommand:
        """Returns the command for a run; raises what the stack raised, or KeyError where it gave none."""
        if self.failure is not None:
            raise self.failure
        if run not in self.commands:
            raise KeyError(f"tick(frames) gave no command for run {run}")
        return self.commands[run]


def drive_together(stack: VectorStack, specs: Mapping[int, RunSpec]) -> dict[int, Run]:
    """Drives runs by one stack and returns what they leave, by their numbers.

    A failure in `tick` is the outcome of all runs that were going on, one in `begin` of its run alone.
    """
    answers = Answers(stack)
    runs: dict[int, OpenRun] = {}
    try:
        for k, spec in specs.items():
            runs[k] = OpenRun(spec, _seat(answers, k))
        while going := [k for k, run in runs.items() if run.sense()]:
            answers.ask({k: _frame_of(runs[k]) for k in going})
            for k in going:
                runs[k].answer()
        return {k: run.finish() for k, run in runs.items()}
    finally:
        for run in runs.values():
            run.close()


def _frame_of(run: OpenRun) -> SensorFrame:
    """Returns the frame of the tick that a run has begun."""
    assert run.stepper is not None
    return run.stepper.frame


def _seat(answers: Answers, run: int) -> type[Stack]:
    """Returns the class by which a run asks for its command, named as the stack that answers."""

    class Seat:
        def __init__(self, specs: Sequence[Any], map: Any, settings: Mapping[str, Any]) -> None:
            answers.stack.begin(run, specs, map, settings)

        def tick(self, frame: SensorFrame) -> VehicleCommand:
            """Returns what was answered for this run."""
            del frame
            return answers.command_of(run)

    Seat.__name__ = type(answers.stack).__name__
    return Seat
