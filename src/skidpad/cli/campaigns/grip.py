"""`skidpad grip`: what changes when weather also changes grip, in thousands of paired runs."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from msgspec import structs

from skidpad.cli.options.asked import MAPS, EgoStack, GripCross, MapAsked, Tuned
from skidpad.cli.options.campaigns import Checkpoints, FirstSeed, How
from skidpad.cli.options.spread import spread_fields
from skidpad.core.courses import Scenario
from skidpad.core.errors import ConfigError, require_choice
from skidpad.core.run import Friction, RunSpec
from skidpad.core.simulator import BackendChoice
from skidpad.core.vocabulary import ENDED, Outcome, SensorLevel

if TYPE_CHECKING:
    import polars as pl

REPEATS = 100  # the study's


class Keep(str, Enum):
    """Which runs keep their whole logs."""

    SHOWN = "shown"
    ALL = "all"


@spread_fields(sensors=SensorLevel.OBJECTS, duration=120.0)
def grip(
    how: How,
    cross: GripCross,
    map: MapAsked,
    ego: EgoStack,
    run: RunSpec,
    scenario: Scenario,
    tuned: Tuned,
    backend: BackendChoice,
    seeds: Annotated[
        int | None,
        typer.Option(
            "--seeds", "--repeats", min=1, help="Runs per cell; default 100, of the map 20."
        ),
    ] = None,
    first_seed: FirstSeed = 1,
    keep: Annotated[
        Keep, typer.Option(help="shown: logs of runs in the report; all: of every run.")
    ] = Keep.SHOWN,
    checkpoints: Checkpoints = None,
) -> None:
    """Drive scenarios x weathers x frictions x seeds; prints the answer and the path of the report."""
    from skidpad.cli.options.carla_backend import check_backend, drives_alone

    run = structs.replace(run, backend=check_backend(backend), seed=first_seed)
    alone, keep_all = drives_alone(run.backend), keep is Keep.ALL
    if map.map_of is not None:
        require_choice("--map-of", map.map_of, MAPS)
        if checkpoints is not None:
            raise ConfigError("--checkpoints is not for --map-of: rerun one of its runs with it")
        from skidpad.campaign.campaign import Campaign
        from skidpad.campaign.recipes import threshold
        from skidpad.cli.campaigns import threshold_plan
        from skidpad.report.grip.threshold import write_threshold_report

        run = tuned.resolve(run)
        repeats = seeds or threshold_plan.REPEATS
        levels = threshold_plan.plan_map(map, cross, ego, run, repeats)
        how(Campaign(threshold.recipe(keep_all), levels, alone=alone), write_threshold_report)
        return
    from skidpad.cli.campaigns.grip_plan import plan_grip, with_model

    run = with_model(run, tuned, cross.model, cross.esc)
    run = structs.replace(run, driver=ego.find_driver(), course=scenario)
    cells = plan_grip(cross, run, seeds or REPEATS)
    from skidpad.campaign.campaign import Campaign
    from skidpad.campaign.recipes.grip import recipe
    from skidpad.recording.campaign.results import read_results
    from skidpad.report.grip.page import write_grip_report

    def answer(folder: Path) -> str:
        page, rows = write_grip_report(folder), read_results(folder)
        return f"{answer_text(rows)}\n{page}\n{next_text(rows)}"

    how(Campaign(recipe(keep_all, checkpoints), cells, alone=alone), answer)


def answer_text(rows: pl.DataFrame) -> str:
    """Returns what weather's grip changed: collisions without and with it, and the worst cell."""
    from skidpad.core.text.wording import count_text

    lines = []
    for friction, title in ((Friction.ORIGINAL, "on dry grip"), (Friction.REDUCED, "with weather")):
        runs = rows.filter(rows["friction"] == friction.value)
        hit = runs.filter(runs["outcome"].is_in([one.value for one in ENDED]))
        rolled = int((runs["outcome"] == Outcome.ROLL_OVER.value).sum())
        if not len(runs):
            continue
        lines.append(
            f"{title}: {count_text(len(hit) - rolled, 'collision')}"
            + (f" and {count_text(rolled, 'roll-over')}" if rolled else "")
            + f" in {count_text(len(runs), 'run')}"
        )
        if friction is Friction.REDUCED and len(hit):
            cells = hit.group_by("scenario", "weather").len()
            worst = cells.sort("len", "scenario", "weather", descending=[True, False, False])
            scenario, weather, n = worst.row(0)
            lines[-1] += f", most in {scenario} in {weather} ({n})"
    return "\n".join(lines)


def next_text(rows: pl.DataFrame) -> str:
    """Returns the command that says how much grip the worst weather leaves, of all if none was hit."""
    hit = rows.filter(rows["outcome"].is_in([one.value for one in ENDED]))
    cells = hit.group_by("weather").len().sort("len", "weather", descending=[True, False])
    told = f"--preset {cells['weather'][0]}" if len(cells) else "--table"
    return f"Next: skidpad friction {told} says how far it is to a stop"
