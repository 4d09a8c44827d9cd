"""Serving the fleet with uvicorn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import uvicorn

from skidpad.fleet.api.app import make_app
from skidpad.fleet.service import Fleet
from skidpad.pages.server import bound

CLOSING_S = 10  # s that open requests get when the server ends


@dataclass(frozen=True, slots=True)
class Listen:
    """Where to listen, and with which certificate."""

    host: str
    port: int
    certificate: Path | None = None
    key: Path | None = None


def server_of(fleet: Fleet, listen: Listen) -> uvicorn.Server:
    """A server that has not begun."""
    config = uvicorn.Config(
        make_app(fleet),
        log_level="warning",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=CLOSING_S,
        ssl_certfile=listen.certificate,
        ssl_keyfile=listen.key,
    )
    return uvicorn.Server(config)


def run(fleet: Fleet, listen: Listen, say: Callable[[str], None]) -> None:
    """Serve until a signal ends it."""
    one = bound(listen.host, listen.port)
    port = one.getsockname()[1]
    scheme = "https" if listen.certificate else "http"
    host = f"[{listen.host}]" if ":" in listen.host else listen.host
    say(f"the fleet is at {scheme}://{host}:{port}")
    fleet.dispatcher.start()
    with one:
        server_of(fleet, listen).run(sockets=[one])
