"""Intervals in the prose of a results page are those of its tables."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
PROSE = re.compile(rf"\[({NUMBER}), ({NUMBER})\]")
TABLE = re.compile(rf"\[({NUMBER}), ({NUMBER})\]|95 % ({NUMBER}) to ({NUMBER})")


def digits(number: str) -> int:
    return len(number.partition(".")[2])


def prose_and_tables(text: str) -> tuple[list[tuple[str, str]], list[tuple[float, float]]]:
    """Intervals as printed in prose, and those of all tables."""
    lines = text.splitlines()
    prose = PROSE.findall("\n".join(line for line in lines if not line.startswith("|")))
    rows = TABLE.findall("\n".join(line for line in lines if line.startswith("|")))
    return prose, [(float(a or c), float(b or d)) for a, b, c, d in rows]


@pytest.mark.parametrize(
    ("page", "until"), [("matrix.md", "## The version before: 37e2a46"), ("grip.md", "")]
)
def test_an_interval_in_prose_stands_in_a_table(page: str, until: str) -> None:
    text = (DOCS / page).read_text(encoding="utf-8")
    prose, rows = prose_and_tables(text.partition(until)[0] if until else text)
    lost = [
        (low, high)
        for low, high in prose
        if not any(
            abs(float(low) - a) <= 0.51 * 10.0 ** -digits(low)
            and abs(float(high) - b) <= 0.51 * 10.0 ** -digits(high)
            for a, b in rows
        )
    ]
    assert lost == []


def test_an_interval_that_moved_is_found() -> None:
    prose, rows = prose_and_tables("| a | +0.7 (95 % 0.137 to 1.34) |\nwhat [0.14, 1.34], [0.6, 1]")
    assert prose == [("0.14", "1.34"), ("0.6", "1")]
    assert rows == [(0.137, 1.34)]
