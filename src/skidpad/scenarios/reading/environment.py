"""Environments of a file: weather, time of day and road condition, in SI."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from math import degrees
from typing import Any

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import ConfigError, FileError, MissingExtra
from skidpad.roads.queries import RoadMap
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Finding, Kind
from skidpad.scenarios.reading.moments import moment
from skidpad.simulation.world.patches import fit_patches
from skidpad.simulation.world.surface_files import read_surface

CELSIUS = 273.15  # K at 0 deg C
CLOUDS = {  # share of the sky, by both vocabularies
    "free": 0.0, "cloudy": 0.6, "overcast": 1.0, "rainy": 0.9, "skyOff": 0.0,
    "zeroOktas": 0.0, "oneOktas": 0.125, "twoOktas": 0.25, "threeOktas": 0.375, "fourOktas": 0.5,
    "fiveOktas": 0.625, "sixOktas": 0.75, "sevenOktas": 0.875, "eightOktas": 1.0, "nineOktas": 1.0,
}  # fmt: skip
HEAVY = 50.0  # mm/h, what an intensity of 1 means in files before 1.1
SURFACES = (".yaml", ".yml", ".crg")  # files of a road condition that say what lies on the road


class Fall(Enum):
    """What falls from the sky."""

    DRY = "dry"
    RAIN = "rain"
    SNOW = "snow"


class Wetness(Enum):
    """How much water is on the road, in OpenSCENARIO's words."""

    DRY = "dry"
    MOIST = "moist"
    PUDDLES = "wetWithPuddles"
    LOW_FLOODED = "lowFlooded"
    HIGH_FLOODED = "highFlooded"


WIND_MOST = 100.0  # m/s


@dataclass(frozen=True, slots=True, kw_only=True)
class Environment:
    """What the file says; None is left as the run has it."""

    name: str = ""
    clouds: float | None = None  # share of the sky
    sun_elevation_deg: float | None = None
    sun_azimuth_deg: float | None = None
    fall: Fall = Fall.DRY
    fall_mm_h: float = 0.0
    visual_range: float | None = None  # m
    temperature_c: float | None = None
    wind: tuple[float, float] | None = None  # m/s, and rad of the world that it blows to
    wetness: Wetness | None = None
    friction_scale: float | None = None  # of what the road has otherwise
    surface: tuple[SurfacePatch, ...] | None = None  # what lies on parts of the road
    time_of_day: str = ""  # ISO 8601
    moment: float | None = None  # the same in s since 1970
    clock_runs: bool = False  # the time of day goes on

    @property
    def says_weather(self) -> bool:
        """Returns whether it names something of the sky or the water on the road."""
        return any(
            value is not None
            for value in (
                self.clouds,
                self.sun_elevation_deg,
                self.visual_range,
                self.wetness,
                self.temperature_c,
                self.time_of_day or None,
                self.fall_mm_h or None,
            )
        )


def compile_environment(node: Node, map: RoadMap, findings: list[Finding]) -> Environment:
    """Compiles an <Environment> with its weather, road condition and time of day.

    map: on which surfaces that it names must fit. findings: get a note on files that are not read.
    """
    weather, road, time = (node.find(t) for t in ("Weather", "RoadCondition", "TimeOfDay"))
    wetness, scale, surface = None, None, None
    if road is not None:
        scale = road.number("frictionScaleFactor", 1.0)
        if scale < 0.0:
            raise road.error(f"frictionScaleFactor must be >= 0, got {scale:g}")
        wetness = road.choice("wetness", Wetness) if road.has("wetness") else None
        surface = _surface(road, map, findings)
    found = {} if weather is None else _weather(weather)
    return Environment(
        name=node.label(),
        wetness=wetness,
        friction_scale=scale,
        surface=surface,
        time_of_day="" if time is None else time.text("dateTime", ""),
        moment=None if time is None else moment_of(time),
        clock_runs=time is not None and time.flag("animation", default=False),
        **found,
    )


def _surface(road: Node, map: RoadMap, findings: list[Finding]) -> tuple[SurfacePatch, ...] | None:
    """Returns the patches of the files that a <RoadCondition> names; None where it has no <Properties>.

    Names are relative to the file's folder. Raises a Fault for one that cannot be read or fits no road.
    """
    properties = road.find("Properties")
    if properties is None:
        return None
    found: list[SurfacePatch] = []
    for node in properties.children("File"):
        path = node.file.parent / node.text("filepath")
        if path.suffix.lower() not in SURFACES:
            what = f"{path.name} is not read: surfaces end in {', '.join(SURFACES)}"
            findings.append(node.finding(what, Kind.NOTE))
            continue
        try:
            patches = read_surface(path)
        except (ConfigError, FileError, MissingExtra) as error:
            raise node.error(f"{error}") from None
        try:
            fit_patches(map, patches)
        except ConfigError as error:
            raise node.error(f"{path}: {error}") from None
        found += patches
    return tuple(found)


def moment_of(node: Node) -> float | None:
    """Returns the attribute dateTime in s since 1970, as of Greenwich without a zone; None without it."""
    text = node.text("dateTime", "")
    if not text:
        return None
    try:
        return moment(text)
    except ValueError:
        raise node.error(f"dateTime must be an ISO 8601 time, got {text!r}") from None


def _weather(node: Node) -> dict[str, Any]:
    """Returns the fields of the environment that the weather gives; None for what the file omits."""
    clouds = node.text("fractionalCloudCover", node.text("cloudState", ""))
    if clouds and clouds not in CLOUDS:
        raise node.unsupported_fault(f"clouds {clouds!r} are not known")
    sun, rain, fog, wind = (node.find(t) for t in ("Sun", "Precipitation", "Fog", "Wind"))
    fall, rate = Fall.DRY, 0.0
    if rain is not None:
        fall = rain.choice("precipitationType", Fall)
        old = rain.number("intensity", 0.0) * HEAVY
        rate = 0.0 if fall is Fall.DRY else rain.number("precipitationIntensity", old)
    return {
        "clouds": CLOUDS.get(clouds),
        "sun_elevation_deg": None if sun is None else degrees(sun.number("elevation")),
        "sun_azimuth_deg": None if sun is None else degrees(sun.number("azimuth")) % 360.0,
        "fall": fall,
        "fall_mm_h": rate,
        "visual_range": None if fog is None else fog.limit("visualRange"),
        "temperature_c": node.number("temperature") - CELSIUS if node.has("temperature") else None,
        "wind": None if wind is None else _wind(wind),
    }


def _wind(node: Node) -> tuple[float, float]:
    """Returns the speed in m/s and the direction of a <Wind>, to which it blows, as a heading in rad."""
    speed = node.number("speed")
    if not 0.0 <= speed <= WIND_MOST:
        raise node.error(f"speed must be in [0, {WIND_MOST:g}] m/s, got {speed:g}")
    return speed, node.number("direction")


@dataclass(frozen=True, slots=True)
class Clock:
    """The time of day, s since 1970, as it was set at `since` s; runs: it goes on by itself."""

    moment: float
    since: float
    runs: bool

    def now(self, t: float) -> float:
        """Returns the time of day, s since 1970, at t s of the scenario."""
        return self.moment + (t - self.since if self.runs else 0.0)
