"""`skidpad rerun` and `skidpad study`: look closely, and decide what the matrix cannot."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from skidpad.cli.options.campaigns import Checkpoints, FirstSeed

if TYPE_CHECKING:
    from skidpad.campaign.runs.rerun import Rerun


RECORDING = ".mcap"


def rerun(
    run: Annotated[
        Path, typer.Argument(help="A run's folder, or the .mcap recording of driven channels.")
    ],
    begin: Annotated[float, typer.Option("--from", help="s of simulated time.")] = 0.0,
    end: Annotated[float, typer.Option("--to", help="s of simulated time.")] = 10.0,
    video: Annotated[Path | None, typer.Option(help="Write a film to this .mp4 file.")] = None,
    checkpoints: Checkpoints = None,
    yes: Annotated[
        bool, typer.Option("--yes", help="Run the code that the folder names without asking.")
    ] = False,
) -> None:
    """Drive a stored run again: all twelve views and the tier trace of a stretch, hash-checked.

    It begins at the nearest checkpoint before the stretch, where the run has any.

    Channels are driven again as a whole, without views.
    """
    from skidpad.cli.options.folders import require_run

    is_segment = run.suffix == RECORDING
    require_run(run, RECORDING)
    from skidpad.campaign.runs import rerun as again
    from skidpad.campaign.runs.stored import read_run, read_segment

    described = (read_segment if is_segment else read_run)(run)
    require_backend(run, described.backend.backend)
    for foreign in described.foreign_code:
        if not yes:
            typer.confirm(f"{run} names {foreign}, which would be run; go on?", abort=True)
    if is_segment:
        same = again.same_segment(run)
    else:
        result = again.rerun(run, begin, end, run / "rerun", video, checkpoints)
        _show(result)
        same = result.same
    if not same:
        typer.echo(
            "this is another drive than the stored one: machine, libraries or code have changed",
            err=True,
        )
        raise typer.Exit(1)
    typer.echo("the same drive as the stored one, by content hash")


def require_backend(run: Path, name: str) -> None:
    """Raises ConfigError where a run's backend is of a package that is not installed."""
    from skidpad.core.errors import ConfigError
    from skidpad.core.simulator import BACKENDS

    if name not in BACKENDS.names():
        raise ConfigError(
            f"{run} was driven on the backend {name!r}, which is not installed; there are: "
            f"{', '.join(BACKENDS.names())}"
        )


def _show(result: Rerun) -> None:
    """Prints where the drive began, the trace, and where the film or the pictures are."""
    if result.refused:
        typer.echo(f"driven from the beginning: {result.refused}", err=True)
    elif result.begun_s:
        typer.echo(f"driven from the checkpoint at {result.begun_s:.2f} s on")
    for line in result.trace:
        typer.echo(line)
    if result.film is not None:
        typer.echo(f"film: {result.film}")
    elif result.pictures:
        typer.echo(f"{len(result.pictures)} pictures: {result.pictures[0].parent}")


def study(
    id: Annotated[
        str,
        typer.Argument(
            help="A finding, by its id in docs/results/claims.md, which says what each claims: "
            "F-08, F-17 to F-19, F-21, F-25, F-29, F-30, A-278; or noise."
        ),
    ],
    seeds: Annotated[int, typer.Option(min=1, help="Seeds per arm.")] = 6,
    workers: Annotated[
        int, typer.Option(min=1, help="Processes; default: one per core.", show_default=False)
    ] = os.cpu_count() or 1,
    first_seed: FirstSeed = 1,
    out: Annotated[Path | None, typer.Option(help="Write the rows to this .csv file.")] = None,
    figure: Annotated[
        Path | None,
        typer.Option(
            help="Of `skidpad study A-278`: draw both arms beside the published into this .svg file."
        ),
    ] = None,
) -> None:
    """Drive the experiment that a finding of the sources needs, and judge it."""
    from rich.console import Console
    from rich.progress import Progress

    from skidpad.campaign.cells import matrix as cells
    from skidpad.campaign.studies.arms import STUDIES
    from skidpad.core.errors import ConfigError, require_choice

    require_choice("study", id, tuple(STUDIES))
    if figure is not None and id != "A-278":
        raise ConfigError(f"--figure draws the arms of `skidpad study A-278`, not of {id}")
    from skidpad.campaign.studies.study import run_study
    from skidpad.recording.files import write_csv

    with Progress(console=Console(stderr=True)) as progress:
        task = progress.add_task(id)
        chosen = cells.seeds(seeds, first_seed)
        verdicts, table = run_study(
            id, chosen, workers, lambda done, n: progress.update(task, completed=done, total=n)
        )
    for v in verdicts:
        typer.echo(f"{v.finding.id}: {v.finding.claim}\n{v.text}")
    if out is not None:
        write_csv(out, table)
        typer.echo(str(out))
    if figure is not None:
        from skidpad.recording.files import write_bytes
        from skidpad.report.matrix.comparisons.preliminary import preliminary_svg

        write_bytes(figure, preliminary_svg(table).encode())
        typer.echo(str(figure))
