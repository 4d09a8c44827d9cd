"""Running programs with the real client in processes of their own: the wheel can abort them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

TESTS = Path(__file__).resolve().parents[1]
HERE = TESTS / "support" / "carla"
LIMIT = 600.0  # s


def environment() -> dict[str, str]:
    """Ours, with the package and the tests' own modules importable."""
    paths = [str(TESTS.parent / "src"), str(TESTS), os.environ.get("PYTHONPATH", "")]
    return os.environ | {"PYTHONPATH": os.pathsep.join(p for p in paths if p)}


def run_program(name: str, *arguments: object) -> Any:
    """What a program of that folder printed after RESULT; its exit status is the wheel's own."""
    command = [sys.executable, str(HERE / f"{name}.py"), *map(str, arguments)]
    # The wheel hangs or crashes now and then, on a busy machine in one run of six: two more tries.
    for last in (False, False, True):
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
