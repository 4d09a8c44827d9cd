"""A scenario file played tick by tick from Python, over the one loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from skidpad.campaign.cells.grip import template
from skidpad.campaign.driving.drivers import STACK, find_driver
from skidpad.campaign.driving.loop import Script
from skidpad.campaign.driving.outdoors import branch_backend
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.campaign.driving.stack_at_wheel import StackAtWheel
from skidpad.campaign.recipes.files import runs_of
from skidpad.campaign.runs.checkpoints import RunCheckpoint
from skidpad.campaign.runs.run import OpenRun, Run
from skidpad.core.courses import ActorMode
from skidpad.core.courses import Scenario as Course
from skidpad.core.errors import CheckpointError, ConfigError, require_choice
from skidpad.core.frames import SensorFrame
from skidpad.core.run import Friction
from skidpad.core.settings.parts import load_profile
from skidpad.core.setup import ActorCommand
from skidpad.core.states import ActorTable, StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.presets import find_weather
from skidpad.scenarios.elements import State
from skidpad.scenarios.shipped import find_scenario

PLAIN = "clear-noon"  # what a file leaves open of the weather, as in `skidpad play`
HOLDS, ENDS = " holds", " ends"  # how the story tells of a condition


@dataclass(frozen=True, slots=True)
class ActorState:
    """Where an actor is: the centre of its box, m, rad, m/s."""

    x: float
    y: float
    z: float
    yaw: float
    vx: float
    vy: float


class Scenario:
    """A scenario file that is played one tick after the other, as `skidpad play` plays it.

    Args:
        file: An OpenSCENARIO XML file, or a name of the catalogue.
        stack: Which stack drives the ego, as `--stack`: 0 to 4 (our own), "ideal" for the file
            itself, a class as "module:Class", ...
        actors: "physical" or "ideal", as `--actors`.
        weather: A preset's name; None for the weather of the file.
        parameters: Values of the file's parameters, by name.
        seed: Of sensor noise and traffic.
        duration: Longest simulated time, s.
        disturb: Other vehicles whose acceleration varies at random, as `--disturb`:
            "lead=accel", or "lead=accel(0.5,2)" for 0.5 m/s^2 and 2 s.

    Raises:
        ScenarioError: The file cannot be played; the message lists all reasons.

    Example:
        >>> scenario = Scenario("cut_in.xosc")
        >>> while scenario.step():
        ...     ego = scenario.states["ego"]
        >>> scenario.finish().outcome.value
    """

    def __init__(
        self,
        file: str | Path,
        *,
        stack: str | int = 2,
        actors: str = "physical",
        weather: str | Weather | None = None,
        parameters: Mapping[str, float | str] | None = None,
        seed: int = 1,
        duration: float = 120.0,
        disturb: Sequence[str] = (),
    ) -> None:
        words = [mode.value for mode in ActorMode]
        course = Course(
            parameters=dict(parameters or {}),
            actors=ActorMode(require_choice("actors", actors, words)),
            disturb=tuple(disturb),
        )
        settings = load_profile("recommended", {"grip": GripModel.PHYSICAL})
        spec = template(
            course=course,
            seed=seed,
            duration=duration,
            settings=settings,
            weather=find_weather(PLAIN),
            driver=find_driver(stack, label=STACK),
        )
        outside = find_weather(weather) if isinstance(weather, str) else weather
        (self.spec,) = runs_of(
            spec, [find_scenario(Path(file))], [outside], [Friction.REDUCED], [seed]
        )
        stage = stage_of(self.spec)
        assert stage.player is not None
        self.player = stage.player
        self._sent = _SentCommands(stage.script)
        self._wheel: _Wheel | None = None
        self._command: VehicleCommand | None = None
        self._open = OpenRun(
            self.spec, stage=replace(stage, script=self._sent), at_wheel=self._at_wheel
        )
        self._truth: WorldTruth | None = None
        self._told = 0
        self._conditions: dict[tuple[str, str], bool] = {}

    def _at_wheel(self, driver: StackAtWheel) -> _Wheel:
        """Returns the wheel that the caller's command turns, around the driver."""
        self._wheel = _Wheel(driver)
        self._wheel.command = self._command
        return self._wheel

    def step(self, n: int = 1, command: VehicleCommand | None = None) -> bool:
        """Drives n ticks; returns False when the scenario is over, or its stack failed.

        command: what drives the ego in these ticks in place of its stack, which still sees them.
        ConfigError for n < 1.
        """
        if n < 1:
            raise ConfigError(f"step needs at least 1 tick, got {n}")
        self._command = command
        if self._wheel is not None:
            self._wheel.command = command
        for _ in range(n):
            moment = self._open.step()
            if moment is None:
                self._open.close()
                return False
            self._truth = moment.truth
        return not self.player.ended

    def send(self, command: ActorCommand) -> None:
        """Sets what another actor does in the next step, in place of what the file says of it.

        Raises ConfigError for an actor that the file does not have.
        """
        if command.actor not in self.player.scenario.entities:
            known = ", ".join(self.player.scenario.entities)
            raise ConfigError(f"there is no actor {command.actor!r}; the file has {known}")
        self._sent.replace(command)

    def save(self) -> RunCheckpoint:
        """Returns the state after the last tick: actors, stack, story, random streams, log.

        Raises:
            CheckpointError: there was no step yet, or a class of yours holds state that cannot be
                copied; such a scenario is played from its beginning again.

        Example:
            >>> scenario = Scenario("cut_in.xosc")
            >>> _ = scenario.step(100)
            >>> there = scenario.save()
            >>> for brake in (0.2, 0.6, 1.0):
            ...     scenario.restore(there)
            ...     _ = scenario.step(40, VehicleCommand(brake=brake))
        """
        if self._truth is None:
            raise CheckpointError("a scenario needs at least one step before its state is saved")
        return RunCheckpoint(self, self._truth.tick)

    def restore(self, checkpoint: RunCheckpoint, branch: str = "") -> None:
        """Goes on from a state that `save` gave, as often as you like.

        Args:
            checkpoint: of this scenario.
            branch: sensor noise, choices of traffic and disturbances are drawn from random
                streams of this name from now on; without a name they go on as they were.
        """
        checkpoint.restore(self)
        if branch:
            branch_backend(self._open.backend, branch)
            self.player.disturbances.branch(branch)

    @property
    def t(self) -> float:
        """Returns the simulated time of the last tick, s."""
        return self.player.scene.t

    @property
    def states(self) -> dict[str, ActorState]:
        """Returns the state of every actor that is there, by name; empty before the first step."""
        if self._truth is None:
            return {}
        s = self._truth.states
        return {
            name: ActorState(*(float(c[i]) for c in (s.x, s.y, s.z, s.yaw, s.vx, s.vy)))
            for i, name in enumerate(self._truth.table.names)
            if s.present[i]
        }

    @property
    def elements(self) -> dict[str, str]:
        """Returns the state of every element of the storyboard that has begun, by its path with "::"."""
        return {"::".join(path): State(s).value for path, s in self.player.scene.states.items()}

    @property
    def conditions(self) -> dict[tuple[str, str], bool]:
        """Returns whether each condition that ever held holds now, by path of its element and its name."""
        story = self.player.scene.story
        for happening in story[self._told :]:
            what = happening.what.removeprefix("condition ")
            if what == happening.what:
                continue
            for ending, holds in ((HOLDS, True), (ENDS, False)):
                if what.endswith(ending):
                    key = "::".join(happening.path), what.removesuffix(ending)
                    self._conditions[key] = holds
        self._told = len(story)
        return dict(self._conditions)

    def finish(self) -> Run:
        """Closes the simulator and returns log and outcome, whether the scenario has ended or not.

        Raises ConfigError before the first step.
        """
        if self._truth is None:
            raise ConfigError("a scenario needs at least one step before it is finished")
        self._open.close()
        return self._open.finish()


class _Wheel:
    """Drives by the stack, whose command `command` replaces unless it is None."""

    def __init__(self, inner: StackAtWheel) -> None:
        self.inner = inner
        self.command: VehicleCommand | None = None

    @property
    def report(self) -> StackReport:
        """Returns what the stack says of itself."""
        return self.inner.report

    @property
    def mode(self) -> str:
        """Returns the stack's mode in its own words."""
        return self.inner.mode

    def begin(self, table: ActorTable) -> None:
        """Passes the begin of the run on to the driver."""
        self.inner.begin(table)

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the stack's command, or the one in its place; the stack sees the frame anyway."""
        own = self.inner.act(frame)
        return own if self.command is None else self.command


class _SentCommands:
    """Passes the script's commands on, which `replace` may change until the world steps."""

    def __init__(self, inner: Script) -> None:
        self.inner = inner
        self.words: list[ActorCommand] = []

    @property
    def ended(self) -> bool:
        """Returns True when the script has come to its end."""
        return self.inner.ended

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Returns the script's commands as a list that `replace` changes."""
        self.words = list(self.inner.step(truth))
        return self.words

    def replace(self, command: ActorCommand) -> None:
        """Replaces the commands of one actor in the last tick by this one."""
        self.words[:] = [c for c in self.words if c.actor != command.actor] + [command]
