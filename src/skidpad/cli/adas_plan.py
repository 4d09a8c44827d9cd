"""From the options of `skidpad adas` to a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.cells import (
    DURATION,
    Cell,
    Driver,
    cross,
    published_drivers,
    sweep,
)
from skidpad.campaign.matrix import RECIPE
from skidpad.cli.carla_backend import backend_choice, drives_alone, map_of
from skidpad.cli.server_options import ServerWish
from skidpad.core.errors import ConfigError, require_choice, require_range
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.presets import MATRIX, find_weather, preset_groups
from skidpad.recording.matrix import Metrics, RunKey
from skidpad.roads.bundled import load_map
from skidpad.stack.configurations import parse_functions
from skidpad.stack.loading import load_stack
from skidpad.stack.settings import load_profile, parse_assignments


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """What the user asked for, as text and numbers from the command line."""

    configs: str | None = None
    functions: str | None = None
    stack: str | None = None
    weather: str = "all"
    sweep: str | None = None
    grip: str | None = None
    range: str | None = None
    seeds: int = 1
    duration: float = DURATION
    profile: str = "recommended"
    assignments: Sequence[str] = ()
    map: str = "figure8"
    traffic: str = "fixed"
    vehicles: int = 20
    sensors: str = "pixels"
    render: str = "needed"
    server: ServerWish = ServerWish()


def plan(wish: Wish) -> list[Cell]:
    """The cells of a campaign; ConfigError or FileError for what cannot be driven."""
    values = parse_assignments(wish.assignments)
    for name, value in (("grip", wish.grip), ("range", wish.range)):
        if value is not None:
            values |= parse_assignments([f"{name}={value}"])
    climate = weathers(wish.weather)
    if wish.sweep is not None:
        climate = sweep(climate, wish.sweep)
    drivers = _drivers(wish)
    require_range("--duration", wish.duration, 1.0, 100_000.0)
    require_range("--vehicles", wish.vehicles, 0, 80)
    backend = backend_choice(wish.server)
    map = map_of(wish.map, backend)
    load_map(map)
    template = Cell(
        driver=drivers[0],
        weather=climate[0],
        seed=0,
        profile=wish.profile,
        settings=load_profile(wish.profile, values),
        map=map,
        duration=wish.duration,
        traffic=require_choice("--traffic", wish.traffic, ("fixed", "random")),
        vehicles=wish.vehicles,
        level=SensorLevel(require_choice("--sensors", wish.sensors, ("pixels", "objects"))),
        render_all=require_choice("--render", wish.render, ("needed", "all")) == "all",
        backend=backend,
    )
    return cross(drivers, climate, wish.seeds, template)


def campaign_of(wish: Wish) -> Campaign[Cell, RunKey, Metrics]:
    """The campaign that is wished for."""
    cells = plan(wish)
    return Campaign(RECIPE, cells, alone=drives_alone(c.backend for c in cells))


def weathers(text: str) -> list[Weather]:
    """`all` is the six published presets; else names or YAML files, parted by commas."""
    if text == "all":
        return list(preset_groups()[MATRIX].values())
    return [find_weather(part.strip()) for part in text.split(",")]


def _drivers(wish: Wish) -> list[Driver]:
    given = [v for v in (wish.configs, wish.functions, wish.stack) if v is not None]
    if len(given) > 1:
        raise ConfigError("give one of --configs, --functions and --stack, not several")
    if wish.functions is not None:
        chosen = parse_functions(wish.functions)
        label = "+".join(sorted(f.value for f in chosen)) or "none"
        return [Driver(label=label, functions=chosen)]
    if wish.stack is not None:
        load_stack(wish.stack)  # a stack that is not there is wrong input, not a run's outcome
        return [Driver(label=wish.stack, stack=wish.stack)]
    return published_drivers(wish.configs or "all")
