"""`skidpad channels drive`: drive channels over routes and record what they say."""

from __future__ import annotations

from pathlib import Path

import typer

from skidpad.cli.server_options import (
    Backend,
    Host,
    Port,
    RestartEvery,
    ServerCommand,
    ServerWish,
)

ROUTE = typer.Option("all", help="One of the six routes, or all.")
OUT = typer.Option(..., help="Folder for recordings; driving again resumes.")
HOURS = typer.Option(1.0, help="Hours in total, split equally among the routes.")
CHANNELS = typer.Option("lav_like,tfuse_like", help="Names, the preferred one first.")
SEED = typer.Option(0, help="First seed; different numbers give disjoint seeds.")
MAP = typer.Option(None, help="Drive on this map (.xodr) instead of the route's own.")
NOISE = typer.Option(1.0, help="Factor on all sensor errors: 0.5, 1 or 2 for the sweep.")
WORKERS = typer.Option(1, help="Worker processes.")
FOLDERS = typer.Argument(help="Folders of `skidpad channels drive`.")
DRIVE_BY = typer.Option("arbiter", help="The arbiter, or the channel that drives alone.")


def drive(
    route: str = ROUTE,
    out: Path = OUT,
    hours: float = HOURS,
    channels: str = CHANNELS,
    seed: int = SEED,
    map: Path | None = MAP,
    noise: float = NOISE,
    workers: int = WORKERS,
    drive_by: str = DRIVE_BY,
    backend: Backend = "embedded",
    host: Host = "127.0.0.1",
    port: Port = 2000,
    server_command: ServerCommand = None,
    restart_every: RestartEvery = 0,
) -> None:
    """Drive channels over routes on a simulator; one recording per ten minutes."""
    from skidpad.campaign.cells import BackendChoice
    from skidpad.campaign.channel_routes import chosen_routes
    from skidpad.campaign.channels import run_drives, segment_plans
    from skidpad.cli.carla_backend import backend_choice
    from skidpad.roads.bundled import load_map
    from skidpad.sensors.channel_presets import senses_of

    names = tuple(name.strip() for name in channels.split(",") if name.strip())
    for name in names:
        senses_of(name)
    routes = chosen_routes(route, map)
    for chosen in routes:
        load_map(chosen.map)
    choice = backend_choice(
        ServerWish(
            backend=backend,
            host=host,
            port=port,
            server_command=server_command,
            restart_every=restart_every,
        )
    )
    plans = segment_plans(
        routes,
        hours,
        channels=names,
        seed=seed,
        drive_by=drive_by,
        noise=noise,
        backend=choice,
    )
    summary = run_drives(
        plans,
        out,
        workers=workers if choice == BackendChoice() else 1,  # a server drives one run at a time
        on_run=lambda o: typer.echo(
            f"{o.route} seed {o.seed}: {o.driven_s:.0f} s, {o.distance_m:.0f} m, "
            f"{o.collisions} collisions, {o.red_lights_run} red lights run, ended by {o.ended}"
        ),
    )
    total = sum(o.driven_s for o in summary.outcomes)
    typer.echo(
        f"{out}: {len(summary.outcomes)} segments, {total / 3600.0:.2f} h, "
        f"{sum(o.distance_m for o in summary.outcomes) / 1000.0:.1f} km, "
        f"{sum(o.collisions for o in summary.outcomes)} collisions, "
        f"{sum(o.red_lights_run for o in summary.outcomes)} red lights run, "
        f"{sum(o.stalls for o in summary.outcomes)} stalls"
    )
    if summary.failed:
        typer.echo(f"not driven to an end: {', '.join(summary.failed)}", err=True)
        raise typer.Exit(1)


def outcomes(folders: list[Path] = FOLDERS) -> None:
    """Compare drivers over the seeds that all have driven: does redundancy pay?"""
    from skidpad.core.errors import FileError
    from skidpad.evidence.channels.redundancy import compare_drivers
    from skidpad.recording.channel_drives import read_outcomes

    driven = read_outcomes(folders)
    if not driven:
        raise FileError(f"no driven segments below {', '.join(map(str, folders))}")
    for row in compare_drivers(driven):
        typer.echo(f"{row.drive_by}: {row.segments} segments, {row.hours:.2f} h, {row.km:.1f} km")
        for event, rate in row.rates.items():
            few = ", too few for a verdict" if rate.too_few else ""
            typer.echo(
                f"  {event}: {rate.events}, {rate.rate:.2f} per h "
                f"({rate.interval.low:.2f} to {rate.interval.high:.2f}){few}"
            )
