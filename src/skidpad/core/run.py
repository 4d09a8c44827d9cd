"""One run as a value: what drives, where, in which weather, on which simulator, from which seed.

`config.yaml` in a run's folder is this value, and driving it again gives the same run. A field with
a description is an option of every command that drives (`skidpad.cli.options.spread`).
"""

from __future__ import annotations

from enum import Enum
from functools import cache
from math import inf
from typing import Annotated, Any, ClassVar

import msgspec
from msgspec import Meta, Struct

from skidpad.core.courses import Course, Roads, Route, Scenario
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import ConfigError, FileError, require_range
from skidpad.core.files.names import path_part, slug
from skidpad.core.settings.parts import Settings, load_profile
from skidpad.core.settings.setting import Plain
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.text.told import on_a_line
from skidpad.core.vocabulary import (
    Bodywork,
    Govern,
    GripModel,
    Quality,
    Scenery,
    SensorLevel,
    Stratum,
    TrafficStart,
)
from skidpad.core.weather import Weather

VERSION = 2  # of config.yaml; folders without the word were written before there was one value
DURATION = 500.0  # s
DEADLINE_BASE_S, DEADLINE_PER_SIMULATED_S = 180.0, 4.0  # wall time after which a run is killed
REFERENCE = "reference"  # the reference driver's name in commands and results
ARBITER = "arbiter"  # the driver of a crew, when it is not one of the channels

PARTED = {"parted": True}  # of an option: its words are parted by commas


# --- what drives


class Function(str, Enum):
    """One function of driving automation; each can be switched by itself (A-011)."""

    AEB = "aeb"  # emergency braking without following: tiers 1 to 3 alone (D-038)
    ACC = "acc"  # following, which includes tiers 1 to 3
    LCA = "lca"  # lane centring; without it the lazy driver steers
    TLA = "tla"  # traffic-light assist
    RESUME = "resume"  # post-stop resume protocol
    LIMITER = "limiter"
    BEND = "bend"  # slowing for bends; ours, in no published configuration


class AdasDriver(Struct, frozen=True, kw_only=True, tag="adas", forbid_unknown_fields=True):
    """Our own stack with a set of its functions; their settings are those of the run."""

    label: str = "2"  # "0" to "4", "acc+lca", or what a scenario calls its controller
    functions: frozenset[Function] = frozenset({Function.ACC, Function.LCA})
    cruise_kmh: float | None = None  # of free cruise; None: the scenario's, else as published
    added: tuple[str, ...] = ()  # functions of installed packages, in alphabetical order
    envelope: bool = False  # its speed stays inside the envelope: configurations 5 and 6


class StackDriver(Struct, frozen=True, tag="stack", forbid_unknown_fields=True):
    """A driving stack that a user wrote."""

    where: str  # module:Class or file.py:Class
    options: dict[str, Any] = {}  # what the class is given as its settings
    name: str = ""  # "": as `where`

    @property
    def label(self) -> str:
        """Returns the name of the driver in results: its own, or where it comes from."""
        return self.name or self.where


class AgentDriver(Struct, frozen=True, tag="agent", forbid_unknown_fields=True):
    """An agent of the CARLA leaderboard's interface (decision G-6)."""

    where: str  # PATH:CLASS

    @property
    def label(self) -> str:
        """Returns the name of the driver in results: "agent:" and where it comes from."""
        return f"agent:{self.where}"


class CameraDriver(Struct, frozen=True, tag="camera", forbid_unknown_fields=True):
    """A frozen network that sees three images (B-121)."""

    label: ClassVar[str] = "camera"  # the name of the driver in results


class ReferenceDriver(Struct, frozen=True, tag="reference", forbid_unknown_fields=True):
    """A model of a careful human at the wheel; the seed says which person (docs/reference-driver.md)."""

    label: ClassVar[str] = REFERENCE


class Passenger(Struct, frozen=True, tag="ideal", forbid_unknown_fields=True):
    """No driver: the scenario moves the ego."""

    label: ClassVar[str] = "ideal"


class ChannelCrew(Struct, frozen=True, kw_only=True, tag="channels", forbid_unknown_fields=True):
    """Redundant channels, of which an arbiter or one of them drives."""

    channels: Annotated[
        tuple[str, ...], Meta(description="Names, the preferred one first.", extra=PARTED)
    ] = ("lav_like", "tfuse_like")
    drive_by: Annotated[str, Meta(description="The arbiter, or the channel that drives alone.")] = (
        ARBITER
    )
    noise: Annotated[
        float, Meta(ge=0.0, le=10.0, description="Factor on all sensor errors: 0.5, 1 or 2.")
    ] = 1.0

    def __post_init__(self) -> None:
        if len(set(self.channels)) != len(self.channels) or not self.channels:
            raise ConfigError(f"channels must be different names, got {list(self.channels)}")
        if self.drive_by != ARBITER and self.drive_by not in self.channels:
            raise ConfigError(
                f"drive-by must be {ARBITER} or one of {', '.join(self.channels)}, "
                f"got {self.drive_by!r}"
            )

    @property
    def label(self) -> str:
        """Returns the name of the driver in results: the arbiter, or the channel that drives alone."""
        return self.drive_by


DriverSpec = (
    AdasDriver
    | StackDriver
    | AgentDriver
    | CameraDriver
    | ReferenceDriver
    | Passenger
    | ChannelCrew
)


# --- the run


class Render(str, Enum):
    """Which camera images are rendered."""

    NEEDED = "needed"  # those that something reads
    ALL = "all"


class Friction(str, Enum):
    """The switch of friction, as B-004 asks."""

    ORIGINAL = "original"  # weather is seen, tyres know nothing of it
    REDUCED = "reduced"  # tyres know it, by the setting `grip`


class RunSpec(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One run. Two equal values give equal recordings."""

    driver: DriverSpec = AdasDriver()
    course: Course = Roads()
    weather: Weather = Weather(name="clear-noon")
    friction: Friction = Friction.REDUCED
    seed: int = 1
    duration: Annotated[
        float, Meta(ge=0.05, le=1.0e5, description="Longest simulated time, s.")
    ] = DURATION
    settings: Settings = Settings()  # of world, sensors, traffic, stack and metrics
    sensors: Annotated[
        SensorLevel, Meta(description="pixels: real images; objects: from boxes, much faster.")
    ] = SensorLevel.PIXELS
    render: Annotated[
        Render, Meta(description="needed: images that something reads; all: every image.")
    ] = Render.NEEDED
    overlay: Annotated[bool, Meta(description="Rain drops on the cameras (pixels).")] = False
    scenery: Annotated[
        Scenery,
        Meta(
            description="full: buildings, trees, lamps and more beside the roads, for all sensors "
            "and contacts; none: only what the map's file names."
        ),
    ] = Scenery.NONE
    bodywork: Annotated[
        Bodywork,
        Meta(
            description="shaped: vehicles and people look like what they are, to sensors that see "
            "surfaces; plain: one coarse body per kind."
        ),
    ] = Bodywork.PLAIN
    quality: Annotated[
        Quality,
        Meta(
            description="Of colour pictures: full, or draft, without grain and tracks of the ground, veils "
            "of the sky and costly additions for people; depth and classes are equal."
        ),
    ] = Quality.FULL
    govern: Annotated[
        Govern,
        Meta(
            description="Keep any stack's speed inside its grip and sight: envelope; full also by lane "
            "boundaries, walkers and bridges of the map; watch records alone what it would allow; pulses "
            "also brakes a little to feel the grip. For studies: oracle "
            "(true grip), oracle-sight (true range of the radar), table (80, 60, 40 km/h: dry, rain, cold), "
            "fixed (80 km/h), rss (constant grip), only-sight, only-lead, only-bend, only-water, "
            "grip-low, grip-high (30 % wrong)."
        ),
    ] = Govern.NONE
    backend: BackendChoice = BackendChoice()
    surface: tuple[SurfacePatch, ...] = ()  # what lies on parts of the road
    inputs: str = (
        ""  # SHA-256 of what a person did meanwhile (inputs.jsonl); "": no person took part
    )

    def __post_init__(self) -> None:
        if isinstance(self.driver, ChannelCrew) is not isinstance(self.course, Route):
            raise ConfigError("channels drive routes, and only channels do")
        if _pack_on_carla(self.course, self.backend):
            raise ConfigError(
                "traffic pack and risky drivers are kept together by the embedded simulator alone"
            )
        if self.surface and self.backend.backend == BackendKind.CARLA:
            raise ConfigError("--surface needs the embedded simulator")
        if isinstance(self.driver, CameraDriver) and self.sensors is not SensorLevel.PIXELS:
            raise ConfigError("the camera driver sees images: it needs --sensors pixels")
        if self.govern is not Govern.NONE and isinstance(self.driver, (ChannelCrew, Passenger)):
            raise ConfigError(
                f"--govern {self.govern.value} keeps a stack's speed, and {self.driver.label} is no "
                "stack: choose a stack, or --govern none"
            )
        if isinstance(self.driver, Passenger) and not isinstance(self.course, Scenario):
            raise ConfigError("only a scenario moves the ego itself")

    @property
    def cell(self) -> str:
        """Returns the name of the runs that differ from this one in the seed alone; it can name a folder."""
        if isinstance(self.course, Route):
            return path_part(self.course.name)
        if isinstance(self.course, Roads):
            return path_part(f"{slug(self.driver.label)}_{self.weather.name}")
        scenario = self.course.title
        what = "-".join(filter(None, (scenario, self.course.variant, "drops" * self.overlay)))
        return path_part(f"{what}_{self.weather.name}_{self.friction.value}")

    @property
    def name(self) -> str:
        """Returns the name of the run and of its folder."""
        return f"{self.cell}-{self.seed:0{_DIGITS[type(self.course)]}d}"

    @property
    def grip(self) -> GripModel:
        """Returns what acts on the tyres: its setting, unless friction stays the original one."""
        return self.settings.world.grip if self.friction is Friction.REDUCED else GripModel.NONE

    @property
    def foreign_code(self) -> tuple[str, ...]:
        """Returns the foreign code that a drive of this run would execute, in words."""
        driver = self.driver
        found = []
        if isinstance(driver, (StackDriver, AgentDriver)) and not driver.where.startswith(OURS):
            found.append(
                f"the {'stack' if isinstance(driver, StackDriver) else 'agent'} {driver.where!r}"
            )
        if isinstance(self.course, Scenario):
            found += [f"the class {text!r}" for text in self.course.register]
        if self.backend.backend not in (BackendKind.EMBEDDED, BackendKind.CARLA):
            found.append(f"the backend {self.backend.backend!r}")
        if self.backend.server_command:
            found.append(f"the command {self.backend.server_command!r}")
        return tuple(found)

    @property
    def deadline_s(self) -> float:
        """Returns the wall time in s after which the run counts as hanging."""
        return DEADLINE_BASE_S + DEADLINE_PER_SIMULATED_S * self.duration

    def to_identity(self) -> dict[str, Any]:
        """Returns everything that decides the run, as plain data (A-260); an address does not."""
        return self.to_plain() | {"backend": self.backend.to_identity()}

    def to_plain(self) -> dict[str, Any]:
        """Returns the whole value as plain data, as it stands in config.yaml."""
        plain: dict[str, Any] = {"version": VERSION}
        for name, value in msgspec.to_builtins(self, order="deterministic").items():
            if name == "settings":  # flat, as in a profile
                plain |= {"profile": self.settings.profile, name: self.settings.to_plain()}
            elif value not in LEFT_OUT.get(name, ()):
                plain[name] = value
        if isinstance(self.driver, AdasDriver) and not self.driver.added:  # as before, too
            del plain["driver"]["added"]
        if isinstance(self.course, Scenario):  # likewise
            for name in ("disturb", "draws"):
                if not getattr(self.course, name):
                    del plain["course"][name]
        if isinstance(self.course, Roads) and not self.course.route_km:  # likewise
            del plain["course"]["route_km"]
        return plain


def _pack_on_carla(course: Course, backend: BackendChoice) -> bool:
    """Returns whether the course needs a pack of traffic around the ego and the backend is CARLA."""
    packed = isinstance(course, Roads) and course.traffic is TrafficStart.PACK
    risky = isinstance(course, Route) and course.stratum is Stratum.RISKY  # drives as one
    return (packed or risky) and backend.backend == BackendKind.CARLA


# fields that a description leaves out while they have these values, so that it is as before
LEFT_OUT: dict[str, tuple[Any, ...]] = {
    "surface": ((), []),
    "scenery": (Scenery.NONE.value,),
    "bodywork": (Bodywork.PLAIN.value,),
    "quality": (Quality.FULL.value,),
}
OURS = "skidpad."  # stacks of this package are no foreign code
_DIGITS: dict[type[Struct], int] = {Roads: 3, Scenario: 6, Route: 5}  # of the seed in a name


def check_limits(values: Struct) -> None:
    """Raises ConfigError for the first number outside the limits that its field declares."""
    for name, low, high in _limits(type(values)):
        require_range(name, getattr(values, name), low, high)


@cache
def _limits(kind: type[Struct]) -> tuple[tuple[str, float, float], ...]:
    """Returns the least and the greatest value of each number of a struct that declares one."""
    return tuple(
        (field.name, -inf if meta.ge is None else meta.ge, inf if meta.le is None else meta.le)
        for field in msgspec.structs.fields(kind)
        for meta in getattr(field.type, "__metadata__", ())
        if isinstance(meta, Meta) and (meta.ge is not None or meta.le is not None)
    )


def run_from_plain(plain: dict[str, Any], where: str) -> RunSpec:
    """Returns the run that `to_plain` described; FileError that names `where` for anything else."""
    version = plain.get("version")
    if version != VERSION:
        raise FileError(f"{where} has version {version!r} of a run's description, not {VERSION}")
    fields = {k: v for k, v in plain.items() if k not in ("version", "profile", "settings")}
    try:
        values = msgspec.convert(plain.get("settings", {}), dict[str, Plain])
        settings = load_profile(plain.get("profile", "recommended"), values)
        return msgspec.structs.replace(msgspec.convert(fields, RunSpec), settings=settings)
    except ConfigError as error:
        raise FileError(f"{where}: {error}") from None
    except msgspec.ValidationError as error:
        raise FileError(f"{where} does not describe a run: {on_a_line(error)}") from error
