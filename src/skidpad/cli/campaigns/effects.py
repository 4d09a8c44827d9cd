"""`skidpad effects`: what each effect of weather does to a stack, alone and together."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer


def effects(
    stack: Annotated[
        list[str] | None,
        typer.Option(help="As for `adas`; may be given several times. Default: 2."),
    ] = None,
    weather: Annotated[str, typer.Option(help="A preset or a YAML file.")] = "rain-noon",
    map: Annotated[
        str, typer.Option(help="A bundled map's name, or an OpenDRIVE file.")
    ] = "figure8",
    effect: Annotated[
        list[str] | None,
        typer.Option(help="One effect; may be given several times. Default: all of them."),
    ] = None,
    seeds: Annotated[int, typer.Option(min=1, help="Drives per effect; intervals need 8.")] = 10,
    duration: Annotated[float, typer.Option(min=1.0, help="Simulated seconds of a drive.")] = 60.0,
    workers: Annotated[
        int, typer.Option(min=1, help="Processes; default: one per core.", show_default=False)
    ] = os.cpu_count() or 1,
    out: Annotated[Path | None, typer.Option(help="Write the rows to this .csv file.")] = None,
) -> None:
    """Drive none, each effect of weather alone and all together; print what each one changes."""
    import polars as pl
    from rich.console import Console
    from rich.progress import Progress

    from skidpad.campaign.studies.effects import EFFECTS, compare_effects, drive_effects
    from skidpad.core.errors import require_choice
    from skidpad.recording.files import write_csv

    chosen = [require_choice("effect", name, tuple(EFFECTS)) for name in effect or EFFECTS]
    stacks, tables = stack or ["2"], []
    for one in stacks:
        with Progress(console=Console(stderr=True)) as progress:
            task = progress.add_task(one)
            rows = drive_effects(
                one, weather, range(1, seeds + 1), duration, workers, chosen,
                lambda done, n: progress.update(task, completed=done, total=n),  # noqa: B023
                map,
            )  # fmt: skip
        tables.append(rows)
        if out is not None:
            write_csv(out, pl.concat(tables))
        typer.echo(f"stack {one}, {map}, {weather}, {seeds} x {duration:g} s; differences to none")
        typer.echo("| effect | interventions per drive | mean speed, km/h | drives changed |")
        typer.echo("|---|---|---|---|")
        for result in compare_effects(rows):
            if result.note:
                cells = (result.note, result.note)
            else:
                cells = (difference_text(result.interventions), difference_text(result.speed))
            changed = f"{result.changed} of {seeds}"
            typer.echo(f"| {result.title} | {cells[0]} | {cells[1]} | {changed} |")
    if out is not None:
        typer.echo(str(out))


def difference_text(found: object) -> str:
    """Returns the mean difference with two digits and its interval, if it has one, as text."""
    from skidpad.evidence.statistics import Comparison
    from skidpad.evidence.statistics_text import range_text

    assert isinstance(found, Comparison)
    limits = "" if found.interval is None else f" ({range_text(found.interval)})"
    return f"{found.mean:+.2f}{limits}"
