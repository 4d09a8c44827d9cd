"""The places where the sources contradict themselves and the answer can change an outcome (M-14).

One flat record for all packages, so that a profile is one file and `--set` one syntax. Each setting
names its discrepancy and the package in which it acts. What is not here has one reading only, the
recommended one.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from enum import Enum
from functools import cache
from importlib.resources import files
from typing import Any, get_args, get_type_hints

import msgspec

from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.run import Friction, RunSpec
from skidpad.core.tyres import REFERENCE, known_tyres
from skidpad.core.vocabulary import Clearance, GripModel, LidarModel, RangeModel


class RoofCorridor(str, Enum):
    """D-015: width of the roof camera's corridor."""

    DEPTH_DEPENDENT = "depth_dependent"
    FLAT_WITHOUT_LCA = "flat_without_lca"


class RadarCloseCheck(str, Enum):
    """D-025: what a radar target nearer than 22 m needs."""

    BUMPER = "bumper"
    NOTHING = "nothing"


class RadarCandidates(str, Enum):
    """D-029: which radar points are matched with the map."""

    ALL = "all"
    NEAREST = "nearest"


class RadarCorridor(str, Enum):
    """A-084: how the radar tells the ego's lane."""

    LANE_MATCH = "lane_match"
    PARABOLA = "parabola"


class Targets(str, Enum):
    """D-011: what the cameras look for ahead."""

    ROAD_USERS = "road_users"  # and whatever else lies in the lane
    VEHICLES = "vehicles"  # car, truck and bus, as published


class CruiseLaw(str, Enum):
    """A-107, A-135: what holds the cruise speed."""

    STEADY = "steady"  # smooth pedals
    PUBLISHED = "published"  # the speed PID, whose derivative alternates full throttle and brake


class Unconfirmed(str, Enum):
    """D-044: tier 1 or 3 is entered but the detection is not confirmed yet."""

    FALL_THROUGH = "fall_through"
    CONSUME = "consume"


class LightBraking(str, Enum):
    """D-047: braking law at a red light without a lead."""

    SPEED_PID = "speed_pid"
    PROPORTIONAL = "proportional"


class CapScope(str, Enum):
    """D-051, D-053: where limiter and resume cap act."""

    GLOBAL = "global"
    CRUISE = "cruise"


class Lookahead(str, Enum):
    """D-054: look-ahead of lane centring."""

    DYNAMIC = "dynamic"
    FIXED = "fixed"


class Route(str, Enum):
    """D-058: which way lane centring takes."""

    HIGHWAY = "highway"
    FIRST_BRANCH = "first_branch"


class Follower(str, Enum):
    """D-039: what actuates following."""

    ZONES = "zones"
    DISTANCE_PID = "distance_pid"


class ResumeEnd(str, Enum):
    """A-177: what ends the resume cap."""

    TIME = "time"
    FIRST_CURVE = "first_curve"


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


def _setting(default: Any, source: str, house: str, text: str) -> Any:
    return field(default=default, metadata={"source": source, "house": house, "text": text})


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """All of them; the defaults are the profile `recommended`."""

    grip: GripModel = _setting(GripModel.PHYSICAL, "M-1", "physics", "weather acts on tyres")
    range: RangeModel = _setting(
        RangeModel.PHYSICAL, "M-1", "sensors", "weather acts on depth, labels and radar"
    )
    mu_ref: float = _setting(
        0.9,
        "M-1",
        "physics",
        "friction of a dry road: winter (tyres, 0.9), summer (1.05), a number",
    )
    tyres: str = _setting(
        REFERENCE, "M-1", "physics", "tyres of vehicles that have none of their own"
    )
    tyre_stiffness: bool = _setting(
        False, "M-1, T-11", "physics", "slip stiffness falls on water, snow and ice"
    )
    water_drag: bool = _setting(False, "M-1, T-11", "physics", "wheels push water aside")
    lane_material: bool = _setting(
        False,
        "M-1, T-11",
        "physics",
        "<material friction> of OpenDRIVE replaces mu_ref on its lane",
    )
    lidar: LidarModel = _setting(
        LidarModel.EXACT,
        "M-1, T-11",
        "sensors",
        "lost and false returns of lidars in rain, fog, snow",
    )
    esc: bool = _setting(
        True, "M-1, R-5", "physics", "stability and traction control, brake-force distribution"
    )
    camera: bool = _setting(True, "M-4", "sensors", "weather acts on RGB images")
    drivers: bool = _setting(
        True, "M-1, R-5", "simulation", "background drivers differ and mind grip and sight"
    )
    initial_limit_kmh: float | None = _setting(
        None, "M-6", "simulation", "limit of background drivers up to the first sign"
    )
    bumper_depth_fov_deg: float = _setting(
        100.0, "D-001", "sensors", "field of view of the bumper depth camera"
    )
    roof_corridor: RoofCorridor = _setting(
        RoofCorridor.DEPTH_DEPENDENT, "D-015", "stack", "width of the roof corridor"
    )
    bumper_alone: bool = _setting(
        True, "D-017", "stack", "bumper reading counts at 15 to 30 m when the roof sees nothing"
    )
    detection_gate: float = _setting(
        60.0, "D-020", "stack", "farthest fused distance that is a detection, m"
    )
    safety_persist: bool = _setting(
        False, "D-023", "stack", "hold a lost near lead for up to 5 s while following"
    )
    radar_close_check: RadarCloseCheck = _setting(
        RadarCloseCheck.BUMPER, "D-025", "stack", "what a radar target below 22 m needs"
    )
    radar_candidates: RadarCandidates = _setting(
        RadarCandidates.ALL, "D-029", "stack", "radar points that are matched with the map"
    )
    rejected_stays_active: bool = _setting(
        False, "D-035", "stack", "a radar target off the lane still reports RADAR_ACTIVE"
    )
    aeb_without_acc: bool = _setting(
        False, "D-038", "stack", "configuration 0 has emergency braking"
    )
    targets: Targets = _setting(
        Targets.ROAD_USERS, "D-011, R-5", "stack", "what the cameras look for ahead"
    )
    cruise: CruiseLaw = _setting(
        CruiseLaw.STEADY, "A-135, R-5", "stack", "what holds the cruise speed"
    )
    unconfirmed: Unconfirmed = _setting(
        Unconfirmed.FALL_THROUGH, "D-044", "stack", "tiers 1 and 3 before confirmation"
    )
    light_braking: LightBraking = _setting(
        LightBraking.SPEED_PID, "D-047", "stack", "braking law before a stop line"
    )
    cap_scope: CapScope = _setting(
        CapScope.GLOBAL, "D-051, D-053", "stack", "where limiter and resume cap act"
    )
    lookahead: Lookahead = _setting(Lookahead.DYNAMIC, "D-054", "stack", "look-ahead of the LCA")
    route: Route = _setting(Route.HIGHWAY, "D-058", "stack", "highway isolation, straightest path")
    relocation: Relocation = _setting(
        Relocation.ROLLING, "D-076, D-077", "simulation", "what follows a relocation"
    )
    clearance: Clearance = _setting(
        Clearance.OTHERS, "D-080", "simulation", "search for a free place"
    )
    traffic_positions: TrafficPositions = _setting(
        TrafficPositions.LISTING, "D-085, D-086", "simulation", "published positions of traffic"
    )
    night_rain: NightRain = _setting(
        NightRain.BOTH, "D-094", "sensors", "camera effects of rain at night"
    )
    lane_truth: LaneTruth = _setting(
        LaneTruth.FOLLOWED, "D-102, D-103", "evidence", "which vehicle is the true lead"
    )
    # Options that the sources name but do not use; off unless asked for.
    radar: bool = _setting(True, "A-038", "stack", "the radar takes part in detection")
    radar_corridor: RadarCorridor = _setting(
        RadarCorridor.LANE_MATCH, "A-084", "stack", "how the radar tells the ego's lane"
    )
    consistency_guard: float | None = _setting(
        None, "A-059", "stack", "tiers that differ by more, in m: the nearer counts"
    )
    rate_filter: bool = _setting(False, "A-062", "stack", "distance changes by <= 240 m/s")
    follower: Follower = _setting(Follower.ZONES, "A-108", "stack", "what actuates following")
    hsv_required: bool = _setting(False, "A-168", "stack", "the camera must confirm a red light")
    resume_end: ResumeEnd = _setting(ResumeEnd.TIME, "A-177", "stack", "what ends the resume cap")
    lazy_lookahead: float = _setting(8.0, "A-151", "stack", "look-ahead of the lazy driver, m")
    lazy_dead_band: float = _setting(0.04, "A-151", "stack", "steer that the lazy driver ignores")
    lazy_gain: float = _setting(0.45, "A-151", "stack", "share of steer the lazy driver applies")
    steer_smoothing: bool = _setting(False, "A-152", "stack", "low-pass and rate limit on steer")

    def __post_init__(self) -> None:
        for name, (low, high) in RANGES.items():
            value = getattr(self, name)
            if value is not None:
                require_range(name, value, low, high)

    def with_values(self, values: Mapping[str, Any]) -> Settings:
        """A copy with some values replaced; ConfigError for unknown names and wrong values."""
        checked = {name: _check_type(name, value) for name, value in values.items()}
        return replace(self, **checked)

    def as_plain(self) -> dict[str, Any]:
        """Plain data for YAML and for the resolved configuration of a run."""
        return {
            name: value.value if isinstance(value, Enum) else value
            for name, value in asdict(self).items()
        }


# mu_ref by the tyre whose measured stop from 99.8 km/h on a dry road it gives (What Car?, n11594:
# 43.7 m on winter and 37.9 m on summer tyres at 5.5 C; here 44.2 m and 38.4 m)
TYRES = {"winter": 0.9, "summer": 1.05}

RANGES: dict[str, tuple[float, float]] = {
    "mu_ref": (0.05, 3.0),
    "initial_limit_kmh": (5.0, 250.0),
    "bumper_depth_fov_deg": (30.0, 150.0),
    "detection_gate": (1.0, 80.0),
    "consistency_guard": (0.0, 80.0),
    "lazy_lookahead": (1.0, 100.0),
    "lazy_dead_band": (0.0, 1.0),
    "lazy_gain": (0.0, 2.0),
}

NAMES = tuple(f.name for f in fields(Settings))
PROFILES = ("recommended", "thesis_text", "thesis_listing", "preliminary")
SWITCH = {"on": True, "true": True, "yes": True, "off": False, "false": False, "no": False}


@cache
def _types() -> dict[str, Any]:
    return get_type_hints(Settings)


def _check_type(name: str, value: Any) -> Any:
    """`value` in the type of the setting `name`; text is read as on a command line."""
    require_choice("setting", name, NAMES)
    kind = _types()[name]
    optional = type(None) in get_args(kind)
    if optional:
        if value is None or value == "none":
            return None
        kind = next(part for part in get_args(kind) if part is not type(None))
    if kind is bool:
        return value if isinstance(value, bool) else _switch(name, value)
    if kind is str:
        return require_choice(name, str(value), list(known_tyres()))
    if issubclass(kind, Enum):
        text = value.value if isinstance(value, Enum) else str(value)
        return kind(require_choice(name, text, [member.value for member in kind]))
    return _number(name, value, optional)


def _switch(name: str, value: Any) -> bool:
    if str(value).lower() not in SWITCH:
        raise ConfigError(f"setting {name} must be on or off, got {value!r}")
    return SWITCH[str(value).lower()]


def _number(name: str, value: Any, optional: bool) -> float:
    if name == "mu_ref" and value in TYRES:
        return TYRES[value]
    try:
        if isinstance(value, bool):
            raise TypeError
        return float(value)
    except (TypeError, ValueError):
        low, high = RANGES[name]
        either = " or none" if optional else ""
        either += ", winter or summer" if name == "mu_ref" else ""
        raise ConfigError(
            f"setting {name} must be a number between {low:g} and {high:g}{either}, got {value!r}"
        ) from None


def parse_assignments(assignments: Iterable[str]) -> dict[str, Any]:
    """`["camera=off", "mu_ref=1.5"]` to checked values."""
    values: dict[str, Any] = {}
    for text in assignments:
        name, equals, value = text.partition("=")
        if not equals:
            raise ConfigError(f"--set takes name=value, got {text!r}")
        values[name.strip()] = _check_type(name.strip(), value.strip())
    return values


def load_profile(name: str, values: Mapping[str, Any] | None = None) -> Settings:
    """A profile of the package, with some values replaced."""
    require_choice("profile", name, PROFILES)
    return _profile(name).with_values(values or {})


@cache
def _profile(name: str) -> Settings:
    text = (files("skidpad.stack") / "profiles" / f"{name}.yaml").read_text(encoding="utf-8")
    return Settings().with_values(msgspec.yaml.decode(text, type=dict[str, Any]))


def settings_of(spec: RunSpec) -> Settings:
    """The settings of a run, typed."""
    return load_profile(spec.profile, spec.settings)


def grip_of(spec: RunSpec) -> GripModel:
    """What acts on the tyres of a run: its setting, unless friction stays the original one."""
    return settings_of(spec).grip if spec.friction is Friction.REDUCED else GripModel.NONE


def differences(a: Settings, b: Settings) -> list[tuple[str, Any, Any]]:
    """The settings that differ: name, value in `a`, value in `b`."""
    plain_a, plain_b = a.as_plain(), b.as_plain()
    return [
        (name, plain_a[name], plain_b[name]) for name in NAMES if plain_a[name] != plain_b[name]
    ]
