"""Intervals that a results page has by hand are those of the tables that are made."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from result_tables import BLOCK

DOCS = Path(__file__).resolve().parents[2] / "docs"
NUMBER = r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
PROSE = re.compile(rf"\[({NUMBER}), ({NUMBER})\]")
CHANGED = "## What changed"  # from there on a page has numbers of older versions
TABLE = re.compile(rf"\[({NUMBER}), ({NUMBER})\]|95 % ({NUMBER}) to ({NUMBER})")


def digits(number: str) -> int:
    return len(number.partition(".")[2])


def prose_and_tables(text: str) -> tuple[list[tuple[str, str]], list[tuple[float, float]]]:
    """Intervals that were written by hand, and those of the tables that `make tables` writes."""
    made = "\n".join(match[4] for match in BLOCK.finditer(text))
    rows = [(float(a or c), float(b or d)) for a, b, c, d in TABLE.findall(made)]
    return PROSE.findall(BLOCK.sub("", text)), rows


@pytest.mark.parametrize(
    ("page", "tables"), [("matrix.md", ("matrix-tables.md",)), ("grip.md", ())]
)
def test_an_interval_in_prose_stands_in_a_table(page: str, tables: tuple[str, ...]) -> None:
    text = (DOCS / page).read_text(encoding="utf-8").partition(CHANGED)[0]
    prose, rows = prose_and_tables(text)
    for other in tables:
        rows += prose_and_tables((DOCS / other).read_text(encoding="utf-8"))[1]
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
    block = "<!-- results: grip claims -->\n| a | +0.7 (95 % 0.137 to 1.34) |\n<!-- end -->\n"
    prose, rows = prose_and_tables(f"{block}what [0.14, 1.34]\n| b | [0.6, 1] |")
    assert prose == [("0.14", "1.34"), ("0.6", "1")]
    assert rows == [(0.137, 1.34)]
