"""On which simulator a run is driven, and how that is used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from msgspec import Meta, Struct

from skidpad.core.objects.registry import Registry, load_factory


class BackendKind:
    """Names of Skidpad's own simulators."""

    EMBEDDED = "embedded"
    CARLA = "carla"


class BackendChoice(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A simulator and, for a CARLA server, where it is and how it is used."""

    backend: Annotated[
        str,
        Meta(
            description="embedded; carla: a CARLA server drives the world; or that of a package "
            "(`skidpad extensions backends`)."
        ),
    ] = BackendKind.EMBEDDED
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

    def to_identity(self) -> dict[str, Any]:
        """Returns what of it decides a run, as plain data; an address does not."""
        plain: dict[str, Any] = msgspec.to_builtins(self)
        return {name: value for name, value in plain.items() if name not in ADDRESS}


ADDRESS = ("host", "port", "server_command", "restart_every")


@dataclass(frozen=True, slots=True)
class BackendType:
    """A simulator that runs can be driven on.

    Attributes:
        name: The word of `--backend`.
        title: A few words for tables and pages.
        factory: `factory(choice, watchdog)` returns a fresh `skidpad.simulation.backend.Backend`;
            watchdog: s without a tick after which the process ends, None: never. A text
            "module:function" names one that is imported when it is needed.
    """

    name: str
    title: str
    factory: Callable[[BackendChoice, float | None], Any] | str

    def make(self, choice: BackendChoice, watchdog: float | None = None) -> Any:
        """Returns a fresh backend, ready to be reset."""
        return load_factory(self.factory)(choice, watchdog)


def _own_backends() -> tuple[BackendType, ...]:
    """Returns the backends that Skidpad itself registers: embedded and CARLA."""
    at = "skidpad.campaign.driving.backends:"
    return (
        BackendType(BackendKind.EMBEDDED, "The simulator of Skidpad", at + "make_embedded"),
        BackendType(BackendKind.CARLA, "A CARLA server", at + "make_carla"),
    )


BACKENDS = Registry("backend", "skidpad.backends", BackendType, _own_backends)
