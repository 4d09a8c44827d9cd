"""`skidpad grip`: what changes when weather also changes grip, in thousands of paired runs."""

from __future__ import annotations

from typing import Annotated

import typer

from skidpad.cli.campaigns import How, Seeds
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


def grip(
    how: How,
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
    seeds: Seeds = 100,
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
    keep: Annotated[
        str, typer.Option(help="shown: logs of runs in the report; all: of every run.")
    ] = "shown",
) -> None:
    """Drive scenarios x weathers x frictions x seeds; prints the path of the report."""
    from skidpad.cli.grip_plan import GripWish, campaign_of
    from skidpad.report.grip import write_grip_report

    wish = GripWish(
        scenarios=scenarios,
        weather=weather,
        friction=friction,
        model=model,
        cutin=cutin,
        repeats=seeds,
        config=config,
        assignments=set or [],
        profile=profile,
        controller=controller,
        sensors=sensors,
        actors=actors,
        overlay=overlay,
        four_cells=four_cells,
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
    how(campaign_of(wish), write_grip_report)
