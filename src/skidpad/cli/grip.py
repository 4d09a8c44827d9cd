"""`skidpad grip`: what changes when weather also changes grip, in thousands of paired runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from skidpad.cli.server_options import (
    Backend,
    Host,
    Pace,
    Port,
    RestartEvery,
    ServerCommand,
    ServerWish,
    Without,
)

campaign = typer.Typer(name="campaign", help="About campaigns.", no_args_is_help=True)


def grip(
    out: Annotated[Path, typer.Option(help="Folder for results and report.")],
    scenarios: Annotated[
        str, typer.Option(help="all, or ghost_cut_in,lead_slowdown,front_accident.")
    ] = "all",
    weather: Annotated[
        str, typer.Option(help="all: the eleven of the study; or presets and YAML files.")
    ] = "all",
    friction: Annotated[
        str, typer.Option(help="original: tyres know no weather; reduced: they do.")
    ] = "original,reduced",
    model: Annotated[
        str, typer.Option(help="Of reduced friction: statistical or physical.")
    ] = "statistical",
    cutin: Annotated[
        str,
        typer.Option(help="original, unfixed, fixed: spawn delay and merge distance."),
    ] = "fixed",
    repeats: Annotated[int, typer.Option(min=1, help="Seeds per cell.")] = 100,
    config: Annotated[int, typer.Option(min=0, max=4, help="Configuration of our stack.")] = 2,
    set: Annotated[
        list[str] | None, typer.Option(help="Single settings over the profile: name=value.")
    ] = None,
    profile: Annotated[str, typer.Option(help="Profile of settings.")] = "recommended",
    controller: Annotated[
        str, typer.Option(help="stack, module:Class, or agent:PATH:CLASS.")
    ] = "stack",
    sensors: Annotated[str, typer.Option(help="objects, or pixels: real images.")] = "objects",
    actors: Annotated[
        str, typer.Option(help="physical: tyres decide; ideal: as the scenario says.")
    ] = "physical",
    overlay: Annotated[
        bool, typer.Option("--overlay", help="Rain drops on the cameras (pixels).")
    ] = False,
    four_cells: Annotated[
        bool,
        typer.Option("--four-cells", help="Each run without and with drops, to part both effects."),
    ] = False,
    backend: Backend = "embedded",
    host: Host = "127.0.0.1",
    port: Port = 2000,
    pace: Pace = False,
    without: Without = None,
    server_command: ServerCommand = None,
    restart_every: RestartEvery = 0,
    workers: Annotated[
        int, typer.Option(min=1, help="Processes; default: one per core.", show_default=False)
    ] = os.cpu_count() or 1,
    cluster: Annotated[
        str | None, typer.Option(help="Dask scheduler's address, or local:N.")
    ] = None,
    until_halfwidth: Annotated[
        float | None,
        typer.Option(help="Stop a cell once its completion is known to +- this share."),
    ] = None,
    keep: Annotated[
        str, typer.Option(help="shown: logs of runs in the report; all: of every run.")
    ] = "shown",
    resume: Annotated[bool, typer.Option("--resume", help="Finish a campaign.")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="Write CSV beside Parquet.")] = False,
) -> None:
    """Drive scenarios x weathers x frictions x seeds; prints the path of the report."""
    from skidpad.cli.grip_plan import GripWish, drive_grip, plan_grip

    wish = GripWish(
        scenarios=scenarios,
        weather=weather,
        friction=friction,
        model=model,
        cutin=cutin,
        repeats=repeats,
        config=config,
        assignments=set or [],
        profile=profile,
        controller=controller,
        sensors=sensors,
        actors=actors,
        overlay=overlay,
        four_cells=four_cells,
        until_halfwidth=until_halfwidth,
        keep=keep,
        server=ServerWish(
            backend=backend,
            host=host,
            port=port,
            pace=pace,
            without=without or [],
            server_command=server_command,
            restart_every=restart_every,
        ),
    )
    plan = plan_grip(wish)
    typer.echo(drive_grip(plan, out, workers=workers, cluster=cluster, resume=resume, csv=csv))


@campaign.command()
def estimate(
    scenarios: Annotated[str, typer.Option(help="As for grip.")] = "all",
    weather: Annotated[str, typer.Option(help="As for grip.")] = "all",
    friction: Annotated[str, typer.Option(help="As for grip.")] = "original,reduced",
    cutin: Annotated[str, typer.Option(help="As for grip.")] = "fixed",
    repeats: Annotated[int, typer.Option(min=1, help="As for grip.")] = 100,
    controller: Annotated[str, typer.Option(help="As for grip.")] = "stack",
    sensors: Annotated[str, typer.Option(help="As for grip.")] = "objects",
    workers: Annotated[
        int, typer.Option(min=1, help="Processes; default: one per core.", show_default=False)
    ] = os.cpu_count() or 1,
) -> None:
    """Say how long a friction campaign will take, from a few of its runs."""
    from skidpad.cli.grip_plan import GripWish, plan_grip, time_needed

    wish = GripWish(
        scenarios=scenarios,
        weather=weather,
        friction=friction,
        cutin=cutin,
        repeats=repeats,
        controller=controller,
        sensors=sensors,
    )
    plan = plan_grip(wish)
    typer.echo(time_needed(plan, workers))
