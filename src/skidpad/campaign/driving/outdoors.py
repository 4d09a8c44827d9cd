"""Changes outside while a run is driven: told to the backend before the step in which they act."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import asin, atan2, cos, degrees, log, pi, radians, sin

from msgspec import structs

from skidpad.core.courses import Scenario
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import CheckpointError, FileError
from skidpad.core.frames import Frame
from skidpad.core.geometry import Pose
from skidpad.core.inputs import Outside
from skidpad.core.run import RunSpec
from skidpad.core.setup import ActorCommand, Setup
from skidpad.core.simulator import BackendKind
from skidpad.core.states import VehicleCommand, WorldTruth
from skidpad.core.weather import RANGES, Weather
from skidpad.physics.grip import RAIN_FULL
from skidpad.physics.optics import V_CLEAR, V_FOG
from skidpad.scenarios.actions.lights import beam_of_ego, lit_brake_lamps
from skidpad.scenarios.playing.player import Player
from skidpad.scenarios.reading.environment import Environment, Fall, Wetness
from skidpad.scenarios.signals import held_lights
from skidpad.simulation.backend import Backend
from skidpad.simulation.embedded.engine import EmbeddedBackend

NAME = "file"  # of the weather that a file describes
CLOCK = re.compile(r"\dT([01]\d|2[0-4]):([0-5]\d)")  # hour and minute of an ISO 8601 date and time
LATITUDE = radians(45.0)  # of the sun where a file says the time only, at an equinox; assumption
WATER = {  # wetness and standing water in percent by the words of the standard; our assumption
    Wetness.DRY: (0.0, 0.0),
    Wetness.MOIST: (50.0, 0.0),
    Wetness.PUDDLES: (100.0, 50.0),
    Wetness.LOW_FLOODED: (100.0, 80.0),
    Wetness.HIGH_FLOODED: (100.0, 100.0),
}


class ChangedBackend:
    """Wraps a backend and changes its surroundings before each step by what `news` returns (None: no change).

    hands: what becomes of the driver's command on its way.
    """

    def __init__(
        self,
        inner: Backend,
        news: Callable[[], Outside | None],
        hands: Callable[[VehicleCommand], VehicleCommand] = lambda command: command,
    ) -> None:
        self.inner, self.news, self.hands = inner, news, hands

    def reset(self, setup: Setup, seed: int) -> Frame:
        """Begins a run on the wrapped backend and returns its first frame."""
        return self.inner.reset(setup, seed)

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        """Changes the surroundings if there is news, then steps by the commands; returns the frame."""
        self._change()
        return self.inner.step(self.hands(command), actor_commands)

    def _change(self) -> bool:
        """Changes the surroundings if there is news; returns whether there was."""
        outside = self.news()
        if outside is not None:
            self.inner.change(outside)
        return outside is not None

    def make_step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand]) -> bool:
        """Steps as `step` does, but reads no sensors; returns whether the surroundings have changed.

        The wrapped backend must be the embedded one.
        """
        assert isinstance(self.inner, EmbeddedBackend)
        has_changed = self._change()
        self.inner.make_step(self.hands(command), actor_commands)
        return has_changed

    def truth(self) -> WorldTruth:
        """Returns the ground truth of the moment."""
        return self.inner.truth()

    def relocate(self, pose: Pose, v: float) -> None:
        """Puts the ego at another pose with speed v, m/s."""
        self.inner.relocate(pose, v)

    def change(self, outside: Outside) -> None:
        """Sets other surroundings from the next step on."""
        self.inner.change(outside)

    def branch(self, name: str) -> None:
        """Draws from streams of this name from the next step on; CheckpointError where it cannot."""
        branch_backend(self.inner, name)

    def close(self) -> None:
        """Releases the backend that this one wraps."""
        self.inner.close()


def branch_backend(backend: Backend, name: str) -> None:
    """Lets a backend draw from streams of this name; CheckpointError for one that cannot."""
    branch = getattr(backend, "branch", None)
    if branch is None:
        raise CheckpointError(
            "a branch with random streams of its own needs the embedded simulator"
        )
    branch(name)


NO_SURFACE = "a CARLA server does not lay the surface of the file's event: the road stays as it was"


class FileChanges:
    """Turns actions of a played file into surroundings: weather, road, lights, lamps, hidden actors."""

    def __init__(self, player: Player, spec: RunSpec) -> None:
        self.player, self.done, self.logged, self.noticed = player, 0, 0, 0
        settings = spec.settings
        self.serves_surface = spec.backend.backend != BackendKind.CARLA
        assert isinstance(spec.course, Scenario)
        # a speed among the settings goes before what the file says
        self.takes_wind = settings.world.wind_speed is None
        begun = player.scenario.start.environment
        laid = () if begun is None else begun.surface or ()
        # what stays whatever the file says later; a stored run's surface holds the file's first one too
        self.surface = tuple(patch for patch in spec.surface if patch not in laid)
        self.follows, self.mu_ref = spec.course.weather_of_file, settings.world.mu_ref
        self.outside = Outside(
            weather=spec.weather, grip=spec.grip, range_model=settings.sensors.range
        )

    @property
    def weather(self) -> Weather:
        """Returns the weather of the present moment."""
        return self.outside.weather

    def news(self) -> Outside | None:
        """Returns the surroundings if they have changed since the last call, else None."""
        scene = self.player.scene
        unseen = frozenset([actor.name for actor in scene.actors.values() if not actor.visible])
        lights, before = held_lights(scene) if scene.signals else (), self.outside
        is_same = lights == before.lights and unseen == before.unseen and not scene.lamps
        if is_same and self.done == len(scene.environments):
            return None  # as in most ticks
        now = replace(before, lights=lights, unseen=unseen)
        if scene.lamps:
            now = replace(now, brake_lamps=lit_brake_lamps(scene), beam=beam_of_ego(scene))
        for environment in scene.environments[self.done :]:
            self.done += 1
            if self.follows:
                weather = weather_of(environment, now.weather, f"{NAME}-{self.done + 1}")
                now = replace(now, weather=weather)
            if environment.friction_scale is not None:
                now = replace(now, mu_ref=self.mu_ref * environment.friction_scale)
            if environment.surface is not None:
                now = replace(now, patches=lay_beside(self.surface, environment))
                if not self.serves_surface:
                    scene.notices.append(NO_SURFACE)
            if environment.wind is not None and self.takes_wind:
                now = replace(now, wind=environment.wind)
        self.outside = now
        return None if now == before else now

    @property
    def is_silent(self) -> bool:
        """Whether the file has nothing new to say, and has changed nothing since it was asked for notices."""
        return self.done == self.logged and len(self.player.scene.notices) == self.noticed

    @property
    def depends_on_time(self) -> bool:
        """Whether surroundings may change while nothing happens in the file, as by lamps that flash."""
        return bool(self.player.scene.lamps)

    def new_notices(self) -> list[str]:
        """Returns what the scenario could not do since the last call, empty mostly."""
        new = self.player.scene.notices[self.noticed :]
        self.noticed += len(new)
        self.logged = self.done
        return new

    def hands(self, command: VehicleCommand) -> VehicleCommand:
        """Returns the driver's command with what the file's controllers override of it."""
        ego = self.player.scene.actors.get(self.player.scenario.ego)
        return command if ego is None else ego.overridden(command)


def lay_beside(
    surface: tuple[SurfacePatch, ...], environment: Environment | None
) -> tuple[SurfacePatch, ...]:
    """Returns a surface and what an environment of a file lays on the road besides, each patch once."""
    laid = () if environment is None else environment.surface or ()
    return (*surface, *(patch for patch in laid if patch not in surface))


def in_weather_of_file(run: RunSpec, environment: Environment | None) -> RunSpec:
    """Returns the run in the weather that its file describes; what the file leaves open is the run's."""
    assert isinstance(run.course, Scenario)
    course = structs.replace(run.course, weather_of_file=True)
    weather = run.weather if environment is None else weather_of(environment, run.weather, NAME)
    return structs.replace(run, course=course, weather=weather)


def weather_of(environment: Environment, base: Weather, name: str) -> Weather:
    """Returns `base` with what an environment says, cut to RANGES; `base` itself if it says nothing.

    name: of the weather that is returned.
    """
    if not environment.says_weather:
        return base
    found = {**_sky(environment), **_water(environment), **_air(environment)}
    within = {k: min(max(v, RANGES[k][0]), RANGES[k][1]) for k, v in found.items()}
    return replace(base, name=name, title=environment.name, **within)


def _sky(e: Environment) -> dict[str, float]:
    """Returns the weather fields of clouds in % and sun in deg that a file's environment changes."""
    found = {} if e.clouds is None else {"cloudiness": 100.0 * e.clouds}
    if e.sun_elevation_deg is not None:
        found["sun_altitude_deg"] = e.sun_elevation_deg
        found["sun_azimuth_deg"] = e.sun_azimuth_deg or 0.0
    elif e.time_of_day:
        found["sun_altitude_deg"], found["sun_azimuth_deg"] = sun_at(e.time_of_day)
    return found


def sun_at(time: str) -> tuple[float, float]:
    """Returns elevation and azimuth (from north, clockwise) of the sun in deg at an ISO 8601 time.

    At an equinox and 45 deg north, in solar time: date, seconds and zone do not matter. FileError
    for what is no date and time of ISO 8601.
    """
    found = CLOCK.search(time)
    if found is None:
        raise FileError(f"TimeOfDay: dateTime must be an ISO 8601 time, got {time!r}")
    hour, minute = int(found[1]), int(found[2])
    turn = (hour + minute / 60.0 - 12.0) * pi / 12.0
    elevation = asin(cos(LATITUDE) * cos(turn))
    azimuth = atan2(sin(turn), sin(LATITUDE) * cos(turn)) + pi
    return degrees(elevation), degrees(azimuth) % 360.0


def _water(e: Environment) -> dict[str, float]:
    """Returns the weather fields of rain and water on the road in % that an environment changes.

    Falling snow is not modelled: it counts by the sight that the file gives for it.
    """
    found = {}
    if e.fall is Fall.RAIN:
        found["precipitation"] = 100.0 * e.fall_mm_h / RAIN_FULL
    elif e.clouds is not None or e.visual_range is not None:
        found["precipitation"] = 0.0
    if e.wetness is not None:
        found["wetness"], found["precipitation_deposits"] = WATER[e.wetness]
    elif e.fall is Fall.RAIN and e.fall_mm_h > 0.0:
        found["wetness"] = 100.0
    return found


def _air(e: Environment) -> dict[str, float]:
    """Returns the weather fields of fog and temperature that a file's environment changes."""
    found = {}
    if e.visual_range is not None:
        sight = min(max(e.visual_range, 1.0), V_CLEAR)
        found["fog_density"] = 100.0 * log(V_CLEAR / sight) / log(V_CLEAR / V_FOG)
        found["fog_distance"] = found["fog_falloff"] = 0.0  # from the eye on, at all heights
    if e.temperature_c is not None:  # of the road too; assumption
        found["air_temperature_c"] = found["road_temperature_c"] = e.temperature_c
    return found


def environment_of(weather: Weather) -> Environment:
    """Returns the environment of a file that is nearest to a weather; `weather_of` is its inverse.

    The friction scale is 1: grip follows from the weather, and a scale would count twice.
    """
    water = weather.wetness, weather.precipitation_deposits
    nearest = min(
        WATER, key=lambda w: sum(abs(a - b) for a, b in zip(WATER[w], water, strict=True))
    )
    return Environment(
        name=weather.name,
        clouds=weather.cloudiness / 100.0,
        sun_elevation_deg=weather.sun_altitude_deg,
        sun_azimuth_deg=weather.sun_azimuth_deg,
        fall=Fall.RAIN if weather.precipitation > 0.0 else Fall.DRY,
        fall_mm_h=RAIN_FULL * weather.precipitation / 100.0,
        visual_range=V_CLEAR * (V_FOG / V_CLEAR) ** (weather.fog_density / 100.0),
        temperature_c=weather.air_temperature_c,
        wetness=nearest,
        friction_scale=1.0,
    )
