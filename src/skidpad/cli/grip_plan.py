"""From the options of `skidpad grip` to a campaign."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from skidpad.campaign.campaign import Campaign
from skidpad.campaign.grip import recipe
from skidpad.campaign.grip_cells import Friction, GripCell, cross, seeds
from skidpad.campaign.play import check_controller
from skidpad.cli.carla_backend import backend_choice, drives_alone
from skidpad.cli.server_options import ServerWish
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.vocabulary import GripModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.grip import friction_ratio
from skidpad.physics.presets import GRIP, SNOW, find_weather, preset_groups
from skidpad.recording.grip import GripKey, GripMetrics
from skidpad.scenarios.scene import Mode
from skidpad.scenarios.variation import CutIn, names
from skidpad.stack.settings import load_profile, parse_assignments

Choice = TypeVar("Choice", Friction, CutIn)
KEEP = ("shown", "all")


@dataclass(frozen=True, slots=True, kw_only=True)
class GripWish:
    """What the user asked for, as text and numbers from the command line."""

    scenarios: str = "all"
    weather: str = "all"
    friction: str = "original,reduced"
    model: str = "statistical"
    cutin: str = "fixed"
    repeats: int = 100
    config: int = 2
    assignments: Sequence[str] = ()
    profile: str = "recommended"
    controller: str = "stack"
    sensors: str = "objects"
    actors: str = "physical"
    overlay: bool = False
    four_cells: bool = False  # drops x friction (B-161)
    keep: str = "shown"
    server: ServerWish = ServerWish()


def campaign_of(wish: GripWish) -> Campaign[GripCell, GripKey, GripMetrics]:
    """The campaign that is wished for."""
    keep = require_choice("--keep", wish.keep, KEEP)
    cells = plan_grip(wish)
    return Campaign(recipe(keep == "all"), cells, alone=drives_alone(c.backend for c in cells))


def plan_grip(wish: GripWish) -> list[GripCell]:
    """The cells of a campaign; ConfigError or FileError for what cannot be driven."""
    climate = grip_weathers(wish.weather)
    model = GripModel(require_choice("--model", wish.model, ("statistical", "physical")))
    for weather in climate:
        friction_ratio(weather, model)  # rain with ice, snow: says what is wrong
    check_controller(wish.controller)
    settings = load_profile(wish.profile, parse_assignments(wish.assignments))
    template = GripCell(
        scenario=names()[0],
        weather=climate[0],
        friction=Friction.ORIGINAL,
        seed=0,
        model=model,
        mu_ref=settings.mu_ref,
        controller=wish.controller,
        config=wish.config,
        profile=wish.profile,
        settings=settings,
        level=SensorLevel(require_choice("--sensors", wish.sensors, ("objects", "pixels"))),
        actors=Mode(require_choice("--actors", wish.actors, ("physical", "ideal"))),
        overlay=wish.overlay,
        backend=backend_choice(wish.server),
    )
    if wish.overlay and wish.four_cells:
        raise ConfigError("--four-cells drives with and without drops: leave --overlay away")
    if (wish.overlay or wish.four_cells) and template.level is not SensorLevel.PIXELS:
        raise ConfigError("--overlay and --four-cells draw on images: they need --sensors pixels")
    chosen = list(names()) if wish.scenarios == "all" else _parted(wish.scenarios)
    for name in chosen:
        require_choice("scenario", name, names())
    frictions = _choices("--friction", wish.friction, Friction)
    cutins = _choices("--cutin", wish.cutin, CutIn)
    overlays = (False, True) if wish.four_cells else (wish.overlay,)
    if wish.four_cells and len(frictions) != len(Friction):
        raise ConfigError("--four-cells needs both frictions")
    return cross(template, chosen, climate, frictions, cutins, seeds(0, wish.repeats), overlays)


def _parted(text: str) -> list[str]:
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if len(set(parts)) != len(parts) or not parts:
        raise ConfigError(f"need different names parted by commas, got {text!r}")
    return parts


def _choices(option: str, text: str, kind: type[Choice]) -> list[Choice]:
    allowed = [member.value for member in kind]
    return [kind(require_choice(option, part, allowed)) for part in _parted(text)]


def grip_weathers(text: str) -> list[Weather]:
    """`all` is the eleven published presets; else names or YAML files, parted by commas."""
    if text == "all":
        return [w for w in preset_groups()[GRIP].values() if w.name != SNOW]
    return [find_weather(part) for part in _parted(text)]
