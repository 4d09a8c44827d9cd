"""A server in one process, the real client in another: the wheel can abort its process."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from skidpad.simulation.carla_server.process import ServerProcess

HERE = Path(__file__).parent
TESTS = HERE.parents[1]
LIMIT = 180.0  # s
Program = Callable[..., Any]


def environment() -> dict[str, str]:
    """Ours, with the package and the tests' own modules importable."""
    paths = [str(TESTS.parent / "src"), str(TESTS), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(p for p in paths if p)}


def run_program(name: str, *arguments: object) -> Any:
    """What a program of this folder printed after RESULT; its exit status is the wheel's own."""
    command = [sys.executable, str(HERE / f"{name}.py"), *map(str, arguments)]
    for last in (False, True):  # the wheel's Traffic Manager hangs now and then: one more try
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=LIMIT,
                env=environment(),
                check=False,
            )
        except subprocess.TimeoutExpired:
            if last:
                raise
            continue
        lines = [x for x in done.stdout.splitlines() if x.startswith("RESULT ")]
        if lines or last:
            assert lines, f"{name} printed no result:\n{done.stdout[-2000:]}\n{done.stderr[-4000:]}"
            return json.loads(lines[-1].removeprefix("RESULT "))
    raise AssertionError


@pytest.fixture
def program() -> Program:
    """Run a program of this folder."""
    return run_program


@pytest.fixture(scope="module")
def serve() -> Iterator[Callable[..., ServerProcess]]:
    """Servers with options, one for each set of them."""
    pytest.importorskip("carla")
    started: dict[tuple[str, ...], ServerProcess] = {}

    def start(*options: str) -> ServerProcess:
        if options not in started or not started[options].alive:
            started[options] = ServerProcess(["--idle-exit", "600", *options])
        return started[options]

    yield start
    for server in started.values():
        server.stop()
