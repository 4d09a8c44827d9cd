"""The page of benchmarks shows the newest row of each measure, and says what was missed."""

from __future__ import annotations

import re
from datetime import date

import pytest

import benchmarks_page as page

ROWS = page.read_history()


def test_the_page_is_what_its_history_makes() -> None:
    text = page.PAGE.read_text(encoding="utf-8")
    assert page.BLOCK.search(text)
    assert page.page_with(text, ROWS) == text, "run make tables"


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row['measure']}, {row['commit']}")
def test_a_measurement_says_when_where_and_how(row: page.Row) -> None:
    assert float(row["value"]) > 0.0
    assert not row["asked"] or float(row["asked"]) > 0.0
    assert date.fromisoformat(row["date"]) >= date(2026, 11, 1)
    assert re.fullmatch(r"[0-9a-f]{7,8}", row["commit"])
    assert all(row[key] for key in ("group", "measure", "unit", "machine", "command"))


def test_the_newest_counts_and_missed_is_said() -> None:
    def row(value: str, day: str, unit: str = "ms") -> page.Row:
        return {
            "group": "g", "measure": f"m {unit}", "value": value, "unit": unit, "asked": "2",
            "date": day, "commit": "c", "machine": "here", "command": "it",
        }  # fmt: skip

    rows = [row("3", "2026-11-02"), row("1", "2026-11-01"), row("1", "2026-11-01", "x real time")]
    assert [r["value"] for r in page.newest(rows)] == ["3", "1"]
    assert page.is_met(rows[0]) is False
    assert page.is_met(rows[1]) is True
    assert page.is_met(rows[2]) is False
    assert page.table(rows).count("missed") == 2
