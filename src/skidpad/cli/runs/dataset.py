"""`skidpad export-dataset`: images, labels and controls to learn driving from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from msgspec import structs

from skidpad.cli.options.asked import EgoStack, Tuned
from skidpad.cli.options.spread import spread_fields
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec

COURSES = "road"


@spread_fields(duration=60.0)
def export_dataset(
    ego: EgoStack,
    run: RunSpec,
    roads: Roads,
    tuned: Tuned,
    out: Annotated[Path, typer.Option(help="Folder for the drives, one folder each.")],
    course: Annotated[
        str, typer.Option(help="road (see --map), or a scenario of the catalogue.")
    ] = COURSES,
    weather: Annotated[str, typer.Option(help="A preset or a YAML file.")] = "clear-noon",
    first_seed: Annotated[int, typer.Option(min=0, help="Of the first drive.")] = 1,
    seeds: Annotated[int, typer.Option(min=1, help="Drives.")] = 1,
    every: Annotated[int, typer.Option(min=1, help="Ticks of 0.05 s per image.")] = 2,
) -> None:
    """Drive, and write images of three cameras, what is ahead by the truth, and controls."""
    from skidpad.campaign.cells.grip import drawn_course
    from skidpad.core.errors import require_choice
    from skidpad.physics.presets import find_weather
    from skidpad.scenarios.shipped import NAMES
    from skidpad.scenarios.variation import CutIn

    require_choice("--course", course, (COURSES, *NAMES))
    run = structs.replace(tuned.resolve(run), weather=find_weather(weather))
    run = structs.replace(run, driver=ego.find_driver())
    from skidpad.campaign.dataset import export_drive, write_card

    for seed in range(first_seed, first_seed + seeds):
        where = roads if course == COURSES else drawn_course(course, seed, CutIn.FIXED)
        drive = structs.replace(run, course=where, seed=seed)
        driven, frames = export_drive(drive, out, every)
        typer.echo(f"{drive.name}: {driven.outcome.value}, {frames} frames")
    typer.echo(write_card(out, every))
