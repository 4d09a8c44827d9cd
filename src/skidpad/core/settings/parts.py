"""The settings of a run, in parts by what they act on, and the profiles that fill them.

The names of all settings are unique over the parts, so that a profile is one flat file and `--set`
one syntax. Each settles a place where the sources contradict themselves or leave something open
(M-14); what is not here has one reading only. Declared once each: `skidpad.core.settings.setting`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from functools import cache
from importlib.resources import files
from typing import Any

import msgspec

from skidpad.core.environment.lidar_effects import LidarFog
from skidpad.core.environment.tyres import REFERENCE, known_tyres
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.settings.setting import (
    Plain,
    SettingField,
    SettingsPart,
    describe_settings,
    setting_field,
)
from skidpad.core.settings.stack import StackSettings
from skidpad.core.vocabulary import (
    AntiLock,
    Clearance,
    GripModel,
    Headways,
    LidarModel,
    RadarModel,
    RadarOutput,
    RangeModel,
    StabilityControl,
)

PROFILES = ("recommended", "thesis_text", "thesis_listing", "preliminary")
# mu_ref by the tyre whose measured stop from 99.8 km/h on a dry road it gives (What Car?, n11594:
# 43.7 m on winter and 37.9 m on summer tyres at 5.5 C; here 44.2 m and 38.4 m)
TYRES = {"winter": 0.9, "summer": 1.05}


class Relocation(str, Enum):
    """D-076, D-077: what follows a relocation."""

    ROLLING = "rolling"  # 0.5 s of braking, then 5.5 m/s
    STANDING = "standing"  # 1.5 s of braking, then from rest


class TrafficPositions(str, Enum):
    """D-085, D-086: which published positions."""

    LISTING = "listing"
    TABLE = "table"


class NightRain(str, Enum):
    """D-094: camera effects of rain at night."""

    BOTH = "both"
    RAIN_ONLY = "rain_only"


class LaneTruth(str, Enum):
    """D-102, D-103: which vehicle is the true lead."""

    FOLLOWED = "followed"  # same lane and ahead, along the lane across road boundaries
    SAME_ROAD = "same_road"  # nearest with equal road and lane id, front or rear


@dataclass(frozen=True, slots=True, kw_only=True)
class WorldSettings(SettingsPart):
    """What weather does to tyres and road."""

    grip: GripModel = setting_field(GripModel.PHYSICAL, "M-1", "weather acts on tyres")
    mu_ref: float = setting_field(
        0.9,
        "M-1",
        "friction of a dry road: winter (tyres, 0.9), summer (1.05), a number",
        low=0.05,
        high=3.0,
        words=TYRES,
    )
    tyres: str = setting_field(
        REFERENCE, "M-1", "tyres of vehicles that have none of their own", choices=known_tyres
    )
    tyre_stiffness: bool = setting_field(
        False, "M-1, T-11", "slip stiffness falls on water, snow and ice"
    )
    water_drag: bool = setting_field(False, "M-1, T-11", "wheels push water aside")
    sheet_flow: bool = setting_field(
        False, "M-1, T-11", "rain is deeper where the map's superelevation is low"
    )
    lane_material: bool = setting_field(
        False, "M-1, T-11", "<material friction> of OpenDRIVE replaces mu_ref on its lane"
    )
    esc: bool = setting_field(
        True, "M-1, R-5", "stability and traction control, brake-force distribution"
    )
    anti_lock: AntiLock = setting_field(
        AntiLock.IDEAL, "M-1, T-11", "anti-lock brakes: ideal, or cycles by wheel speeds"
    )
    stability: StabilityControl = setting_field(
        StabilityControl.IDEAL,
        "M-1, T-11",
        "stability control, with `esc`: ideal, or by wheel speeds and yaw rate",
    )
    roll_over: bool = setting_field(False, "M-1, T-11", "vehicles can tip over in bends")
    wakes: bool = setting_field(
        False, "M-1, T-11", "air that lorries, buses and vans push aside acts on vehicles"
    )
    wind: bool = setting_field(False, "M-1, T-11", "wind pushes vehicles")
    wind_speed: float | None = setting_field(
        None,
        "M-1, T-11",
        "mean wind in m/s; none: of the scenario or wind_intensity",
        low=0.0,
        high=30.0,
    )
    wind_direction_deg: float = setting_field(
        90.0, "M-1, T-11", "where it blows to, left from the map's x axis", low=-360.0, high=360.0
    )
    wind_gusts: float = setting_field(
        0.0, "M-1, T-11", "standard deviation of gusts over the mean", low=0.0, high=0.5
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorSettings(SettingsPart):
    """What weather does to sensors, and how they are mounted."""

    range: RangeModel = setting_field(
        RangeModel.PHYSICAL, "M-1", "weather acts on depth, labels and radar"
    )
    lidar: LidarModel = setting_field(
        LidarModel.EXACT, "M-1, T-11", "lost and false returns of lidars in rain, fog, snow"
    )
    lidar_fog: LidarFog = setting_field(
        LidarFog.FIXED, "M-1, T-11", "drops of fog for lidars with lidar=physical"
    )
    lidar_wet_ground: bool = setting_field(
        False, "M-1, T-11", "water on the ground mirrors beams away, with lidar=physical"
    )
    lidar_dirt: float = setting_field(
        0.0,
        "M-1, T-11",
        "share of a lidar's window under dirt, with lidar=physical",
        low=0.0,
        high=0.95,
    )
    lidar_drops_s: float = setting_field(
        0.0,
        "M-1, T-11",
        "seconds that rain drops stay on a lidar's window, with lidar=physical",
        low=0.0,
        high=60.0,
    )
    spray: bool = setting_field(
        False, "M-1, T-11", "spray behind vehicles, for lidars with lidar=physical"
    )
    radar_model: RadarModel = setting_field(
        RadarModel.GEOMETRIC, "M-1, T-11", "echoes of the radar: noise, clutter, rain, wet radome"
    )
    radar_multipath: bool = setting_field(
        False, "M-1, T-11", "rails, walls and road mirror the radar, with radar_model=physical"
    )
    radar_interference: float = setting_field(
        0.0,
        "M-1, T-11",
        "share of vehicles whose radar disturbs ours, with radar_model=physical",
        low=0.0,
        high=1.0,
    )
    radar_output: RadarOutput = setting_field(
        RadarOutput.POINTS, "M-1, T-11", "rows of the radar, with radar_model=physical"
    )
    camera: bool = setting_field(True, "M-4", "weather acts on RGB images")
    camera_haze: bool = setting_field(
        False, "M-4, T-11", "contrast of RGB images falls with distance by Koschmieder's law"
    )
    camera_exposure: bool = setting_field(
        False, "M-4, T-11", "RGB images are exposed for daylight by a camera with limits"
    )
    camera_drops: bool = setting_field(
        False,
        "M-4, T-11",
        "drops of rain on the glass before RGB cameras, between strokes of a wiper",
    )
    camera_spray: bool = setting_field(
        False, "M-4, T-11", "spray behind fast vehicles on wet road, in RGB images"
    )
    night_rain: NightRain = setting_field(
        NightRain.BOTH, "D-094", "camera effects of rain at night"
    )
    bumper_depth_fov_deg: float = setting_field(
        100.0, "D-001", "field of view of the bumper depth camera", low=30.0, high=150.0
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficSettings(SettingsPart):
    """Background traffic, and what the supervisor does with an ego that has stopped driving."""

    drivers: bool = setting_field(
        True, "M-1, R-5", "background drivers differ and mind grip and sight"
    )
    drivers_patches: bool = setting_field(
        False, "M-1, T-11", "background drivers slow for patches of the surface, with `drivers`"
    )
    headways: Headways = setting_field(
        Headways.COMFORT, "M-1, R-5", "how closely background drivers follow, with `drivers`"
    )
    initial_limit_kmh: float | None = setting_field(
        None, "M-6", "limit of background drivers up to the first sign", low=5.0, high=250.0
    )
    traffic_positions: TrafficPositions = setting_field(
        TrafficPositions.LISTING, "D-085, D-086", "published positions of traffic"
    )
    relocation: Relocation = setting_field(
        Relocation.ROLLING, "D-076, D-077", "what follows a relocation"
    )
    clearance: Clearance = setting_field(Clearance.OTHERS, "D-080", "search for a free place")


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricSettings(SettingsPart):
    """What the metrics take for true."""

    lane_truth: LaneTruth = setting_field(
        LaneTruth.FOLLOWED, "D-102, D-103", "which vehicle is the true lead"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """All settings of a run; the defaults are the profile `recommended`."""

    profile: str = "recommended"  # whose values were filled in first
    world: WorldSettings = WorldSettings()
    sensors: SensorSettings = SensorSettings()
    traffic: TrafficSettings = TrafficSettings()
    stack: StackSettings = StackSettings()
    metrics: MetricSettings = MetricSettings()

    def with_values(self, values: Mapping[str, object]) -> Settings:
        """Returns a copy with some values replaced.

        Args:
            values: by the names of settings; text is read as on a command line.

        Raises:
            ConfigError: a name is unknown, or a value is not allowed.
        """
        given: dict[str, dict[str, Any]] = {}
        for name, value in values.items():
            one = find_setting(name)
            given.setdefault(PART_OF[name], {})[name] = one.read(value)
        parts = {part: replace(getattr(self, part), **new) for part, new in given.items()}
        return replace(self, **parts)

    def to_plain(self) -> dict[str, Plain]:
        """Returns all values by name, as a profile's file and config.yaml hold them."""
        plain: dict[str, Plain] = {}
        for part in PARTS:
            plain |= getattr(self, part).to_plain()
        return plain


PARTS: dict[str, type[SettingsPart]] = {
    "world": WorldSettings,
    "sensors": SensorSettings,
    "traffic": TrafficSettings,
    "stack": StackSettings,
    "metrics": MetricSettings,
}
PART_OF = {name: part for part, kind in PARTS.items() for name in describe_settings(kind)}
NAMES = tuple(PART_OF)


def find_setting(name: str) -> SettingField:
    """Returns the setting of this name; ConfigError with the nearest names for an unknown one."""
    require_choice("setting", name, NAMES, "skidpad profiles show recommended")
    return describe_settings(PARTS[PART_OF[name]])[name]


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """Returns the values of words like "camera=off" by name.

    Raises:
        ConfigError: a word has no equals sign, an unknown name, or a value that is not allowed.
    """
    values: dict[str, Any] = {}
    for text in assignments:
        name, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"--set takes name=value, got {text!r}")
        values[name.strip()] = find_setting(name.strip()).read(value.strip())
    return values


def load_profile(name: str, values: Mapping[str, object] | None = None) -> Settings:
    """Returns the settings of a profile of the package, with some values replaced.

    Raises:
        ConfigError: the profile or a setting is unknown, or a value is not allowed.
    """
    require_choice("profile", name, PROFILES)
    return _read_profile(name).with_values(values or {})


@cache
def _read_profile(name: str) -> Settings:
    """Returns the settings of a bundled profile, read from its YAML file once."""
    text = (files(__package__) / "profiles" / f"{name}.yaml").read_text(encoding="utf-8")
    return Settings(profile=name).with_values(msgspec.yaml.decode(text, type=dict[str, Any]))


def differences(a: Settings, b: Settings) -> list[tuple[str, Plain, Plain]]:
    """Returns the settings that differ: name, value in `a`, value in `b`."""
    plain_a, plain_b = a.to_plain(), b.to_plain()
    return [
        (name, plain_a[name], plain_b[name]) for name in NAMES if plain_a[name] != plain_b[name]
    ]
