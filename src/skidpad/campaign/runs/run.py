"""Drive one run and keep its log: in memory, or with everything else that it leaves in a folder."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.backends import make_backend
from skidpad.campaign.driving.loop import Driver, Moment, Sink, Stepper
from skidpad.campaign.driving.outdoors import ChangedBackend, FileChanges, branch_backend
from skidpad.campaign.driving.quick import Calls, QuickDrive, make_calls
from skidpad.campaign.driving.quick_parts import ANOTHER_SIMULATOR, find_parts
from skidpad.campaign.driving.readings import ReadingsRecorder
from skidpad.campaign.driving.run_setup import Stage, stage_of
from skidpad.campaign.driving.snapshots import Snapshots
from skidpad.campaign.driving.stack_at_wheel import StackAtWheel, driver_of, with_sensors
from skidpad.campaign.runs.checkpoints import RunCheckpoint
from skidpad.campaign.runs.log_sink import log_of
from skidpad.campaign.runs.state_files import CheckpointWriter
from skidpad.campaign.takeover.desk import Desk, DeskBackend, DeskDriver, DeskScript, DeskSupervisor
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import CheckpointError, StackError
from skidpad.core.run import RunSpec
from skidpad.core.simulator import BackendKind
from skidpad.core.text.told import clean
from skidpad.core.vocabulary import Outcome
from skidpad.recording.run.events import NoticeSource
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.readings import SensorReadings
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.roads.queries import RoadMap
from skidpad.scenarios.playing.player import Played
from skidpad.simulation.backend import Backend
from skidpad.stack.interface import Stack

LONGEST_STORY = 20_000  # characters of a traceback


@dataclass(frozen=True, slots=True)
class Run:
    """What a drive leaves behind.

    Attributes:
        log: every actor, sensor value, command and contact, tick by tick.
        outcome: how it ended: completed, collision, agent_error, ...
        error: the traceback of a stack that failed; empty otherwise.
        snapshots: pictures of collisions, where a folder was given and the sensors are pixels.
        triggered: every event of the scenario has begun; always true without a scenario.
        route_length: of the ego's route, m, where a scenario names one.
        off_road: (T,) for every tick, whether the ego has all wheels off every lane.
        road: the map's name, or its file.
        played: the story of a scenario, where one was played.
        readings: numbers of the further sensors that the stack asked for, where they give any.
        surface: what lay on parts of the road at the begin, by the run and by its scenario's file.
        laid: what its events have laid later.
        quick_ticks: how many ticks were driven in compiled blocks.
        why_not_quick: the first reason why none were; empty where some were.
    """

    log: RunLog
    outcome: Outcome
    error: str = ""
    snapshots: tuple[Path, ...] = ()
    triggered: bool = True
    route_length: float | None = None
    off_road: NDArray[np.bool_] | None = None
    road: str = ""
    played: Played | None = None
    readings: SensorReadings | None = None
    surface: tuple[SurfacePatch, ...] = ()
    laid: tuple[LaidSurface, ...] = ()
    quick_ticks: int = 0
    why_not_quick: str = ""

    def __repr__(self) -> str:
        log, about = self.log, self.log.header.about
        where = f"{self.road}, {', '.join(log.weathers)}, seed {about.get('seed', '-')}"
        return (
            f"<Run of {about.get('config', 'a driver')}: {self.outcome.value} after "
            f"{len(log) * log.header.dt:g} s on {where}; {len(log.contacts)} contacts of the ego>"
        )


def run(
    spec: RunSpec,
    kind: type[Stack] | None = None,
    *,
    stage: Stage | None = None,
    backend: Backend | None = None,
    folder: Path | None = None,
    sinks: Sequence[Sink] = (),
    desk: Desk | None = None,
    checkpoints_s: float | None = None,
) -> Run:
    """Drives a run on roads or in a scenario and returns what it leaves; a failing stack is an outcome.

    kind: the stack's class, if it is loaded. stage: the run's own by default. backend: by default a
    fresh one of the run's choice. folder: where snapshots of collisions go. sinks: further observers.
    desk: where a person sits, or sat. checkpoints_s: s between checkpoints in the folder.
    """
    opened = OpenRun(
        spec, kind, stage=stage, backend=backend, folder=folder, sinks=sinks, desk=desk
    )
    writer: CheckpointWriter | None = None
    if checkpoints_s is not None and folder is not None:
        every = max(round(checkpoints_s / opened.stage.setup.dt), 1)
        writer = CheckpointWriter(opened, folder, every)
    try:
        while opened.drive(1_000_000 if writer is None else writer.left):
            if writer is not None:
                writer.note_tick()
    finally:
        opened.close()
    return opened.finish()


def find_reason(spec: RunSpec) -> str:
    """Returns the first reason why a run is driven tick by tick; "": it has a quick way.

    Its world is built, and nothing is driven; another simulator than the embedded one is not asked.
    Raises StackError where the stack cannot begin.
    """
    if spec.backend.backend != BackendKind.EMBEDDED:
        return ANOTHER_SIMULATOR
    opened = OpenRun(spec)
    try:
        opened.begin()
        if opened.failure is not None:
            raise opened.failure
        return opened.why_not_quick
    finally:
        opened.close()


class OpenRun:
    """A run on its way: the one loop, stopped after each tick.

    at_wheel: what stands between the driver and the loop, as a desk does.
    """

    UNSAVED = ("quick",)  # it holds what others are

    def __init__(
        self,
        spec: RunSpec,
        kind: type[Stack] | None = None,
        *,
        stage: Stage | None = None,
        backend: Backend | None = None,
        folder: Path | None = None,
        sinks: Sequence[Sink] = (),
        desk: Desk | None = None,
        at_wheel: Callable[[StackAtWheel], Driver] | None = None,
    ) -> None:
        stage = stage_of(spec) if stage is None else stage
        backend = make_backend(spec.backend) if backend is None else backend
        changes = None if stage.player is None else FileChanges(stage.player, spec)
        if changes is not None:
            backend = ChangedBackend(backend, changes.news, changes.hands)
        if desk is not None:
            backend = DeskBackend(backend, desk)
            script = DeskScript(stage.script, desk)
            stage = replace(stage, supervisor=DeskSupervisor(stage.supervisor, desk), script=script)
        self.spec, self.stage, self.backend = spec, stage, backend
        self.log = log_of(spec, stage, desk)
        self.log.changes = changes
        self.snapshots = Snapshots(folder, spec.driver.label, spec.weather.name, stage.setup.dt)
        self.sinks = (self.log, self.snapshots, *sinks)
        self.recorder: ReadingsRecorder | None = None
        self.failure: StackError | None = None
        if desk is not None:
            at_wheel = partial(DeskDriver, desk=desk)
        self._kind, self._at_wheel = kind, at_wheel
        self.driver: StackAtWheel | None = None
        self.stepper: Stepper | None = None
        self.over = False
        self.quick: QuickDrive | None = None
        self.quick_ticks = 0
        self.why_not_quick = "nothing was driven"

    def step(self) -> Moment | None:
        """Drives one tick and returns its moment; None when the run is over, also by a stack that fails."""
        return self.answer() if self.sense() else None

    def drive(self, most: int) -> int:
        """Drives up to `most` ticks, the quick way where there is one; returns how many, 0 at the end."""
        return make_calls(self.ask(most))

    def ask(self, most: int) -> Calls:
        """Asks for the compiled calls that `drive` makes, and drives the other ticks; ends as it does."""
        ticks = 0 if self.quick is None else (yield from self.quick.drive(most))
        self.quick_ticks += ticks
        if ticks and self.stepper is not None and self.stepper.next_frame is None:
            return ticks
        return ticks + (self.step() is not None)  # so that each tick that has begun is whole

    def sense(self) -> bool:
        """Steps the world to the next tick, which `answer` completes; False when the run is over."""
        if self.over:
            return False
        if self.stepper is None:
            self.begin()
        if self.stepper is None or not self.stepper.sense():
            self._end()
        return not self.over

    def answer(self) -> Moment | None:
        """Lets the driver answer the tick that `sense` began; None where it fails."""
        assert self.stepper is not None, "sense() comes first"
        moment = self.stepper.answer()
        if moment is None:
            self._end()
        return moment

    def begin(self) -> None:
        """Builds driver and world, before the first tick; `sense` does it where it was not done."""
        self.stepper = self._begin()

    def save(self) -> RunCheckpoint:
        """Returns the state after the last tick, to which `restore` goes back.

        Raises:
            CheckpointError: nothing was driven yet, or a part holds state that cannot be copied.
        """
        if self.stepper is None:
            raise CheckpointError("a run needs at least one step before its state is saved")
        return RunCheckpoint(self, self.tick)

    def restore(self, checkpoint: RunCheckpoint, branch: str = "") -> None:
        """Goes back to a state that `save` gave, or forward again; moments before are void.

        branch: random streams of this name take the place of the run's own; "": they go on.
        """
        checkpoint.restore(self)
        if branch:
            self.branch(branch)

    def branch(self, name: str) -> None:
        """Draws from random streams of this name from now on, in place of the run's own."""
        branch_backend(self.backend, name)
        if self.stage.player is not None:
            self.stage.player.disturbances.branch(name)

    @property
    def tick(self) -> int:
        """Returns the tick that was driven last."""
        return self.backend.truth().tick

    def parts(self) -> list[Any]:
        """Returns what decides how the run goes on, without what looks on; the last says what acts next."""
        assert self.stepper is not None, "step() comes first"
        s = self.stepper
        if self.stage.player is not None:
            self.stage.player.settle()
        return [s.backend, s.driver, s.supervisor, s.script, self.log, [s.action, s.words]]

    def take_parts(self, parts: list[Any]) -> None:
        """Takes back what acts next, which `parts` gave last."""
        assert self.stepper is not None, "step() comes first"
        self.stepper.action, self.stepper.words = parts

    def close(self) -> None:
        """Releases the backend and what it holds; a run that was left before its end is over then."""
        if not self.over:
            self._end()
        self.backend.close()

    def finish(self) -> Run:
        """Returns what the run leaves, over or not."""
        stage, finished = self.stage, self.log.log.finish()
        return Run(
            finished,
            outcome_of(stage, finished) if self.failure is None else Outcome.AGENT_ERROR,
            "" if self.failure is None else story(self.failure),
            tuple(self.snapshots.paths),
            stage.has_triggered_all,
            stage.route_length,
            off_road(finished, stage.map),
            str(stage.setup.map),
            None if stage.player is None else stage.player.played,
            None if self.recorder is None else self.recorder.finish(),
            stage.setup.patches,
            tuple(self.log.laid),
            self.quick_ticks,
            self.why_not_quick if self.quick is None or self.quick_ticks else self.quick.why_not,
        )

    def _begin(self) -> Stepper | None:
        """Builds driver and world and returns their loop; None where the stack cannot be built."""
        stage, backend = self.stage, self.backend
        try:
            driver = driver_of(self.spec, stage, self._kind)
            setup = with_sensors(stage.setup, driver.stack)
        except StackError as error:
            backend.reset(stage.setup, self.spec.seed)
            for sink in self.sinks:
                sink.begin(backend.truth().table)
            self._note_failure(error)
            return None
        recorder = ReadingsRecorder(setup, driver.stack.stack)
        sinks = self.sinks
        if recorder.is_needed:
            self.recorder, sinks = recorder, (recorder, *sinks)
            for sink in self.sinks:
                sink.follow_readings(lambda: recorder.latest)
        for sink in self.sinks:
            sink.follow_surface(self.log.laid)
        frame = backend.reset(setup, self.spec.seed)
        self.driver = driver
        wheel = driver if self._at_wheel is None else self._at_wheel(driver)
        stepper = Stepper(backend, frame, wheel, stage.supervisor, stage.script, sinks)
        parts = find_parts(stepper, self.log.changes)
        if isinstance(parts, str):
            self.why_not_quick = parts
        else:
            self.why_not_quick = ""
            self.quick = QuickDrive(stepper, parts, self.log.log, self.log.changes)
        return stepper

    def _end(self) -> None:
        """Closes the stack, and notes in the log how it failed, if it did."""
        self.over = True
        if self.stepper is None or self.driver is None:
            return
        self.driver.stack.close()
        if self.stepper.failure is not None:
            self._note_failure(self.stepper.failure)

    def _note_failure(self, failure: StackError) -> None:
        """Keeps the stack's failure and notes it in the log at the present tick."""
        self.failure = failure
        self.log.log.notice(self.tick, NoticeSource.STACK, str(failure))


def outcome_of(stage: Stage, log: RunLog) -> Outcome:
    """Returns how a drive ended in which nothing failed; one with a supervisor goes on after a roll-over."""
    rolled = stage.player is not None and any(e.actor == 0 for e in log.roll_overs)
    return Outcome.ROLL_OVER if rolled and stage.outcome is not Outcome.COLLISION else stage.outcome


def off_road(log: RunLog, map: RoadMap) -> NDArray[np.bool_]:
    """Returns (T,) True in ticks in which the ego has all wheels off every lane (decision R-6)."""
    a, table = log.actors, log.table
    size = float(table.length[0]), float(table.width[0])
    return map.edge.off(a.x[:, 0], a.y[:, 0], a.z[:, 0], a.yaw[:, 0], *size)


def story(error: StackError) -> str:
    """Returns the traceback of a stack that failed, cut to LONGEST_STORY characters, and the error."""
    cause = error.__cause__ or error
    told = clean("".join(traceback.format_exception(cause)), LONGEST_STORY)
    return f"{told}\n{error}"
