"""Writes the table of docs/benchmarks.md and its plot from docs/benchmarks.csv: part of `make tables`.

A new measurement is a new row of the CSV; the page shows the newest of each measure, the plot those
that were measured more than once on one machine.
"""

from __future__ import annotations

import csv
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "benchmarks.md"
HISTORY = ROOT / "docs" / "benchmarks.csv"
PLOT = ROOT / "docs" / "img" / "benchmarks.svg"
BLOCK = re.compile(r"(<!-- benchmarks: begin -->\n).*?(<!-- benchmarks: end -->)", re.DOTALL)
MORE_IS_BETTER = "x real time"

Row = dict[str, str]


def read_history(path: Path = HISTORY) -> list[Row]:
    """Return the measurements in the order of the file."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def newest(rows: list[Row]) -> list[Row]:
    """Return the last row of each measure, in the order in which measures first appear."""
    found: dict[str, Row] = {}
    for row in rows:
        if row["measure"] not in found or found[row["measure"]]["date"] <= row["date"]:
            found[row["measure"]] = row
    return list(found.values())


def is_met(row: Row) -> bool | None:
    """Return whether what was asked is met; None where nothing was asked."""
    if not row["asked"]:
        return None
    value, asked = float(row["value"]), float(row["asked"])
    return value >= asked if row["unit"] == MORE_IS_BETTER else value <= asked


def table(rows: list[Row]) -> str:
    """Return the table of the newest measurements."""
    lines = ["| | measured | asked | when and where | by |", "|---|---|---|---|---|"]
    group = ""
    for row in newest(rows):
        if row["group"] != group:
            group = row["group"]
            lines.append(f"| **{group}** | | | | |")
        missed = "" if is_met(row) is not False else ": missed"
        asked = f"{row['asked']}{missed}" if row["asked"] else ""
        where = f"{row['date']}, {row['commit']}, {row['machine']}"
        lines.append(
            f"| {row['measure']} | {row['value']} {row['unit']} | {asked} | {where} | {row['command']} |"
        )
    return "\n".join(lines) + "\n"


def page_with(text: str, rows: list[Row]) -> str:
    """Return the page with its table written anew."""
    return BLOCK.sub(lambda found: found[1] + table(rows) + found[2], text)


def draw(rows: list[Row], path: Path = PLOT) -> None:
    """Draw every measure with two or more points on one machine: each as a share of its first one."""
    import matplotlib as mpl

    mpl.use("svg")
    mpl.rcParams["svg.hashsalt"] = "skidpad"
    import matplotlib.pyplot as plt

    by: dict[str, list[Row]] = {}
    for row in rows:
        if row["unit"] not in ("ratio", MORE_IS_BETTER):
            by.setdefault(f"{row['measure']} ({row['machine']})", []).append(row)
    figure, axes = plt.subplots(figsize=(7.0, 4.2), layout="constrained")
    repeated = {measure: points for measure, points in by.items() if len(points) > 1}
    for measure, points in repeated.items():
        shares = [float(p["value"]) / float(points[0]["value"]) for p in points]
        axes.plot(range(len(points)), shares, marker="o", label=measure)
    axes.set_xlabel("measurement, in order of date")
    axes.set_ylabel("processor time, share of the first")
    axes.set_ylim(0.0, None)
    axes.set_xticks(range(max(len(p) for p in repeated.values())))
    axes.legend(fontsize=8, loc="lower left")
    figure.savefig(path, metadata={"Date": None})
    plt.close(figure)


def main() -> int:
    """Write table and plot."""
    rows = read_history()
    PAGE.write_text(page_with(PAGE.read_text(encoding="utf-8"), rows), encoding="utf-8")
    draw(rows)
    return 0


if __name__ == "__main__":
    sys.exit(main())
