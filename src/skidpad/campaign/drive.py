"""The one loop: world, supervisor, stack, log. Everything that Skidpad finds out begins here.

    frame = backend.reset(setup, seed)
    each tick:  phase   = supervisor.observe(truth)       who drives now: the stack, or recovery
                command = stack.tick(frame)               it sees sensors only, never the truth
                action  = supervisor.act(command)
                words   = script.step(truth)              what other actors are told, in scenarios
                log the moment, then step the world

The log is the only result. Whatever is said about a drive later is computed from it.
"""

from __future__ import annotations

import traceback
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol

from skidpad.campaign.backends import make_backend
from skidpad.campaign.cells import BackendChoice, BackendKind, Cell, Driver
from skidpad.campaign.snapshots import Snapshots
from skidpad.campaign.starts import start_of
from skidpad.core.errors import StackError, require_choice
from skidpad.core.frames import SensorFrame
from skidpad.core.setup import ActorCommand, ActorSetup, Setup, TrafficSetup
from skidpad.core.states import StackReport, VehicleCommand, WorldTruth
from skidpad.core.vocabulary import Outcome, SensorLevel, Supervision
from skidpad.core.weather import Weather
from skidpad.physics.presets import find_weather
from skidpad.physics.types import EGO_TYPE
from skidpad.recording.events import NoticeSource, Relocation
from skidpad.recording.runlog import LogHeader, RunLog
from skidpad.recording.ticks import TickLog
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap
from skidpad.sensors.twelve import twelve_sensors
from skidpad.simulation.backend import Backend
from skidpad.simulation.recovery import Action, Clearance, RecoverySettings, Supervisor
from skidpad.stack import settings as options
from skidpad.stack.adas import AdasStack
from skidpad.stack.configurations import functions_of
from skidpad.stack.interface import Stack
from skidpad.stack.loading import GuardedStack, load_stack


class Watcher(Protocol):
    """Looks on while a run is driven: snapshots, clocks, films."""

    def see(self, frame: SensorFrame, truth: WorldTruth, report: StackReport | None) -> None:
        """One moment, after the stack has answered it."""
        ...


@dataclass(frozen=True, slots=True)
class Run:
    """What a drive leaves behind."""

    log: RunLog
    outcome: Outcome
    error: str = ""  # traceback of a stack that failed
    snapshots: tuple[Path, ...] = ()


def drive(
    stack: type[Stack] | str | int,
    *,
    map: str | Path = "figure8",
    weather: str | Weather = "clear-noon",
    seed: int = 0,
    duration: float = 500.0,
    traffic: str = "fixed",
    vehicles: int = 20,
    sensors: str = "pixels",
    profile: str = "recommended",
    settings: Mapping[str, Any] | None = None,
    options: Mapping[str, Any] | None = None,
    out: str | Path | None = None,
    backend: BackendChoice | None = None,
) -> Run:
    """Drive a stack and return the log.

    stack: a class with the stack interface, "module:Class", or 0 to 4 for a published
    configuration. settings: single settings over the profile. options: what the class is given as
    its settings. out: a folder for snapshots of collisions. backend: None is the embedded one.
    """
    label, kind, functions = _named(stack)
    cell = Cell(
        driver=Driver(label=label, functions=functions, stack=label, options=dict(options or {})),
        weather=find_weather(weather) if isinstance(weather, str) else weather,
        seed=seed,
        profile=profile,
        settings=_load_settings(profile, settings),
        map=str(map),
        duration=duration,
        traffic=traffic,
        vehicles=vehicles,
        level=SensorLevel(require_choice("sensors", sensors, [v.value for v in SensorLevel])),
        backend=BackendChoice() if backend is None else backend,
    )
    return run_cell(cell, kind, folder=None if out is None else Path(out))


def _named(stack: type[Stack] | str | int) -> tuple[str, type[Stack] | None, Any]:
    if isinstance(stack, int):
        return str(stack), None, functions_of(stack)
    if isinstance(stack, str):
        return stack, load_stack(stack), frozenset()
    return f"{stack.__module__}:{stack.__qualname__}", stack, frozenset()


def _load_settings(profile: str, settings: Mapping[str, Any] | None) -> options.Settings:
    return options.load_profile(profile, settings)


class Supervising(Protocol):
    """What stands between stack and world."""

    def observe(self, truth: WorldTruth) -> Supervision:
        """The phase of the tick that `truth` begins."""
        ...

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """What is applied in this tick."""
        ...


class Unsupervised:
    """Nobody helps: the stack's command is what happens, to the end of the run."""

    def observe(self, truth: WorldTruth) -> Supervision:
        """The stack drives."""
        del truth
        return Supervision.NONE

    def act(self, command: VehicleCommand, report: StackReport | None = None) -> Action:
        """The command as it is."""
        del report
        return Action(command)


class Script(Protocol):
    """What moves other actors and says when it is over, such as a scenario player."""

    ended: bool

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Words to actors for the coming step."""
        ...


class NoScript:
    """Actors are left to the backend; only the duration ends the run."""

    ended = False

    def step(self, truth: WorldTruth) -> Sequence[ActorCommand]:
        """Nothing to say."""
        del truth
        return ()


@dataclass(frozen=True, slots=True)
class Drive:
    """A cell made ready: what drives, what supervises, in which world, after which script."""

    cell: Cell
    map: RoadMap
    setup: Setup
    stack: GuardedStack
    supervisor: Supervising
    script: Script = NoScript()

    @property
    def header(self) -> LogHeader:
        """What the log says about the whole run."""
        return header_of(self.cell, self.map, self.setup.dt)


def prepare(cell: Cell, kind: type[Stack] | None = None) -> Drive:
    """Build the stack and all that surrounds it; StackError when it cannot be built."""
    map = load_map(cell.map)
    setup = setup_of(cell, map)
    stack = stack_of(cell, kind, setup, map)
    setup = with_sensors(setup, stack)
    return Drive(
        cell, map, setup, stack, Supervisor(map, recovery_settings(cell.settings), setup.dt)
    )


def run_cell(
    cell: Cell,
    kind: type[Stack] | None = None,
    *,
    backend: Backend | None = None,
    folder: Path | None = None,
    watchers: Sequence[Watcher] = (),
) -> Run:
    """Drive one cell of a campaign on `backend`, by default a fresh one of its choice.

    folder: where snapshots of collisions go. watchers: who else looks on; they change nothing.
    """
    backend = make_backend(cell.backend) if backend is None else backend
    try:
        ready = prepare(cell, kind)
        snapshots = Snapshots(folder, cell.driver.label, cell.weather.name, ready.setup.dt)
        run = loop(backend, ready, (snapshots, *watchers))
        return replace(run, snapshots=tuple(snapshots.paths))
    except StackError as error:  # it could not even be built
        map = load_map(cell.map)
        setup = setup_of(cell, map)
        backend.reset(setup, cell.seed)
        log = TickLog(backend.truth().table, header_of(cell, map, setup.dt), cell.weather.name, 1)
        return Run(log.finish(), Outcome.AGENT_ERROR, story(error))
    finally:
        backend.close()


def loop(backend: Backend, ready: Drive, watchers: Sequence[Watcher] = ()) -> Run:
    """The loop itself; it ends with duration or script, or when the stack fails."""
    cell, stack, supervisor = ready.cell, ready.stack, ready.supervisor
    script = ready.script
    ticks = round(cell.duration / ready.setup.dt)
    frame = backend.reset(ready.setup, cell.seed)
    truth = backend.truth()
    log = TickLog(truth.table, ready.header, cell.weather.name, ticks)
    outcome, error = Outcome.COMPLETED, ""
    for _ in range(ticks):
        phase = supervisor.observe(truth)
        if phase is not Supervision.NONE:
            frame = replace(frame, supervision=phase)
        try:
            command = stack.tick(frame)
        except StackError as failure:
            outcome, error = Outcome.AGENT_ERROR, story(failure)
            log.notice(truth.tick, NoticeSource.STACK, str(failure))
            break
        action = supervisor.act(command, stack.report)
        log.append(truth, frame, command, stack.report, phase)
        for watcher in watchers:
            watcher.see(frame, truth, stack.report)
        _note(log, truth, action)
        words = script.step(truth)
        if script.ended:
            break
        if action.relocate is not None:
            backend.relocate(action.relocate.pose, action.relocate.v)
        frame = backend.step(action.command, words)
        truth = backend.truth()
    return Run(log.finish(), outcome, error)


def _note(log: TickLog, truth: WorldTruth, action: Action) -> None:
    """Write down what supervisor and world did besides driving (A-194)."""
    for text in truth.notices:
        log.notice(truth.tick, NoticeSource.TRAFFIC, text)
    if action.notice:
        log.notice(truth.tick, NoticeSource.SUPERVISOR, action.notice)
    if action.relocate is not None and action.relocate.moved is not None:
        moved = action.relocate.moved
        log.relocated(Relocation(truth.tick, moved.reason, moved.shift, moved.old, moved.new))


def stack_of(cell: Cell, kind: type[Stack] | None, setup: Setup, map: RoadMap) -> GuardedStack:
    """The cell's driver, built: ours with its functions and settings, or anybody's."""
    driver = cell.driver
    if kind is None and driver.stack is not None and ":" in driver.stack:
        kind = load_stack(driver.stack)
    if kind is not None:
        return GuardedStack(kind, setup.specs, map, driver.options)
    plain = {
        "functions": sorted(f.value for f in driver.functions),
        "profile": cell.profile,
        "set": cell.settings.as_plain(),
    }
    return GuardedStack(AdasStack, setup.specs, map, plain)


def with_sensors(setup: Setup, stack: GuardedStack) -> Setup:
    """The set-up with the further sensors that the stack asks for (L-3)."""
    more = stack.sensors()
    return replace(setup, specs=(*setup.specs, *more), asked=frozenset(s.id for s in more))


def setup_of(cell: Cell, map: RoadMap) -> Setup:
    """The world of a cell."""
    s = cell.settings
    return Setup(
        map=cell.map,
        weather=cell.weather,
        specs=twelve_sensors(bumper_depth_fov_deg=s.bumper_depth_fov_deg),
        ego=ActorSetup(name="ego", type=EGO_TYPE, place=start_of(map), driver="scripted"),
        traffic=TrafficSetup(
            mode=cell.traffic,
            vehicles=cell.vehicles,
            allow_fewer=cell.allow_fewer,
            variant=s.traffic_positions.value,
            initial_limit_kmh=s.initial_limit_kmh,
            slow_in_weather=s.drivers,
        ),
        grip=s.grip,
        range_model=s.range,
        camera_effect=s.camera,
        rain_hides_night=s.night_rain is options.NightRain.RAIN_ONLY,
        mu_ref=s.mu_ref,
        level=cell.level,
        render_all=cell.render_all or _foreign_on_carla(cell),
    )


def _foreign_on_carla(cell: Cell) -> bool:
    """Nobody knows which images somebody else's stack reads, and CARLA sends none on demand."""
    return cell.backend.kind is BackendKind.CARLA and ":" in (cell.driver.stack or "")


def recovery_settings(s: options.Settings) -> RecoverySettings:
    """The supervisor's part of the settings (D-076, D-077, D-080)."""
    listing = s.clearance is options.Clearance.LISTING
    clearance = Clearance.LISTING if listing else Clearance.CHECKED
    if s.relocation is options.Relocation.STANDING:
        return RecoverySettings(warm_up=1.5, release_speed=0.0, clearance=clearance)
    return RecoverySettings(clearance=clearance)


def header_of(cell: Cell, map: RoadMap, dt: float) -> LogHeader:
    """What holds for the whole run, for its log."""
    about = {
        "config": cell.driver.label,
        "weather": cell.weather.name,
        "seed": str(cell.seed),
        "profile": cell.profile,
        "sensors": cell.level.value,
    }
    return LogHeader(map=map.name, map_hash=map.content_hash, dt=dt, about=about)


def story(error: StackError) -> str:
    """The traceback of a stack that failed."""
    cause = error.__cause__ or error
    return "".join(traceback.format_exception(cause)) + f"\n{error}"
