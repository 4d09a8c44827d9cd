"""The options that name a simulator, the same for every command that drives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import typer

Backend = Annotated[str, typer.Option(help="embedded, or carla: a CARLA server drives the world.")]
Host = Annotated[str, typer.Option(help="Of the CARLA server.")]
Port = Annotated[int, typer.Option(help="Of the CARLA server.")]
Pace = Annotated[bool, typer.Option("--pace", help="CARLA: hold runs at real time.")]
Without = Annotated[
    list[str] | None,
    typer.Option(help="CARLA: an optimisation to switch off, e.g. light-cache."),
]
ServerCommand = Annotated[
    str | None, typer.Option(help="CARLA: command that starts the server for these runs.")
]
RestartEvery = Annotated[
    int, typer.Option(min=0, help="CARLA: runs after which that server is started anew.")
]


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerWish:
    """What the user asked for by these options."""

    backend: str = "embedded"
    host: str = "127.0.0.1"
    port: int = 2000
    pace: bool = False
    without: Sequence[str] = ()
    server_command: str | None = None
    restart_every: int = 0
