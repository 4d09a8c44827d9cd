"""From the description of a run to its world and to the actors in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from math import isfinite, nan, radians
from pathlib import Path
from typing import Any

from msgspec import structs
from msgspec.json import encode

from skidpad.campaign.driving.file_drivers import FILE_DRIVERS
from skidpad.campaign.driving.file_stack import NAME as STACK_NAME
from skidpad.campaign.driving.file_stack import PilotConditions, PilotMaker
from skidpad.campaign.driving.governing import apply_envelope
from skidpad.campaign.driving.loop import Arrival, Script, Supervising, Timer, Unsupervised
from skidpad.campaign.driving.outdoors import lay_beside
from skidpad.campaign.driving.sharing import find_shared
from skidpad.campaign.driving.starts import start_of
from skidpad.campaign.user_files import road_file
from skidpad.core.environment.lidar_effects import LidarEffects
from skidpad.core.errors import ConfigError, FileError, StackError
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import Pose, kmh_from_mps
from skidpad.core.run import (
    ActorMode,
    AdasDriver,
    AgentDriver,
    CameraDriver,
    Passenger,
    ReferenceDriver,
    Render,
    Roads,
    RunSpec,
    Scenario,
    StackDriver,
)
from skidpad.core.settings.parts import NightRain, Relocation, TrafficSettings
from skidpad.core.setup import ActorSetup, CameraOptics, Setup, TrafficSetup, Wind
from skidpad.core.simulator import BackendKind
from skidpad.core.states import ActorTable, StackReport, VehicleCommand
from skidpad.core.text.told import describe_value
from skidpad.core.vocabulary import Control, Outcome
from skidpad.physics.types import EGO_TYPE, vehicle_type
from skidpad.physics.wind import wind_of_intensity
from skidpad.roads.bundled import load_map
from skidpad.roads.journeys import Journey
from skidpad.roads.queries import RoadMap
from skidpad.scenarios import scenario as scenarios
from skidpad.scenarios.playing.disturbing import Disturbances, read_disturbances
from skidpad.scenarios.playing.player import Player, setups
from skidpad.scenarios.registry import Names
from skidpad.scenarios.shipped import NAMES, scenario_file
from skidpad.sensors.pictures.overlay import Lens
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.simulation.recovery import RecoverySettings, Supervisor
from skidpad.stack.adas import AdasStack
from skidpad.stack.agents import load_agent
from skidpad.stack.channels.settings import CarModel
from skidpad.stack.interface import Stack
from skidpad.stack.loading import GuardedStack, import_class, load_stack

CRUISE = "cruise_speed"  # property of a scenario's ego, m/s
ROUTE_LENGTH = "route_length"  # another one, m


class StackAtWheel:
    """A stack that drives: it is given frames, and never the truth."""

    def __init__(self, stack: GuardedStack, lens: Lens | None = None) -> None:
        """lens: with rain drops on it, before all cameras (B-160)."""
        self.stack, self.lens = stack, lens

    @property
    def report(self) -> StackReport:
        """Returns what the stack reports of its last tick."""
        return self.stack.report

    @property
    def mode(self) -> str:
        """Returns the stack's mode in its own words."""
        return self.stack.mode

    def begin(self, table: ActorTable) -> None:
        """Does nothing: a stack does not know the other actors."""

    def act(self, frame: SensorFrame) -> VehicleCommand:
        """Returns the stack's answer to the frame."""
        if self.lens is not None:
            images, extra = self.lens.add_drops(frame.images), self.lens.add_drops(frame.extra)
            frame = replace(frame, images=images, extra=extra)
        return self.stack.tick(frame)


class Seated:
    """Drives nothing: the scenario moves the ego."""

    def __init__(self, specs: object, map: object, settings: object) -> None:
        del specs, map, settings

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Returns a command with no pedal pressed."""
        del frame
        return VehicleCommand()


@dataclass(frozen=True, slots=True)
class Stage:
    """Holds the world of a run, its supervisor, and the script that moves other actors."""

    map: RoadMap
    setup: Setup
    supervisor: Supervising
    script: Script
    player: Player | None = None  # of a scenario

    @property
    def cruise_kmh(self) -> float | None:
        """Returns the ego's cruise target of a scenario, else its first speed there, at least 1 km/h (G-1).

        None without a scenario.
        """
        if self.player is None:
            return None
        played = self.player.scenario
        first = played.start.entities[played.ego].speed
        speed = _number_of(played, CRUISE)
        return max(kmh_from_mps(first if speed is None else speed), 1.0)

    @property
    def has_triggered_all(self) -> bool:
        """Returns True when every event of the scenario has begun; always without a scenario."""
        return self.player is None or self.player.has_triggered_all

    @property
    def route_length(self) -> float | None:
        """Returns the length in m of the ego's route where the scenario names one, else None."""
        if self.player is None:
            return None
        return _number_of(self.player.scenario, ROUTE_LENGTH)

    @property
    def outcome(self) -> Outcome:
        """Returns how a drive without a failure ended: collision, completed, or not triggered (G-2, L-7)."""
        if self.player is not None and self.player.hit:
            return Outcome.COLLISION
        return Outcome.COMPLETED if self.has_triggered_all else Outcome.NOT_TRIGGERED


def _number_of(played: scenarios.Scenario, name: str) -> float | None:
    """Returns a property of the ego that is a number; None without it, FileError for another value."""
    text = played.ego_entity.properties.get(name)
    if text is None:
        return None
    try:
        value = float(text)
    except ValueError:
        value = nan
    if not isfinite(value):
        raise FileError(
            f"property {name} of the ego must be a number, got {describe_value(text, 100)}"
        )
    return value


def stage_of(spec: RunSpec) -> Stage:
    """Returns the world and script of a run on roads or in a scenario, built but not begun.

    Raises FileError for a file that cannot be played, ConfigError for a route of channels.
    """
    if isinstance(spec.course, Scenario):
        return _scenario(spec, spec.course)
    if not isinstance(spec.course, Roads):
        raise ConfigError("a route is driven by channels")
    return _roads(spec, spec.course)


def _roads(spec: RunSpec, course: Roads) -> Stage:
    """Returns the stage of a run on roads: map, traffic, supervisor and timer."""
    s = spec.settings.traffic
    file = road_file(course)
    map = load_map(file)
    ego = ActorSetup(name="ego", type=EGO_TYPE, place=start_of(map), driver=Control.SCRIPTED)
    traffic = TrafficSetup(
        mode=course.traffic,
        vehicles=course.vehicles,
        allow_fewer=course.allow_fewer,
        reserve=course.reserve,
        variant=s.traffic_positions.value,
        initial_limit_kmh=s.initial_limit_kmh,
        slow_in_weather=s.drivers,
        sees_patches=s.drivers_patches,
        variety=s.drivers,
        headways=s.headways,
    )
    setup = replace(setup_of(spec, file, ego), traffic=traffic)
    supervisor = Supervisor(map, recovery_settings(s), setup.dt)
    journey = journey_of(course, map)
    arrival = None if journey is None else Arrival(journey)
    return Stage(map, setup, supervisor, Timer(round(spec.duration / setup.dt), arrival))


def journey_of(course: Roads, map: RoadMap) -> Journey | None:
    """Returns the ego's way where the course has an end, with nothing driven yet; else None.

    ConfigError where the map's road ends before.
    """
    if not course.route_km:
        return None
    return Journey(map, map.place(start_of(map)), 1000.0 * course.route_km)


def _scenario(spec: RunSpec, course: Scenario) -> Stage:
    """Returns the stage of a run of a scenario file, with its wind and friction."""
    compiled = load_scenario(course, lambda: _pilot_conditions(spec))
    modes: dict[str, ActorMode | None] = dict.fromkeys(compiled.entities, course.actors)
    modes[compiled.ego] = ActorMode.IDEAL if isinstance(spec.driver, Passenger) else None
    played = Player(
        compiled,
        modes=modes,
        skill=course.skill,
        duration=spec.duration,
        end_on_collision=course.end_on_collision,
        seed=spec.seed,
        disturbances=Disturbances(
            read_disturbances(course.disturb, compiled), course.draws, spec.seed
        ),
    )
    ego, actors = setups(compiled)
    setup = replace(setup_of(spec, compiled.map_name, ego), actors=actors)
    environment = compiled.start.environment
    if environment is not None and environment.friction_scale is not None:
        setup = replace(setup, mu_ref=setup.mu_ref * environment.friction_scale)
    surface = lay_beside(spec.surface, environment)
    if surface and spec.backend.backend == BackendKind.CARLA:
        raise ConfigError("a surface in <RoadCondition> needs the embedded simulator")
    setup = replace(setup, patches=surface)
    if environment is not None and environment.wind is not None:
        setup = replace(setup, wind=wind_of(spec, environment.wind))
    return Stage(compiled.map, setup, Unsupervised(), played, played)


def _pilot_conditions(spec: RunSpec) -> PilotConditions:
    """Returns what the stacks of other actors drive in: as the ego, at the object level."""
    nobody = ActorSetup(name="", type=EGO_TYPE, place=Pose(0.0, 0.0))
    settings = spec.settings
    return PilotConditions(
        setup_of(spec, "", nobody),
        spec.seed,
        settings.profile,
        settings.stack.to_plain(),
        isinstance(spec.course, Scenario) and spec.course.weather_of_file,
    )


def load_scenario(
    course: Scenario, conditions: Callable[[], PilotConditions] = PilotConditions
) -> scenarios.Scenario:
    """Returns the compiled file of a course; ScenarioError lists all that keeps it from being played.

    conditions: gives those in which stacks of other actors drive. Within `share_setups` runs share a file
    that names no code.
    """

    def compile_file() -> tuple[scenarios.Scenario, bool]:
        names = _names_of(course, conditions())
        found = check_scenario(course, names=names).playable()
        read_disturbances(course.disturb, found)  # what is wrong in them is said here
        return found, not names.asked and not course.register

    file = file_of(course)
    changed = file.stat().st_mtime_ns if file.is_file() else 0
    key = encode(structs.replace(course, draws={}), order="deterministic"), file, changed
    return find_shared(key, compile_file)


def file_of(course: Scenario) -> Path:
    """Returns the file of a course: one of the catalogue by its name, else by its path."""
    return scenario_file(course.file) if course.file in NAMES else Path(course.file)


def check_scenario(course: Scenario, names: Names | None = None) -> scenarios.Compiled:
    """Returns the check of a course's file, with everything that was found, playable or not.

    names: that the file may use; None: those that the course says.
    """
    return scenarios.check(
        file_of(course),
        course.parameters,
        course.ego,
        maps=[Path(folder) for folder in course.maps],
        ignore_unsupported=course.ignore_unsupported,
        lenient=course.lenient,
        names=_names_of(course, PilotConditions()) if names is None else names,
    )


def _names_of(course: Scenario, conditions: PilotConditions) -> Names:
    """Returns the names that a course's file may use."""
    own = {**FILE_DRIVERS, STACK_NAME: PilotMaker(conditions)}
    return Names({**own, **_load_registered(course.register)}, strict=course.strict)


def _load_registered(texts: Sequence[str]) -> dict[str, type[Any]]:
    """Returns the classes that a user gives names, of texts NAME=module:Class; ConfigError otherwise."""
    found = {}
    for text in texts:
        name, equals, where = text.partition("=")
        if not equals or not name:
            raise ConfigError(
                f"--register takes NAME=module:Class, got {describe_value(text, 200)}"
            )
        found[name] = import_class(where, "class")
    return found


def setup_of(spec: RunSpec, map: str, ego: ActorSetup) -> Setup:
    """Returns the set-up that the run's settings and weather ask for, without actors and traffic."""
    world, sensors = spec.settings.world, spec.settings.sensors
    return Setup(
        map=map,
        weather=spec.weather,
        specs=twelve_sensors(bumper_depth_fov_deg=sensors.bumper_depth_fov_deg),
        ego=ego,
        grip=spec.grip,
        range_model=sensors.range,
        camera_effect=sensors.camera,
        camera_optics=CameraOptics(
            haze=sensors.camera_haze,
            drops=sensors.camera_drops,
            spray=sensors.camera_spray,
            exposure=sensors.camera_exposure,
        ),
        rain_hides_night=sensors.night_rain is NightRain.RAIN_ONLY,
        mu_ref=world.mu_ref,
        tyres=world.tyres,
        tyre_stiffness=world.tyre_stiffness,
        water_drag=world.water_drag,
        sheet_flow=world.sheet_flow,
        material_base=world.mu_ref if world.lane_material else None,
        lidar=sensors.lidar,
        lidar_effects=LidarEffects(
            fog=sensors.lidar_fog,
            wet_ground=sensors.lidar_wet_ground,
            dirt=sensors.lidar_dirt,
            drops_s=sensors.lidar_drops_s,
        ),
        spray=sensors.spray,
        radar_model=sensors.radar_model,
        radar_multipath=sensors.radar_multipath,
        radar_interference=sensors.radar_interference,
        radar_output=sensors.radar_output,
        stability=world.esc,
        anti_lock=world.anti_lock,
        stability_control=world.stability,
        roll_over=world.roll_over,
        wind=wind_of(spec),
        wakes=world.wakes,
        level=spec.sensors,
        render_all=spec.render is Render.ALL or _foreign_on_carla(spec),
        patches=spec.surface,
        scenery=spec.scenery,
        bodywork=spec.bodywork,
        quality=spec.quality,
    )


def wind_of(spec: RunSpec, said: tuple[float, float] | None = None) -> Wind | None:
    """Returns the wind that pushes vehicles; None: none does.

    said: speed in m/s and direction in rad of a scenario; a speed among the settings goes before it.
    """
    world = spec.settings.world
    if not world.wind:
        return None
    speed, towards = world.wind_speed, radians(world.wind_direction_deg)
    if speed is None and said is not None:
        speed, towards = said
    if speed is None:
        speed = wind_of_intensity(spec.weather.wind_intensity)
    return Wind(speed, towards, world.wind_gusts)


def _foreign_on_carla(spec: RunSpec) -> bool:
    """Returns True when a user's stack drives on CARLA: which images it reads is unknown before."""
    foreign = isinstance(spec.driver, (StackDriver, AgentDriver))
    return foreign and spec.backend.backend == BackendKind.CARLA


def recovery_settings(s: TrafficSettings) -> RecoverySettings:
    """Returns the supervisor's part of the traffic settings (D-076, D-077, D-080)."""
    if s.relocation is Relocation.STANDING:
        return RecoverySettings(warm_up=1.5, release_speed=0.0, clearance=s.clearance)
    return RecoverySettings(clearance=s.clearance)


def driver_of(spec: RunSpec, stage: Stage, kind: type[Stack] | None = None) -> StackAtWheel:
    """Returns the driver of a run, built; StackError when it cannot be. kind: its class, if loaded."""
    found, settings = _class_of(spec, stage, kind)
    # our own stack gives the map's arrays to kernels, which know one type of array
    chosen = kind or found
    map = stage.map if chosen is AdasStack else stage.map.read_only()
    chosen = apply_envelope(chosen, spec, stage.setup)
    common = tuple(spec for spec in stage.setup.specs if spec.id not in stage.setup.asked)
    stack = GuardedStack(chosen, common, map, settings)
    return StackAtWheel(stack, Lens(spec.weather, spec.seed) if spec.overlay else None)


def _class_of(
    spec: RunSpec, stage: Stage, kind: type[Stack] | None
) -> tuple[type[Stack], Mapping[str, object]]:
    """Returns the driver's class and its settings; ConfigError for channels, which need a route.

    kind: the class, if loaded, as a user's file runs once.
    """
    driver = spec.driver
    cruise = {} if stage.cruise_kmh is None else {"cruise_kmh": stage.cruise_kmh}
    match driver:
        case StackDriver():
            # a copy: whatever it does to them
            return kind or load_stack(driver.where), {**cruise, **deepcopy(driver.options)}
        case AgentDriver():
            return load_agent(driver.where), {}
        case Passenger():
            return Seated, {}
        case CameraDriver():
            from skidpad.stack.camera import driver as camera  # its network is read with it

            return camera.CameraDriver, cruise
        case ReferenceDriver():
            from skidpad.stack.reference.driver import ReferenceStack

            return ReferenceStack, {"seed": spec.seed, "car": asdict(ego_model()), **cruise}
        case AdasDriver():
            if driver.cruise_kmh is not None:
                cruise = {"cruise_kmh": driver.cruise_kmh}
            return AdasStack, {
                "functions": [*sorted(f.value for f in driver.functions), *driver.added],
                "profile": spec.settings.profile,
                "set": spec.settings.stack.to_plain(),
                **cruise,
            }
    raise ConfigError(f"{driver.label} needs a route to drive")


def ego_model() -> CarModel:
    """Returns what a driver knows of the ego's car."""
    t = vehicle_type(EGO_TYPE)
    return CarModel(
        length=t.length,
        width=t.width,
        wheelbase=t.wheelbase,
        steer_max=t.steer_max,
        a_drive=t.a_drive,
        a_brake=t.a_brake,
    )


def with_sensors(setup: Setup, stack: GuardedStack) -> Setup:
    """Returns the set-up with the further sensors that the stack asks for (L-3).

    A sensor that is there already as another stack asked for it is shared; StackError for a name
    that stands for another one.
    """
    there = {spec.id: spec for spec in setup.specs}
    wanted = stack.sensors()
    for spec in wanted:
        if there.get(spec.id, spec) != spec:
            raise StackError(f"{stack.name}.sensors(): {spec.id!r} is another sensor already")
    more = tuple(spec for spec in wanted if spec.id not in there)
    asked = setup.asked | {spec.id for spec in wanted}
    return replace(setup, specs=(*setup.specs, *more), asked=asked)
