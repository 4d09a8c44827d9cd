"""From the options of `skidpad grip --map-of threshold` to the runs of a campaign."""

from __future__ import annotations

from msgspec import structs

from skidpad.campaign.cells.grip import seeds
from skidpad.campaign.cells.threshold import (
    DECELERATION_RANGE,
    LEVEL_RANGE,
    Levels,
    Task,
    default_shares,
    driver_named,
    number,
    start_of_text,
    tasks,
)
from skidpad.cli.campaigns.grip_plan import split_words
from skidpad.cli.options.asked import MAPS, EgoStack, GripCross, MapAsked
from skidpad.core.courses import ActorMode
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.run import RunSpec
from skidpad.physics.presets import find_weather

REPEATS = 20  # of every level; a median's interval needs six
WEATHER = "rain_0"  # of the study: dry, and every level looks like it


def plan_map(
    ask: MapAsked, cross: GripCross, ego: EgoStack, run: RunSpec, repeats: int
) -> list[Task]:
    """Returns the tasks of a threshold map; ConfigError for what cannot be driven.

    repeats: runs per cell. Options that the map chooses itself must be left at their defaults.
    """
    require_choice("--map-of", str(ask.map_of), MAPS)
    if cross != GripCross() or ego != EgoStack():
        raise ConfigError(
            "--map-of threshold chooses scenario, weather, friction and drivers itself: leave away "
            "--scenarios, --weather, --friction, --model, --cutin, --four-cells, --stack"
        )
    if run.overlay:
        raise ConfigError("--map-of threshold drives on a clear day: leave --overlay away")
    shares = default_shares()
    if ask.levels is not None:
        given = {number("--levels", text, LEVEL_RANGE) for text in split_words(ask.levels)}
        shares = sorted(given, reverse=True)
    if shares[0] != 1.0 or len(shares) < 2:
        raise ConfigError("--levels needs dry road, 1, and at least one level below it")
    levels = Levels(
        drivers=[driver_named(name) for name in split_words(ask.drivers)],
        modes=list(ActorMode),
        starts=[start_of_text(text) for text in split_words(ask.headways)],
        decelerations=[
            number("--decelerations", text, DECELERATION_RANGE)
            for text in split_words(ask.decelerations)
        ],
        shares=shares,
    )
    template = structs.replace(run, weather=find_weather(WEATHER))
    return tasks(template, levels, seeds(run.seed - 1, repeats))
