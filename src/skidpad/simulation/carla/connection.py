"""The connection to a server: found or not, of the right version, and what it says when it fails."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from skidpad.core.errors import BackendError, MissingExtra
from skidpad.simulation.carla.options import CarlaOptions

_CLIENTS: dict[tuple[str, int], list[Any]] = {}  # of this process, newest last
PROBE = 5.0  # s to find out whether a server listens at all


@dataclass(frozen=True, slots=True)
class Connection:
    """A client that was understood once. `carla` is the wheel's module."""

    carla: Any
    client: Any
    options: CarlaOptions


def wheel() -> Any:
    """Returns the module `carla`; MissingExtra when it is not installed."""
    try:
        import carla
    except ModuleNotFoundError as error:
        raise MissingExtra("--backend carla", "carla") from error
    return carla


def require_server(options: CarlaOptions) -> None:
    """Raises BackendError when no server listens at that address."""
    try:
        socket.create_connection((options.host, options.port), PROBE).close()
    except OSError:
        raise BackendError(
            f"no CARLA server answers at {options.address}: start one (for example `skidpad "
            f"carla-server --port {options.port}`) or name another with --host and --port"
        ) from None


def connect(options: CarlaOptions) -> Connection:
    """Returns a connection to the server at that address; BackendError for none or another version.

    MissingExtra where the client is not installed.
    """
    carla = wheel()
    require_server(options)
    with speaking(options, "greeting it"):
        client = _client(carla, options)
        client.set_timeout(options.timeout)
        theirs, ours = client.get_server_version(), client.get_client_version()
    if release(theirs) != release(ours):
        raise BackendError(
            f"the CARLA server at {options.address} has version {theirs}, the installed client "
            f"{ours}: install carla=={release(theirs)}"
        )
    return Connection(carla, client, options)


def _client(carla: Any, options: CarlaOptions) -> Any:
    """Returns the client of this address that was used before, or a new one if that no longer works.

    None is ever given up: the wheel aborts the process when a client ends on one of its threads.
    """
    kept = _CLIENTS.setdefault((options.host, options.port), [])
    if kept:
        kept[-1].set_timeout(PROBE)
        try:
            kept[-1].get_server_version()
        except RuntimeError:  # the server was started anew: its connection is gone
            pass
        else:
            return kept[-1]
    kept.append(carla.Client(options.host, options.port))
    return kept[-1]


def release(version: str) -> str:
    """Returns the release of a version text: `0.9.16` of `0.9.16-12-gabcdef`; another text as it is."""
    found = re.match(r"\d+(\.\d+)*", version)
    return found[0] if found else version


@contextmanager
def speaking(options: CarlaOptions, doing: str) -> Iterator[None]:
    """Turns a RuntimeError of the wheel into one BackendError that says what was being done."""
    try:
        yield
    except RuntimeError as error:
        said = " ".join(str(error).split())
        raise BackendError(f"CARLA at {options.address} failed while {doing}: {said}") from error
