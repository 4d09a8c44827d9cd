"""A server in a process of its own, and clients in others: the wheel can abort its process."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.process import ServerProcess
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.served import Served
from support.carla_preface import PREFACE

CLIENT_LIMIT = 600.0  # s


class Server(ServerProcess):
    """A running server, and clients for it."""

    def client(self, script: str) -> str:
        """Run a client script to its DONE; what it printed."""
        code = PREFACE + textwrap.dedent(script) + "\nfinish()\n"
        done = subprocess.run(
            [sys.executable, "-c", code, str(self.port)],
            capture_output=True,
            text=True,
            timeout=CLIENT_LIMIT,
            check=False,
        )
        assert "DONE" in done.stdout, f"{done.stdout}\n{done.stderr}"
        assert self.alive
        return done.stdout


@pytest.fixture
def without_hang() -> Callable[[Callable[[], str]], str]:
    """Try a client with a Traffic Manager again when the wheel hangs (see MANAGER_REST)."""

    def tried(attempt: Callable[[], str]) -> str:
        try:
            return attempt()
        except subprocess.TimeoutExpired:
            return attempt()

    return tried


@pytest.fixture
def serve() -> Iterator[Callable[..., Server]]:
    """Start servers with options; all are stopped at the end.

    What sensors say is compared with bare roads, so there is no scenery unless a test asks for it,
    and bodies are those that runs have by default.
    """
    pytest.importorskip("carla")
    started: list[Server] = []

    def start(*options: str) -> Server:
        bare = () if "--scenery" in options else ("--scenery", "none")
        plain = () if "--bodywork" in options else ("--bodywork", "plain")
        started.append(Server(["--idle-exit", "120", *bare, *plain, *options]))
        return started[-1]

    yield start
    for server in started:
        server.stop()


@pytest.fixture
def served(tmp_path: Path) -> Served:
    """A simulation without a network."""
    return Served(ServerOptions(data_dir=tmp_path), StreamHub())
