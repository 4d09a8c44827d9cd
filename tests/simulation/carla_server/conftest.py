"""A server in a process of its own, and clients in others: the wheel can abort its process."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from skidpad.simulation.carla_server.process import ServerProcess
from skidpad.simulation.carla_server.streams import StreamHub
from skidpad.simulation.carla_server.world import ServerOptions, World

CLIENT_LIMIT = 120.0  # s
PREFACE = """
import carla, math, sys, time
client = carla.Client("127.0.0.1", int(sys.argv[1]))
client.set_timeout(20.0)
world = client.get_world()

def synchronous(step=0.05):
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, step
    world.apply_settings(settings)

def finish():
    for sensor in world.get_actors().filter("sensor.*"):
        sensor.destroy()  # not stop: see skidpad.pytest_plugin.stop_sensors
    print("DONE", flush=True)
    import os
    os._exit(0)
"""


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
    """Start servers with options; all are stopped at the end."""
    pytest.importorskip("carla")
    started: list[Server] = []

    def start(*options: str) -> Server:
        started.append(Server(["--idle-exit", "120", *options]))
        return started[-1]

    yield start
    for server in started:
        server.stop()


@pytest.fixture
def world(tmp_path: Path) -> World:
    """A world without a network."""
    return World(ServerOptions(data_dir=tmp_path), StreamHub())
