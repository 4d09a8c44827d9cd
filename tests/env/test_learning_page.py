"""docs/learning.md says what the environments do, and its code runs."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

pytest.importorskip("gymnasium", reason="needs Gymnasium (extra rl)")

from skidpad.env import OBSERVED, WEIGHTS

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "learning.md").read_text(encoding="utf-8")


def test_the_code_of_the_page_runs():
    blocks = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)
    assert len(blocks) == 3
    known: dict[str, object] = {}
    for block in blocks[:2]:
        exec(block, known)
    assert known["info"]["metrics"]["distance_km"] > 0.0
    assert known["observations"].shape == (2, len(OBSERVED))


def test_the_code_of_all_agents_runs():
    pytest.importorskip("pettingzoo", reason="needs PettingZoo (extra rl)")
    block = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)[2]
    known: dict[str, object] = {}
    exec(block, known)
    assert len(known["run"].log) == 100


def test_the_tables_are_those_of_the_code():
    rows = re.findall(r"^\| (\d+) \| `(\w+)` \| (\S+) \|", PAGE, re.MULTILINE)
    assert rows == [(str(i), q.name, q.unit) for i, q in enumerate(OBSERVED)]
    weights = re.findall(r"^\| `(\w+)` \| (-?[\d.]+) \|", PAGE, re.MULTILINE)
    assert {name: float(weight) for name, weight in weights} == dict(WEIGHTS)
