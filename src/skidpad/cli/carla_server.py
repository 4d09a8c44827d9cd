"""`skidpad carla-server`: the embedded simulator behind CARLA's network protocol."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from skidpad.core.errors import MissingExtra
from skidpad.core.vocabulary import GripModel


def carla_server(
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int, typer.Option(help="RPC port; 0: any free one. Streams use the next.")
    ] = 2000,
    map: Annotated[str, typer.Option(help="Map to begin with.")] = "figure8",
    maps: Annotated[Path | None, typer.Option(help="Folder of your own .xodr files.")] = None,
    weather_grip: Annotated[
        GripModel, typer.Option(help="How weather acts on tyres.")
    ] = GripModel.PHYSICAL,
    ice: Annotated[float, typer.Option(min=0.0, max=100.0, help="Ice, percent of 2 cm.")] = 0.0,
    mu_ref: Annotated[
        float, typer.Option(min=0.05, max=3.0, help="Friction at tire_friction 3.5 on dry road.")
    ] = 1.5,
    seed: Annotated[int, typer.Option(help="Seed of sensor noise.")] = 0,
    strict: Annotated[bool, typer.Option(help="Report unknown calls; exit with 1.")] = False,
    record_calls: Annotated[Path | None, typer.Option(help="Write every call here.")] = None,
    data_dir: Annotated[
        Path | None, typer.Option(help="Folder for files named by clients.")
    ] = None,
    idle_exit: Annotated[
        float | None, typer.Option(min=0.0, help="Stop after so many seconds without a client.")
    ] = None,
) -> None:
    """Serve unmodified CARLA 0.9.16 clients: no GPU, no download."""
    try:
        from skidpad.simulation.carla_server.options import ServerOptions
        from skidpad.simulation.carla_server.server import CarlaServer, Ports
    except ModuleNotFoundError as error:
        if error.name != "msgpack":
            raise
        raise MissingExtra("skidpad carla-server", "server") from error

    logging.basicConfig(
        level=logging.WARNING if strict else logging.ERROR, format="skidpad: %(message)s"
    )
    options = ServerOptions(
        host=host,
        port=port,
        map=map,
        maps=maps,
        weather_grip=weather_grip,
        ice=ice,
        mu_ref=mu_ref,
        seed=seed,
        strict=strict,
        record_calls=record_calls,
        data_dir=data_dir,
        idle_exit=idle_exit,
    )
    server = CarlaServer(options)

    def ready(ports: Ports) -> None:
        typer.echo(
            f"skidpad carla-server ready: CARLA 0.9.16 on {host}:{ports.rpc}, "
            f"streams on {ports.streaming}, map {server.served.episode.map.name}"
        )

    with suppress(KeyboardInterrupt):
        asyncio.run(server.run(ready))
    if strict and server.complaints():
        typer.echo("\n".join(server.complaints()), err=True)
        raise typer.Exit(1)


def command(arguments: list[str]) -> None:
    """Run it with these arguments; help lists its options."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(carla_server)
    app(arguments, prog_name="skidpad carla-server", standalone_mode=False)
