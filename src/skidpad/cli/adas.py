"""`skidpad adas`: drive the ADAS-in-weather matrix and write its report."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
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


def adas(
    how: How,
    configs: Annotated[
        str | None, typer.Option(help="Published configurations, e.g. 0,1,4; default all five.")
    ] = None,
    functions: Annotated[
        str | None, typer.Option(help="Any set of aeb,acc,lca,tla,resume,limiter.")
    ] = None,
    stack: Annotated[
        str | None, typer.Option(help="Your own stack: module:Class or file.py:Class.")
    ] = None,
    weather: Annotated[
        str, typer.Option(help="all, or presets and YAML files parted by commas.")
    ] = "all",
    sweep: Annotated[
        str | None, typer.Option(help="Vary one weather field: FIELD=FROM:TO:STEP.")
    ] = None,
    grip: Annotated[
        str | None, typer.Option(help="none, statistical or physical; default: the profile's.")
    ] = None,
    range: Annotated[
        str | None, typer.Option(help="none or physical; default: the profile's.")
    ] = None,
    seeds: Seeds = 1,
    duration: Annotated[float, typer.Option(help="Simulated seconds per run.")] = 500.0,
    profile: Annotated[
        str, typer.Option(help="recommended, thesis_text, thesis_listing or preliminary.")
    ] = "recommended",
    set: Annotated[
        list[str] | None, typer.Option(help="Single settings over the profile: name=value.")
    ] = None,
    map: Annotated[
        str, typer.Option(help="A bundled map's name, or an OpenDRIVE file.")
    ] = "figure8",
    traffic: Annotated[str, typer.Option(help="fixed or random.")] = "fixed",
    vehicles: Annotated[int, typer.Option(help="Background vehicles, 0 to 80.")] = 20,
    sensors: Annotated[
        str, typer.Option(help="pixels: real images; objects: from boxes, much faster.")
    ] = "pixels",
    render: Annotated[
        str, typer.Option(help="needed: images that something reads; all: every image.")
    ] = "needed",
    backend: Backend = "embedded",
    host: Host = "127.0.0.1",
    port: Port = 2000,
    pace: Pace = False,
    without: Without = None,
    server_command: ServerCommand = None,
    restart_every: RestartEvery = 0,
) -> None:
    """Drive configurations x weathers x seeds; prints the path of the report."""
    from skidpad.cli.adas_plan import Wish, campaign_of
    from skidpad.report.matrix import write_report

    wish = Wish(
        configs=configs,
        functions=functions,
        stack=stack,
        weather=weather,
        sweep=sweep,
        grip=grip,
        range=range,
        seeds=seeds,
        duration=duration,
        profile=profile,
        assignments=set or [],
        map=map,
        traffic=traffic,
        vehicles=vehicles,
        sensors=sensors,
        render=render,
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
    how(campaign_of(wish), write_report)


def report(folder: Annotated[Path, typer.Argument(help="A campaign's folder.")]) -> None:
    """Write the report of a campaign again, from what it left behind."""
    from skidpad.cli.channels_drive import totals
    from skidpad.recording.ledger import campaign_command
    from skidpad.report.grip import write_grip_report
    from skidpad.report.matrix import write_report

    reports: dict[str, Callable[[Path], object]] = {
        "adas": write_report,
        "grip": write_grip_report,
        "channels": totals,
    }
    typer.echo(reports[campaign_command(folder)](folder))


def show(run: Annotated[Path, typer.Argument(help="A run's folder.")]) -> None:
    """Print one run: what it was, what it came to, and its crashes."""
    from skidpad.cli.show import show as print_run

    print_run(run)
