"""Calls of the 0.9.16 client that are known and refused in words."""

from __future__ import annotations

from typing import Any

from skidpad.simulation.carla_server.rpc import CallError, Table
from skidpad.simulation.carla_server.served import Served

TABLE = Table("not served")
REASONS = {
    "get_gbuffer_token": "there are no G-buffers",
}


def _refuse(name: str, reason: str) -> None:
    @TABLE.method(name)
    def refused(_: Served, *__: Any) -> None:
        """Refused."""
        raise CallError(f"{name} is not served: {reason}")


for _name, _reason in REASONS.items():
    _refuse(_name, _reason)


@TABLE.method("enable_gbuffers", without_effect=REASONS["get_gbuffer_token"])
def enable_gbuffers(_: Served, *__: Any) -> None:
    """Accepted."""


@TABLE.method("are_gbuffers_enabled")
def are_gbuffers_enabled(_: Served, *__: Any) -> bool:
    """Never."""
    return False


@TABLE.method("console_command", without_effect="there is no console")
def console_command(_: Served, *__: Any) -> bool:
    """Accepted."""
    return True
