"""From the options of `skidpad grip` to the runs of a campaign."""

from __future__ import annotations

from typing import TypeVar

from skidpad.campaign.cells.grip import Cross, cross, seeds
from skidpad.cli.options.asked import GripCross, Tuned
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.run import Friction, RunSpec
from skidpad.core.vocabulary import SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.presets import GRIP, SNOW, find_weather, preset_groups
from skidpad.scenarios.shipped import NAMES
from skidpad.scenarios.variation import CutIn

Choice = TypeVar("Choice", Friction, CutIn)


def plan_grip(ask: GripCross, run: RunSpec, repeats: int) -> list[RunSpec]:
    """Returns the runs of a friction campaign, `repeats` per cell from the run's seed on.

    Raises ConfigError or FileError for what cannot be driven.
    """
    return cross(run, _vary_run(ask, run), seeds(run.seed - 1, repeats))


def with_model(run: RunSpec, tuned: Tuned, model: str, esc: str = "off") -> RunSpec:
    """Returns `run` with the options' settings, this model of reduced friction, and `esc` "on" or "off"."""
    return tuned.resolve(
        run,
        grip=require_choice("--model", model, ("statistical", "physical")),
        esc=require_choice("--esc", esc, ("on", "off")),
    )


def _vary_run(ask: GripCross, run: RunSpec) -> Cross:
    """Returns what the options vary; raises ConfigError where they do not go together."""
    climate = grip_weathers(ask.weather)
    if run.overlay and ask.four_cells:
        raise ConfigError("--four-cells drives with and without drops: leave --overlay away")
    if (run.overlay or ask.four_cells) and run.sensors is not SensorLevel.PIXELS:
        raise ConfigError("--overlay and --four-cells draw on images: they need --sensors pixels")
    chosen = list(NAMES) if ask.scenarios == "all" else split_words(ask.scenarios)
    for name in chosen:
        require_choice("scenario", name, NAMES)
    frictions = _choices("--friction", ask.friction, Friction)
    if ask.four_cells and len(frictions) != len(Friction):
        raise ConfigError("--four-cells needs both frictions")
    cutins = _choices("--cutin", ask.cutin, CutIn)
    from skidpad.physics.grip import friction_ratio  # kernels come with it

    for weather in climate:
        friction_ratio(weather, run.settings.world.grip)  # rain with ice, snow: says what is wrong
    return Cross(
        scenarios=chosen,
        weather=climate,
        frictions=frictions,
        cutins=cutins,
        overlays=(False, True) if ask.four_cells else (run.overlay,),
    )


def split_words(text: str) -> list[str]:
    """Returns the different words that commas part; ConfigError for the same twice, or none."""
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if len(set(parts)) != len(parts) or not parts:
        raise ConfigError(f"need different names parted by commas, got {text!r}")
    return parts


def _choices(option: str, text: str, kind: type[Choice]) -> list[Choice]:
    """Returns the choices in an option's comma list; raises ConfigError for an unknown one."""
    allowed = [member.value for member in kind]
    return [kind(require_choice(option, part, allowed)) for part in split_words(text)]


def grip_weathers(text: str) -> list[Weather]:
    """Returns the weathers of names or YAML files parted by commas; "all": the eleven published."""
    if text == "all":
        return [w for w in preset_groups()[GRIP].values() if w.name != SNOW]
    return [find_weather(part) for part in split_words(text)]
