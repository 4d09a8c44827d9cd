"""From the description of a run to its world and to the actors in it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, nan, radians

from skidpad.campaign.driving.course_file import load_scenario
from skidpad.campaign.driving.file_stack import PilotConditions
from skidpad.campaign.driving.loop import Arrival, Script, Supervising, Timer, Unsupervised
from skidpad.campaign.driving.outdoors import lay_beside
from skidpad.campaign.driving.starts import start_of
from skidpad.campaign.user_files import road_file
from skidpad.core.courses import ActorMode, Roads, Scenario
from skidpad.core.environment.lidar_effects import LidarEffects
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.geometry import Pose, kmh_from_mps
from skidpad.core.run import AgentDriver, Passenger, Render, RunSpec, StackDriver
from skidpad.core.settings.parts import NightRain, Relocation, TrafficSettings
from skidpad.core.setup import ActorSetup, CameraOptics, Setup, TrafficSetup, Wind
from skidpad.core.simulator import BackendKind
from skidpad.core.text.told import describe_value
from skidpad.core.vocabulary import Control, Outcome
from skidpad.physics.types import EGO_TYPE
from skidpad.physics.wind import wind_of_intensity
from skidpad.roads.bundled import load_map
from skidpad.roads.journeys import Journey
from skidpad.roads.queries import RoadMap
from skidpad.scenarios import scenario as scenarios
from skidpad.scenarios.playing.disturbing import Disturbances, read_disturbances
from skidpad.scenarios.playing.player import Player, setups
from skidpad.sensors.published_sensors import twelve_sensors
from skidpad.simulation.recovery import RecoverySettings, Supervisor

CRUISE = "cruise_speed"  # property of a scenario's ego, m/s
ROUTE_LENGTH = "route_length"  # another one, m


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
