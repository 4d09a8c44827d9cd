"""Servers and programs for the adapter's tests."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from skidpad.simulation.carla_server.process import ServerProcess
from support.carla_programs import run_program

BARE = (
    "--scenery",
    "none",
    "--bodywork",
    "plain",
)  # runs there and here are compared, and runs have none


@pytest.fixture
def program() -> Callable[..., Any]:
    """Run a program of this folder."""
    return run_program


@pytest.fixture(scope="module")
def serve() -> Iterator[Callable[..., ServerProcess]]:
    """Servers with options, one for each set of them."""
    pytest.importorskip("carla")
    started: dict[tuple[str, ...], ServerProcess] = {}

    def start(*options: str) -> ServerProcess:
        if options not in started or not started[options].alive:
            started[options] = ServerProcess(["--idle-exit", "600", *BARE, *options])
        return started[options]

    yield start
    for server in started.values():
        server.stop()
