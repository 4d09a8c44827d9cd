"""Serving the fleet with uvicorn: the interface and the pages behind one guard."""

from __future__ import annotations

import gc
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import uvicorn

from skidpad.fleet.service import Fleet
from skidpad.fleet.site.build import make_site
from skidpad.fleet.site.drawing import MapLines
from skidpad.fleet.site.login import log_in_page
from skidpad.fleet.upkeep import Upkeep
from skidpad.pages.guard import Door, Guard
from skidpad.pages.server import bind_socket, host_headers
from skidpad.pages.sessions import Sessions

CLOSING_S = 10  # s that open requests get when the server ends
INVITED_S = 3600.0  # that an address of `fleet open` waits to be opened; assumption
FREE = ("/api/",)  # paths that check credentials of their own


@dataclass(frozen=True, slots=True)
class Listen:
    """Where to listen, with which certificate, and what browsers call this host besides."""

    host: str
    port: int
    certificate: Path | None = None
    key: Path | None = None
    names: tuple[str, ...] = ()


def run(fleet: Fleet, listen: Listen, lines: MapLines, say: Callable[[str], None]) -> None:
    """Serves pages and interface, with dispatcher and upkeep, until a signal ends it.

    lines: roads of a map by its name. say: is called once the port is bound, with a sentence that
    contains the address. The caller closes the fleet.
    """
    one = bind_socket(listen.host, listen.port)
    port = int(one.getsockname()[1])
    sessions = Sessions(INVITED_S)
    door = Door(
        hosts=host_headers(listen.host, port, listen.names),
        cookie=f"skidpad-{port}",
        sessions=sessions,
        secure=listen.certificate is not None,
        free=FREE,
        log_in=log_in_page,
    )
    config: Any = uvicorn.Config(
        Guard(make_site(fleet, lines, sessions), door),
        ws="wsproto",
        ws_per_message_deflate=False,
        log_level="error",
        access_log=False,
        server_header=False,
        timeout_graceful_shutdown=CLOSING_S,
        ssl_certfile=listen.certificate,
        ssl_keyfile=listen.key,
    )
    scheme = "https" if listen.certificate else "http"
    host = f"[{listen.host}]" if ":" in listen.host else listen.host
    say(f"the fleet is at {scheme}://{host}:{port}")
    upkeep = Upkeep(fleet)
    gc.freeze()  # 300 000 objects of modules are not walked through again while somebody waits
    fleet.dispatcher.start()
    upkeep.start()
    try:
        with one:
            uvicorn.Server(config).run(sockets=[one])
    finally:
        gc.unfreeze()
        upkeep.close()
