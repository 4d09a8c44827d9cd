"""The table of docs/search.md is that of its rows, and its prose says no more than they do."""

import csv
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))
from probability_coverage import page_table  # noqa: E402

ROWS = ROOT / "docs" / "results" / "probability" / "coverage.csv"
PAGE = (ROOT / "docs" / "search.md").read_text(encoding="utf-8")


def test_the_page_shows_the_rows():
    table = PAGE.split("<!-- table: coverage -->\n")[1].split("\n<!-- end -->")[0]
    assert table == page_table(ROWS)


def test_the_printed_interval_holds_as_often_as_the_prose_says():
    with ROWS.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert all(int(r["repetitions"]) == 5000 for r in rows)
    plain = [r for r in rows if "half-space" in r["limit"]]
    assert len(plain) == 8
    assert all(float(r["joint"]) >= 0.99 for r in plain)
    weak = [r for r in rows if "outside" in r["limit"] and float(r["joint"]) < 0.93]
    assert all(float(r["p"]) < 1e-6 for r in weak)
    assert all(float(r["determined"]) < 0.05 for r in weak)
