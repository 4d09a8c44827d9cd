"""A server of pages in a thread of its own: bound before it starts, so its port is known."""

from __future__ import annotations

import errno
import socket
import threading
import time
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import ip_address
from typing import Any
from urllib.parse import urlencode

from skidpad.core.errors import ConfigError, MissingExtra, SkidpadError
from skidpad.pages.guard import TOKEN, App, Door, Guard
from skidpad.pages.sessions import Sessions

LOOPBACK = "127.0.0.1"
STARTS_WITHIN, STOPS_WITHIN = 120.0, 5.0  # s
POLL = 0.01  # s
OWNER = "owner"  # who is invited by the address that a command prints


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """Host and port at which pages are served."""

    host: str = LOOPBACK
    port: int = 0  # 0: any free one
    names: tuple[str, ...] = ()  # what else browsers call this host
    secure: bool = False  # browsers come by https, through a proxy


class Server:
    """Serves an ASGI application behind the guard, from `start` to `stop`."""

    def __init__(self, app: App, place: Place = Place(), free: tuple[str, ...] = ()) -> None:
        """ConfigError when the port is in use.

        free: beginnings of paths whose handlers check credentials of their own.
        """
        try:
            import uvicorn
        except ImportError as error:
            raise MissingExtra("serving pages", "cockpit") from error
        self._socket = bind_socket(place.host, place.port)
        self.host, self.port = place.host, int(self._socket.getsockname()[1])
        self.sessions = Sessions()
        door = Door(
            hosts=host_headers(place.host, self.port, place.names),
            cookie=f"skidpad-{self.port}",
            sessions=self.sessions,
            secure=place.secure,
            free=free,
        )
        config: Any = uvicorn.Config(
            Guard(app, door),
            ws="wsproto",
            ws_per_message_deflate=False,
            log_config=None,
            log_level="error",
            access_log=False,
            timeout_graceful_shutdown=round(STOPS_WITHIN),
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._serve, name="pages")

    def _serve(self) -> None:
        """Runs the ASGI server on its bound socket until it stops or its application fails to start."""
        with suppress(SystemExit):  # how uvicorn says that the application did not begin
            self._server.run([self._socket])

    def address(self, who: str = OWNER, path: str = "/") -> str:
        """Returns an address that opens one session for `who`."""
        shown = f"[{self.host}]" if ":" in self.host else self.host
        query = urlencode({TOKEN: self.sessions.invite(who)})
        return f"http://{shown}:{self.port}{path}?{query}"

    def start(self) -> None:
        """Starts serving and returns once it answers; SkidpadError if not within STARTS_WITHIN s."""
        self._thread.start()
        deadline = time.monotonic() + STARTS_WITHIN
        while not self._server.started:
            if not self._thread.is_alive() or time.monotonic() > deadline:
                self.stop()
                raise SkidpadError(f"the page server on port {self.port} did not start")
            time.sleep(POLL)

    def stop(self) -> None:
        """Ends serving and closes the socket; safe to call twice."""
        self._server.should_exit = True
        if self._thread.is_alive():
            self._thread.join()
        self._socket.close()

    def __enter__(self) -> Server:
        self.start()
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()


def bind_socket(host: str, port: int) -> socket.socket:
    """Returns a listening socket at this place, port 0: any free one; ConfigError when it cannot be had."""
    if not 0 <= port <= 65535:
        raise ConfigError(f"port must be between 0 and 65535, got {port}")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    found = socket.socket(family, socket.SOCK_STREAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        found.bind((host, port))
        found.listen(128)  # else another one may bind it too, by SO_REUSEADDR
    except OSError as error:
        found.close()
        if error.errno == errno.EADDRINUSE:
            raise ConfigError(
                f"port {port} of {host} is in use: give another one, or 0 for any free one"
            ) from error
        raise ConfigError(f"cannot serve on {host}, port {port}: {error.strerror}") from error
    return found


def host_headers(host: str, port: int, names: tuple[str, ...]) -> frozenset[str]:
    """Returns the values of the header Host by which browsers name this server.

    names: further ones, taken with and without the port, as behind a proxy.
    """
    known = {host.lower()}
    if is_local(host) or host in ("0.0.0.0", "::"):
        known |= {LOOPBACK, "localhost", "::1"}
    plain = {f"[{name}]" if ":" in name else name for name in known}
    told = {name.lower() for name in names}  # also without the port, as behind a proxy
    ours = {f"{name}:{port}" for name in plain | told} | told
    return frozenset(ours | plain if port in (80, 443) else ours)


def is_local(host: str) -> bool:
    """Returns True when only this machine reaches a host: localhost or a loopback address."""
    if host == "localhost":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        return False
