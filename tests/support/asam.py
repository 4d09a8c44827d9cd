"""The ASAM checkers, which have an environment of their own: run by its Python, or the test skips."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

PROGRAM = Path(__file__).parent / "scenarios" / "asam_check.py"


def require_asam_python() -> str:
    """Returns the Python of the environment with the ASAM checkers; without it the test skips."""
    python = os.environ.get("SKIDPAD_ASAM_PYTHON")
    if not python or not Path(python).exists():
        pytest.skip("SKIDPAD_ASAM_PYTHON names no environment with the ASAM checkers")
    return python


def asam_verdicts(*files: Path) -> dict[str, Any]:
    """Returns what the checkers say of each file, by its path."""
    done = subprocess.run(
        [require_asam_python(), str(PROGRAM), *map(str, files)],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    return json.loads(next(r for r in done.stdout.splitlines() if r.startswith("ASAM "))[5:])
