"""What a user asks of a campaign beyond one run: several drivers, weathers, settings by name."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct

from skidpad.core.courses import Roads
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.run import DriverSpec, Friction, RunSpec
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather

OF_FILE = "file"  # the weather that a scenario describes
StackSettings = Annotated[
    tuple[str, ...],
    Meta(description="A setting of your own stack: name=value; may be given several times."),
]


class Drivers(Struct, frozen=True):
    """The drivers of a campaign, in turn."""

    configs: Annotated[
        str | None,
        Meta(
            description="Published configurations 0 to 4, the reference driver, and 5 and 6, whose speed "
            "stays inside the envelope, e.g. 0,4,reference; default 0 to 4 and reference."
        ),
    ] = None
    functions: Annotated[
        tuple[str, ...],
        Meta(
            description="A set of aeb,acc,lca,tla,resume,limiter,bend and functions of packages "
            "(`skidpad extensions functions`); may be given several times."
        ),
    ] = ()
    cruise: Annotated[
        str | None, Meta(description="Cruise target in km/h, or several as FROM:TO:STEP.")
    ] = None
    stack: Annotated[
        str | None,
        Meta(
            description="One driver: module:Class, FILE.py:Class, 0 to 6, reference, camera or "
            "agent:PATH:CLASS."
        ),
    ] = None
    stack_set: StackSettings = ()

    def find_drivers(self) -> list[DriverSpec]:
        """Returns the drivers that the options name, by default configurations 0 to 4 and the reference.

        Raises ConfigError or FileError for what is not there, or options that exclude each other.
        """
        from skidpad.campaign.cells.matrix import (
            cruising,
            drivers_with,
            matrix_drivers,
            published_drivers,
        )
        from skidpad.campaign.driving.drivers import find_driver

        if self.stack is not None:
            if self.configs is not None or self.functions or self.cruise is not None:
                raise ConfigError("--stack goes with none of --configs, --functions and --cruise")
            return [find_driver(self.stack, read_stack_settings(self.stack_set))]
        if self.stack_set:
            raise ConfigError("--stack-set is for your own stack: give it with --stack FILE:CLASS")
        chosen = drivers_with(self.functions)
        if self.cruise is not None:
            if self.configs is not None or not chosen:
                chosen = [*published_drivers(self.configs or "all"), *chosen]
            return [*cruising(chosen, self.cruise)]
        if self.configs is not None or not chosen:
            return [*matrix_drivers(self.configs or "all"), *chosen]
        return [*chosen]


class EgoStack(Struct, frozen=True):
    """The driver of the ego in a scenario."""

    stack: Annotated[
        str,
        Meta(
            description="0 to 6 (our stack in a configuration), reference, camera, ideal (as the "
            "file says), module:Class, FILE.py:Class, agent:PATH:CLASS."
        ),
    ] = "2"
    stack_set: StackSettings = ()

    def find_driver(self) -> DriverSpec:
        """Returns the driver, found and loaded; ConfigError or FileError for one that is not there."""
        from skidpad.campaign.driving.drivers import STACK, find_driver

        return find_driver(self.stack, read_stack_settings(self.stack_set), label=STACK)


def read_stack_settings(words: Iterable[str]) -> dict[str, bool | float | str | None]:
    """Returns the settings of `name=value` words; a value is a number, true, false, none or text.

    Raises:
        ConfigError: a word has no name or no equals sign, or a name is given twice.
    """
    values: dict[str, bool | float | str | None] = {}
    for word in words:
        name, equals, value = (part.strip() for part in word.partition("="))
        if not name or not equals:
            raise ConfigError(f"--stack-set takes name=value, got {word!r}")
        if name in values:
            raise ConfigError(f"--stack-set gives {name!r} twice")
        values[name] = _plain_value(value)
    return values


def _plain_value(text: str) -> bool | float | str | None:
    """Returns true, false, none and finite numbers in the text as values, other text as it is."""
    words = {"true": True, "false": False, "none": None}
    if text.lower() in words:
        return words[text.lower()]
    for read in (int, float):
        try:
            value: float = read(text)
        except ValueError:
            continue
        if isfinite(value):
            return value
    return text


class Climate(Struct, frozen=True):
    """The weathers of a campaign."""

    weather: Annotated[
        str, Meta(description="all, or presets and YAML files parted by commas.")
    ] = "all"
    sweep: Annotated[
        str | None, Meta(description="Vary one weather field: FIELD=FROM:TO:STEP.")
    ] = None

    def find_weathers(self) -> list[Weather]:
        """Returns the weathers, `all` the six published presets, with `sweep` a copy for each value.

        Raises ConfigError or FileError for what is not there or out of range.
        """
        from skidpad.campaign.cells.matrix import sweep
        from skidpad.physics.presets import MATRIX, find_weather, preset_groups

        if self.weather == "all":
            found = list(preset_groups()[MATRIX].values())
        else:
            found = [find_weather(part.strip()) for part in self.weather.split(",")]
        return found if self.sweep is None else sweep(found, self.sweep)


class Tuned(Struct, frozen=True):
    """A profile, single settings over it, and what lies on the road."""

    profile: Annotated[
        str, Meta(description="recommended, thesis_text, thesis_listing or preliminary.")
    ] = "recommended"
    set: Annotated[
        tuple[str, ...],
        Meta(
            description="A setting over the profile: name=value; `skidpad profiles show recommended` "
            "lists them."
        ),
    ] = ()
    surface: Annotated[
        Path | None,
        Meta(
            description="YAML with puddles, ice, snow or friction of parts of the road, or an OpenCRG "
            "file whose hollows hold water (extra `crg`)."
        ),
    ] = None

    def resolve(self, run: RunSpec, **more: str | None) -> RunSpec:
        """Returns `run` with the profile's settings and surface; ConfigError or FileError if wrong.

        more: settings given by name, None: not given.
        """
        from msgspec import structs

        from skidpad.core.settings.parts import load_profile, parse_assignments

        values = parse_assignments(self.set)
        values |= parse_assignments(f"{k}={v}" for k, v in more.items() if v is not None)
        settings = load_profile(self.profile, values)
        if self.surface is None:
            return structs.replace(run, settings=settings)
        from skidpad.simulation.world.surface_files import read_surface

        return structs.replace(run, settings=settings, surface=read_surface(self.surface))

    def require_surface_on(self, roads: Roads, surface: tuple[SurfacePatch, ...]) -> None:
        """Raises ConfigError, with the file's name, where its patches do not fit the map of the course."""
        if self.surface is None:
            return
        from skidpad.campaign.user_files import road_file
        from skidpad.roads.bundled import load_map
        from skidpad.simulation.world.patches import fit_patches

        try:
            fit_patches(load_map(road_file(roads)), surface)
        except ConfigError as error:
            raise self.name_surface(error) from None

    def name_surface(self, error: ConfigError) -> ConfigError:
        """Returns an error on a patch that fits no road with the name of the surface's file."""
        return ConfigError(f"{self.surface}: {error}")


class PlayCross(Struct, frozen=True):
    """How a scenario is played; a folder of scenarios in every combination."""

    weather: Annotated[
        str, Meta(description="file (as it says, else clear-noon), presets or YAML files.")
    ] = OF_FILE
    grip: Annotated[
        str, Meta(description="none, statistical or physical; none and one other by a comma.")
    ] = "physical"
    seed: Annotated[int, Meta(description="Of sensor noise and road, the first one.")] = 1
    param: Annotated[tuple[str, ...], Meta(description="A parameter of the file: NAME=VALUE.")] = ()

    def parameters(self) -> dict[str, float | str]:
        """Returns the values of scenario parameters by name, as text; ConfigError without "="."""
        values: dict[str, float | str] = {}
        for text in self.param:
            name, equals, value = text.partition("=")
            if not equals:
                raise ConfigError(f"--param takes NAME=VALUE, got {text!r}")
            values[name.strip()] = value.strip()
        return values

    def frictions(self) -> tuple[list[Friction], str]:
        """Returns the frictions, ORIGINAL for "none", else REDUCED, and the grip model of the latter.

        The model is "none" where none is named. Raises ConfigError for two models.
        """
        allowed = [model.value for model in GripModel]
        words = [require_choice("--grip", word.strip(), allowed) for word in self.grip.split(",")]
        models = [word for word in words if word != GripModel.NONE.value]
        if len(models) > 1 or len(set(words)) < len(words):
            raise ConfigError(f"--grip takes none and one model at most, got {self.grip!r}")
        frictions = [Friction.REDUCED if word in models else Friction.ORIGINAL for word in words]
        return frictions, models[0] if models else GripModel.NONE.value


class GripCross(Struct, frozen=True):
    """What a friction campaign varies."""

    scenarios: Annotated[
        str, Meta(description="all, or ghost_cut_in,lead_slowdown,front_accident.")
    ] = "all"
    weather: Annotated[
        str, Meta(description="all: the eleven of the study; or presets and YAML files.")
    ] = "all"
    friction: Annotated[
        str, Meta(description="original: tyres know no weather; reduced: they do.")
    ] = "original,reduced"
    model: Annotated[str, Meta(description="Of reduced friction: statistical or physical.")] = (
        "statistical"
    )
    esc: Annotated[
        str, Meta(description="Stability control: off, as the study's vehicles had none known; on.")
    ] = "off"
    cutin: Annotated[
        str, Meta(description="original, unfixed, fixed: spawn delay and merge distance.")
    ] = "fixed"
    four_cells: Annotated[
        bool, Meta(description="Each run without and with drops, to part both effects.")
    ] = False


MAPS = ("threshold",)  # choices of --map-of


class MapAsked(Struct, frozen=True):
    """What a threshold map varies; without `map_of` it is none."""

    map_of: Annotated[
        str | None,
        Meta(description="threshold: the friction at which following a braking lead fails."),
    ] = None
    drivers: Annotated[str, Meta(description="Of the map: acc,aeb,camera.")] = "acc,aeb"
    headways: Annotated[
        str, Meta(description="Of the map: s at 80 km/h, or 25m: the public challenge's start.")
    ] = "0.6,1,1.5,2,2.5,25m"
    decelerations: Annotated[str, Meta(description="Of the map's lead, m/s2.")] = "2,4,6,8"
    levels: Annotated[
        str | None, Meta(description="Of the map: shares of dry friction, 1 among them.")
    ] = None
