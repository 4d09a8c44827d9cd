"""The monitor's own process while it judges."""

from __future__ import annotations

import subprocess
import sys

import pytest

PROGRAM = """
import gc
from skidpad.live.child import settle, warm_up

warm_up(("a", "b"))
settle()
before = gc.get_stats()[2]["collections"]
kept = []
for _ in range(200_000):
    kept.append([kept])
assert gc.get_freeze_count() > 50_000, gc.get_freeze_count()
assert gc.get_stats()[2]["collections"] == before
"""


@pytest.mark.req("C-005", "C-235")
def test_no_search_for_cycles_falls_into_a_cycle() -> None:
    """A full one took 64 and 72 ms in two of 36 000 cycles, where 25 are allowed."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
