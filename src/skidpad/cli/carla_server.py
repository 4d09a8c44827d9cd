"""`skidpad carla-server`: the embedded simulator behind CARLA's network protocol."""

from __future__ import annotations

import asyncio
import logging
from contextlib import suppress

import typer

from skidpad.cli.options.spread import spread_fields
from skidpad.core.errors import MissingExtra, require_choice
from skidpad.core.vocabulary import Govern
from skidpad.simulation.carla_server.options import ServerOptions


@spread_fields()
def carla_server(options: ServerOptions) -> None:
    """Serve unmodified CARLA 0.9.16 clients: no GPU, no download."""
    try:
        import msgpack  # noqa: F401
    except ModuleNotFoundError as error:
        raise MissingExtra("skidpad carla-server", "server") from error
    from skidpad.simulation.carla_server.maps.maps import MapStore

    require_choice("--map", options.map.rsplit("/", 1)[-1], MapStore(options.maps).names())
    egos = None
    if options.govern is not Govern.NONE:
        from skidpad.campaign.driving.served_egos import GovernedEgos

        egos = GovernedEgos(options.govern, options.seed)
    from skidpad.simulation.carla_server.server import CarlaServer, Ports
    from skidpad.simulation.carla_server.warming import start_compiling

    logging.basicConfig(
        level=logging.WARNING if options.strict else logging.ERROR, format="skidpad: %(message)s"
    )

    def say(words: str) -> None:
        typer.echo(f"skidpad carla-server: {words}", err=True)

    helper = start_compiling(options, say)
    server = CarlaServer(options)
    server.served.before_tick = egos
    if options.ros_domain is not None:
        from skidpad.live.ros2.sensor_topics import SensorTopics
        from skidpad.simulation.carla_server.ros_output import RosOutput

        server.served.ros = RosOutput(SensorTopics(options.ros_domain), server.served.hub)

    def ready(ports: Ports) -> None:
        typer.echo(
            f"skidpad carla-server ready: CARLA 0.9.16 on {options.host}:{ports.rpc}, "
            f"streams on {ports.streaming}, map {server.served.episode.map.name}"
        )

    with suppress(KeyboardInterrupt):
        asyncio.run(server.run(ready, helper))
    if options.strict and server.complaints():
        typer.echo("\n".join(server.complaints()), err=True)
        raise typer.Exit(1)


def command(arguments: list[str]) -> None:
    """Runs `carla-server` with these arguments; --help lists its options."""
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(carla_server)
    app(arguments, prog_name="skidpad carla-server", standalone_mode=False)
