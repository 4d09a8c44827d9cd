"""Natural and risky drivers side by side, and precision against recall (C-105, C-2)."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

from skidpad.evidence.channels.judging.reference import NAME as REFERENCE
from skidpad.report.channels.evaluation.scores import (
    FEW,
    HAZARDS,
    Row,
    count,
    headline,
    ratio,
    ratio_text,
)
from skidpad.report.elements.figures import Chart, Curve, curves
from skidpad.report.elements.page import Block, Cell, Figure, Text, words
from skidpad.report.elements.tables import Column, table

STAR = {"marker": "*", "ms": 12, "ls": "none"}
STYLES = ({"marker": ".", "ms": 4}, {"marker": ".", "ms": 4, "ls": "--"})  # the reference is dashed
SHARE = (-0.03, 1.03)  # of axes
STRATA = {
    "natural": "Natural drivers",
    "risky": "Risky drivers",
}
EXPLAINED = """Among natural drivers nothing is staged, and hazards are as frequent as this traffic \
makes them: it follows less closely than drivers on roads do, so tailgating is rarer. How often an alarm is \
right and how often it is false is read there. \
Among risky ones the least tenth of published headways and cut-in gaps \
makes up half of all draws, and positions of channels jump twenty times as often, so that there is enough to \
miss; each true hazard then counts with its driver's or the jump's weight (importance sampling), which gives \
the recall that natural drivers would show (but for the time in which a position is off, 3 to 7 % per \
channel, which colours the others a little). Of risky drivers neither precision nor false alarms are quoted, \
and the two are never added up. The effective size says how many equally weighted hazards say as much; under \
100 it is too few for a verdict."""


def strata(evaluation: Row) -> list[Block]:
    """Returns the table of recall in both strata; a note where no risky drivers were driven among."""
    parts = evaluation.get("strata", {})
    if "risky" not in parts:
        return [
            Text("Only natural drivers were driven among (`--strata natural,risky`).", tone="note")
        ]
    rows = [
        {"stratum": stratum, "identifier": result["rules"], "hazard": hazard, **row}
        for stratum, part in parts.items()
        for result in headline(part)
        if result["truth"] == "sim"
        for hazard, row in result["hazards"].items()
        if row["tp"] + row["fn"]
    ]
    caption = "What is found of the simulator's hazards, by stratum"
    return [Text(EXPLAINED), table(_columns(), rows, caption)]


def _columns() -> list[Column[Row]]:
    """Returns the columns of the table of driver groups, identifiers and hazards."""
    return [
        Column("drivers", lambda r: STRATA[r["stratum"]]),
        Column("identifier", lambda r: words(r["identifier"])),
        Column("hazard", lambda r: words(r["hazard"])),
        Column("true", lambda r: float(r["tp"] + r["fn"])),
        Column("found", partial(count, "tp")),
        Column(
            "recall", partial(ratio, "recall_weighted"),
            "weighted among risky drivers; 95 % interval below", "%",
        ),
        Column("effective size", _size, "of the true hazards with their weights"),
    ]  # fmt: skip


def _size(row: Row) -> Cell:
    """Returns a cell with the effective number of true hazards, noted where it is below FEW."""
    few = row["effective_size"] < FEW
    return Cell(
        f"{row['effective_size']:.0f}", row["effective_size"], note="too few" if few else ""
    )


def precision_recall(evaluation: Row) -> list[Block]:
    """Returns a chart per stratum of each identifier over its limits; a note without simulator truth."""
    parts = evaluation.get("strata", {}) or {"natural": evaluation}
    out: list[Block] = []
    for stratum, part in parts.items():
        drawn = part.get("precision_recall", {}).get("sim")
        if not drawn:
            continue
        text = (
            f"{STRATA[stratum]}, {part['hours']:.2f} h, simulator truth: precision against recall while "
            f"each identifier's limit varies; the reference with hindsight is dashed, the star is where "
            "its limits are the truth's"
        )
        weighted = ", recall weighted" if stratum == "risky" else ""
        out.append(Figure(_chart(part, drawn), f"{text}{weighted}."))
    return out or [Text("Not shown: it needs recordings with the true world.", tone="note")]


def _chart(part: Row, drawn: Row) -> str:
    """Returns an SVG with axes of precision against recall per hazard, a line per identifier."""
    names = list(drawn)
    charts = []
    for hazard in HAZARDS:
        lines = [
            Curve(
                words(name), *_line(drawn[name][hazard]), colour=k, style=STYLES[name == REFERENCE]
            )
            for k, name in enumerate(names)
            if hazard in drawn[name]
        ]
        lines += [
            Curve("reference, the truth's limits", [r], [p], colour=len(names), style=STAR)
            for r, p in _at_truths_limits(part, hazard)
        ]
        charts.append(
            Chart(lines, "recall", "precision", words(hazard), y_range=SHARE, x_range=SHARE)
        )
    return curves(charts, width=11.0, height=3.6)


def _line(points: list[list[float]]) -> tuple[list[float], list[float]]:
    """Returns recall and precision at each limit at which something was found and true.

    points: limit, tp, fp, fn, weighted found, weighted true.
    """
    known = [
        (found / true, tp / (tp + fp)) for _, tp, fp, _, found, true in points if tp + fp and true
    ]
    return [r for r, _ in known], [p for _, p in known]


def _at_truths_limits(part: Row, hazard: str) -> Iterator[tuple[float, float]]:
    """Yields (weighted recall, precision) of the reference rules against "sim", if both are known."""
    for result in headline(part):
        if (result["rules"], result["truth"]) == (REFERENCE, "sim"):
            row: Any = result["hazards"][hazard]
            known = row["recall_weighted"] is not None and row["precision"] is not None
            yield from [(row["recall_weighted"], row["precision"])] * known


def headline_of_risky(evaluation: Row) -> str:
    """Returns a sentence on the recall of the tracked rules among risky drivers; "" without them."""
    part = evaluation.get("strata", {}).get("risky")
    if part is None:
        return ""
    said = [
        f"{words(h)} {ratio_text(row['recall_weighted'])} % of {row['tp'] + row['fn']}"
        for result in headline(part)
        if (result["rules"], result["truth"]) == ("tracked", "sim")
        for h, row in result["hazards"].items()
    ]
    return (
        f"Among risky drivers the tracked rules find: {', '.join(said)} (weighted)." if said else ""
    )
