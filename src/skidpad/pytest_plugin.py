"""A fixture with a running CARLA-protocol server and a connected client (decision K-13).

    def test_my_agent(skidpad_carla):
        car = skidpad_carla.world.spawn_actor(...)

One server per test session and xdist worker, on free ports; each test begins in a fresh episode.
Options of the server: `skidpad_carla_options = --map straight` in the pytest configuration.
"""

from __future__ import annotations

import gc
import shlex
import socket
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.process import ServerProcess

IDLE_EXIT = "600"  # s, so that a killed test run leaves no server behind
CLIENT_TIMEOUT = 30.0  # s


@dataclass(frozen=True)
class CarlaSession:
    """Holds the client, the world and the ports that a test uses."""

    client: Any  # carla.Client
    world: Any  # carla.World, a fresh episode in asynchronous mode
    port: int
    tm_port: int  # free, for `client.get_trafficmanager`


def pytest_addoption(parser: pytest.Parser) -> None:
    """The ini value with the server's options."""
    parser.addini("skidpad_carla_options", "options of skidpad carla-server", default="")


@pytest.fixture(scope="session")
def skidpad_carla_server(request: pytest.FixtureRequest) -> Iterator[ServerProcess]:
    """A server for the whole session; skips when the client is not installed."""
    pytest.importorskip("carla", reason="pip install 'skidpad[carla]'")
    from skidpad.simulation.carla_server.process import ServerProcess

    options = shlex.split(str(request.config.getini("skidpad_carla_options")))
    with ServerProcess(["--idle-exit", IDLE_EXIT, *options]) as server:
        yield server


@pytest.fixture
def skidpad_carla(skidpad_carla_server: ServerProcess) -> Iterator[CarlaSession]:
    """Client, world and a port for a Traffic Manager."""
    import carla

    client = carla.Client("127.0.0.1", skidpad_carla_server.port)
    client.set_timeout(CLIENT_TIMEOUT)
    world = client.reload_world()
    session = CarlaSession(client, world, skidpad_carla_server.port, free_port())
    yield session
    stop_sensors(world)


def free_port() -> int:
    """A port that nobody listens on now."""
    with socket.socket() as probe:
        probe.bind(("", 0))
        return int(probe.getsockname()[1])


def stop_sensors(world: Any) -> None:
    """Remove sensors that the test left behind.

    A sensor that a test object still listens to is stopped by that object when it is freed, so
    freed it is first. Stopping it here, through a second object, would close its socket twice,
    and the client's process dies of that now and then.
    """
    gc.collect()
    for actor in world.get_actors().filter("sensor.*"):
        actor.destroy()
