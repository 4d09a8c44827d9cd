"""On which simulator a run is driven, and how that is used."""

from __future__ import annotations

from enum import Enum
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct


class BackendKind(str, Enum):
    """Which simulator drives the world."""

    EMBEDDED = "embedded"
    CARLA = "carla"


class BackendChoice(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A simulator and, for a CARLA server, where it is and how it is used."""

    backend: Annotated[BackendKind, Meta(description="carla: a CARLA server drives the world.")] = (
        BackendKind.EMBEDDED
    )
    host: Annotated[str, Meta(description="Of the CARLA server.")] = "127.0.0.1"
    port: Annotated[int, Meta(ge=1, le=65535, description="Of the CARLA server.")] = 2000
    pace: Annotated[bool, Meta(description="CARLA: hold runs at real time.")] = False
    without: Annotated[
        tuple[str, ...],
        Meta(description="CARLA: an optimisation to switch off, e.g. light-cache."),
    ] = ()
    server_command: Annotated[
        str, Meta(description="CARLA: command that starts the server for these runs.")
    ] = ""  # "": it runs already
    restart_every: Annotated[
        int, Meta(ge=0, description="CARLA: runs after which that server is started anew.")
    ] = 0  # 0: never

    def resolved(self) -> dict[str, Any]:
        """What of it decides a run; an address does not."""
        plain: dict[str, Any] = msgspec.to_builtins(self)
        return {name: value for name, value in plain.items() if name not in ADDRESS}


ADDRESS = ("host", "port", "server_command", "restart_every")
