"""Play one OpenSCENARIO file: the player moves the actors, and something drives the ego."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from skidpad.campaign.cells import BackendChoice, BackendKind, Cell, Driver
from skidpad.campaign.drive import Drive, Run, Unsupervised, header_of, loop, story, with_sensors
from skidpad.campaign.snapshots import Snapshots
from skidpad.core.errors import BackendError, OutputError, StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.setup import Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import GripModel, Outcome, SensorLevel
from skidpad.core.weather import Weather
from skidpad.recording.files import write_bytes
from skidpad.recording.logfiles import write_log
from skidpad.recording.ticks import TickLog
from skidpad.scenarios.player import Player, Script, load
from skidpad.scenarios.scene import Mode
from skidpad.sensors.overlay import Lens
from skidpad.sensors.twelve import twelve_sensors
from skidpad.simulation.backend import Backend
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.stack import settings as options
from skidpad.stack.adas import AdasStack
from skidpad.stack.agents import load_agent
from skidpad.stack.configurations import functions_of
from skidpad.stack.interface import Stack
from skidpad.stack.loading import GuardedStack, load_stack

CONFIG, ERROR = "config.yaml", "error.txt"
STACK, IDEAL = "stack", "ideal"
AGENT = "agent:"
CRUISE = "cruise_speed"  # property of the ego, m/s
DURATION = 120.0  # s, unless the file ends before


@dataclass(frozen=True, slots=True, kw_only=True)
class Play:
    """One run of a scenario file. Speeds in m/s."""

    file: Path
    label: str  # of the run, for the log
    weather: Weather
    seed: int = 0
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    skill: Mapping[str, float] = field(default_factory=dict)  # of drivers, by actor
    ego: str | None = None
    controller: str = STACK  # or "ideal", module:Class, agent:PATH:CLASS
    config: int = 2  # of our stack (G-1)
    profile: str = "recommended"
    settings: options.Settings = field(default_factory=options.Settings)
    grip: GripModel = GripModel.NONE
    mu_ref: float = 0.9
    level: SensorLevel = SensorLevel.OBJECTS
    actors: Mode = Mode.PHYSICAL
    duration: float = DURATION
    overlay: bool = False  # rain drops on the cameras


@dataclass(frozen=True, slots=True)
class Played:
    """What a run of a scenario leaves behind."""

    run: Run
    outcome: Outcome
    triggered: bool  # every event of the scenario has begun
    route_length: float | None  # m, of the ego's route where the file names one


class Passenger:
    """Drives nothing: the scenario moves the ego."""

    def __init__(self, specs: object, map: object, settings: object) -> None:
        del specs, map, settings

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Nothing pressed."""
        del frame
        return VehicleCommand()


class BehindGlass(GuardedStack):
    """A stack whose cameras look through rain drops (B-160)."""

    lens: Lens

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """The same frame, its images behind drops."""
        images, extra = self.lens.seen(frame.images), self.lens.seen(frame.extra)
        return super().tick(replace(frame, images=images, extra=extra))


def play(wish: Play, backend: Backend | None = None, folder: Path | None = None) -> Played:
    """Play it; a stack that fails is an outcome, a file that is wrong raises."""
    script = load(wish.file, wish.parameters, wish.ego)
    ideal = wish.controller == IDEAL
    modes = dict.fromkeys(script.entities, wish.actors)
    modes[script.ego] = Mode.IDEAL if ideal else Mode.OTHER
    player = Player(script, modes=modes, skill=wish.skill, duration=wish.duration)
    cell = _cell(wish, script)
    setup = _setup(wish, script)
    backend = EmbeddedBackend() if backend is None else backend
    try:
        stack = _driver(wish, script, cell, setup)
        setup = with_sensors(setup, stack)
        ready = Drive(cell, script.map, setup, stack, Unsupervised(), player)
        watchers = (Snapshots(folder, "ego", wish.weather.name, setup.dt),)
        run = loop(backend, ready, watchers)
        stack.close()
    except StackError as error:  # it could not even be built
        backend.reset(setup, wish.seed)
        log = TickLog(backend.truth().table, header_of(cell, script.map, setup.dt), "", 1)
        run = Run(log.finish(), Outcome.AGENT_ERROR, story(error))
    finally:
        backend.close()
    length = script.ego_entity.properties.get("route_length")
    return Played(
        run,
        _outcome(run, player),
        player.triggered,
        None if length is None else float(length),
    )


@dataclass(frozen=True, slots=True)
class PlayTask:
    """What a worker is given."""

    wish: Play
    out: Path
    backend: BackendChoice


def play_to(wish: Play, out: Path, choice: BackendChoice | None = None) -> Played:
    """Play it and write log, events, set-up and error into a folder.

    On a CARLA server a process of its own drives: the wheel's threads can end theirs.
    """
    if out.exists() and any(out.iterdir()):
        raise OutputError(f"{out} is not empty; choose another --out")
    task = PlayTask(wish, out, BackendChoice() if choice is None else choice)
    if task.backend.kind is BackendKind.EMBEDDED:
        return play_task(task)
    from skidpad.campaign.pool import run_jobs
    from skidpad.campaign.worker import Job

    load(wish.file, wish.parameters, wish.ego)  # what is wrong in the file is said here
    (finished,) = run_jobs([Job(out.name, play_task, task)], 1)
    if finished.failure is not None:
        raise BackendError(f"{wish.file.name} on CARLA: {finished.detail.strip()}")
    played: Played = finished.value
    return played


def play_task(task: PlayTask) -> Played:
    """Play it here."""
    from skidpad.campaign.backends import WATCHDOG, keep_server, make_backend

    wish, out = task.wish, task.out
    keep_server(task.backend)
    played = play(wish, make_backend(task.backend, WATCHDOG), out)
    write_log(out, played.run.log)
    plain = {
        "file": wish.file.name,
        "parameters": dict(wish.parameters),
        "ego": wish.ego,
        "controller": wish.controller,
        "config": wish.config,
        "weather": asdict(wish.weather),
        "grip": wish.grip.value,
        "mu_ref": wish.mu_ref,
        "sensors": wish.level.value,
        "actors": wish.actors.value,
        "seed": wish.seed,
        "backend": task.backend.resolved(),
        "outcome": played.outcome.value,
        "triggered": played.triggered,
    }
    write_bytes(out / CONFIG, yaml.safe_dump(plain, sort_keys=False).encode())
    if played.run.error:
        write_bytes(out / ERROR, played.run.error.encode())
    return played


def _outcome(run: Run, player: Player) -> Outcome:
    """How it ended (G-2, L-7)."""
    if run.outcome is not Outcome.COMPLETED:
        return run.outcome
    if player.hit:
        return Outcome.COLLISION
    return Outcome.COMPLETED if player.triggered else Outcome.NOT_TRIGGERED


def _cell(wish: Play, script: Script) -> Cell:
    driver = Driver(label=wish.label, functions=functions_of(wish.config), stack=wish.controller)
    return Cell(
        driver=driver,
        weather=wish.weather,
        seed=wish.seed,
        profile=wish.profile,
        settings=wish.settings,
        map=script.map_name,
        duration=wish.duration + 1.0,
        vehicles=0,
        level=wish.level,
    )


def _setup(wish: Play, script: Script) -> Setup:
    ego, actors = script.setups()
    s = wish.settings
    return Setup(
        map=script.map_name,
        weather=wish.weather,
        specs=twelve_sensors(bumper_depth_fov_deg=s.bumper_depth_fov_deg),
        ego=ego,
        actors=actors,
        grip=wish.grip,
        range_model=s.range,
        camera_effect=s.camera,
        mu_ref=wish.mu_ref,
        level=wish.level,
    )


def cruise_speed(script: Script) -> float:
    """What the ego's cruise control is set to: as the file says, else its first speed (G-1)."""
    ego = script.ego_entity
    return float(ego.properties.get(CRUISE, ego.speed))


def _driver(wish: Play, script: Script, cell: Cell, setup: Setup) -> GuardedStack:
    kind, settings = _controller(wish, script, cell)
    if not wish.overlay:
        return GuardedStack(kind, setup.specs, script.map, settings)
    behind = BehindGlass(kind, setup.specs, script.map, settings)
    behind.lens = Lens(wish.weather, wish.seed)
    return behind


def _controller(wish: Play, script: Script, cell: Cell) -> tuple[type[Stack], dict[str, Any]]:
    if wish.controller == IDEAL:
        return Passenger, {}
    if wish.controller != STACK:
        return controller_class(wish.controller), {}
    return AdasStack, {
        "functions": sorted(f.value for f in cell.driver.functions),
        "profile": wish.profile,
        "set": wish.settings.as_plain(),
        "cruise_kmh": max(kmh_from_mps(cruise_speed(script)), 1.0),
    }


def controller_class(text: str) -> type[Stack]:
    """The class that `module:Class` or `agent:PATH:CLASS` names."""
    return load_agent(text.removeprefix(AGENT)) if text.startswith(AGENT) else load_stack(text)


def check_controller(text: str) -> None:
    """A controller that is not there is wrong input, not a run's outcome."""
    if text not in (STACK, IDEAL):
        controller_class(text)
