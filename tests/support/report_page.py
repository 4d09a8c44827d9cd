"""A page of the report with one of each block, and how pages are read."""

from __future__ import annotations

from pathlib import Path

from skidpad.report.elements.page import (
    Answer,
    Answers,
    Card,
    Cards,
    Cell,
    Definitions,
    Number,
    Numbers,
    Page,
    Section,
    Table,
    Text,
    Verdict,
)

REPLAY = {
    "dt": 0.1,
    "unit": 0.01,
    "t0": 3.0,
    "mark": 1,
    "ego": 0,
    "lanes": [[0, 0, 1000, 0]],
    "size": [[4.5, 1.8]],
    "frames": [[0, 0, 0], [100, 0, 0]],
}


def read_page(path: Path) -> str:
    """Returns a page's HTML with plain spaces, also between numbers and units."""
    return path.read_text(encoding="utf-8").replace("\u00a0", " ")


def page():
    return Page(
        title="A <title> & more",
        subtitle="what it is",
        facts=[("seed", "1")],
        sections=[
            Section(
                "First",
                [
                    Answers([Answer("Is it safe?", "No.")]),
                    Text("one\n\ntwo"),
                    Numbers([Number("3", "runs", "of 3")]),
                ],
            ),
            Section(
                "Tables",
                [
                    Table(
                        [("row", ""), ("count", "how many")],
                        [[Cell("a"), Cell("10", sort=10, note="[4, 18]", heat=0.5)]],
                        caption="A table",
                    ),
                    Verdict("F-01", "claim", "supported", "These runs show it.", "+3, p = 0.01"),
                    Cards("crashes", [Card("one", replay=REPLAY, chain=["</script><b>"])]),
                    Definitions([("min_ttc_s", "s", "least time to collision")]),
                ],
            ),
        ],
    )
