"""Tables and trees of the report of a monitored drive."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import polars as pl

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.case import NodeEvidence, Nodes, evidence_of, node_evidence
from skidpad.evidence.channels.indicators.catalogue import (
    Argument,
    Statement,
    safety_case,
)
from skidpad.evidence.channels.timing import timing_statistics
from skidpad.recording.hazards.records import HazardRecord
from skidpad.report.channels.data import MonitoredDrive
from skidpad.report.elements.page import Block, Cell, Node, Text, Tree, words
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.published import Source, published_rows, read_published

Row = dict[str, Any]  # of the monitor's summary
TWO_DIGITS, THREE_DIGITS = Format(".2f", absent=""), Format(".3f", absent="")
NAMES = {
    HazardType.INCONSISTENT_LOCALISATION: "Inconsistent localisation",
    HazardType.EGO_TAILGATING: "Ego tailgating",
    HazardType.EGO_TAILGATED: "Ego tailgated",
    HazardType.CROSSING_OBJECT: "Crossing object (candidate)",
    HazardType.CONFLICTING_PATHS: "Conflicting paths (candidate)",
    HazardType.STUCK_VEHICLE: "Stuck vehicle (candidate)",
    HazardType.UNSEEN_BY_A_CHANNEL: "Unseen by a channel",
}

CHALLENGED, SUPPORTED, SILENT = "challenged", "supported", "no evidence"
PUBLISHED_MODULES = {
    "total": "spi_and_hsi_total",
    "comfort": "comfort",
    "similarity": "similarity",
    "motion_prediction": "motion_prediction",
}


HAZARD_COLUMNS: tuple[Column[HazardRecord], ...] = (
    Column("record", lambda r: r.id, "as in hazards.txt"),
    Column("hazard", lambda r: NAMES[r.type]),
    Column("start", lambda r: r.t_start, unit="s", format=Format(".1f")),
    Column("length", lambda r: r.t_end - r.t_start, "first to last cycle in which it was found", "s",
           Format(".1f")),
    Column("cycles", lambda r: r.count, "in which it was found"),
    Column("safety score", lambda r: r.extremes.get("safety_score"), "when it was worst",
           format=TWO_DIGITS),
    Column("channels", lambda r: ", ".join(r.involved), "that stand behind it"),
    Column("flags", lambda r: ", ".join(r.flags),
           "assumed: no objects were paired; cut: the record ends early", kind="muted"),
)  # fmt: skip


def safety_case_tree(drive: MonitoredDrive) -> Tree:
    """Returns the tree of goal, arguments and statements with their indicators' evidence (C-033)."""
    case = safety_case()
    evidence = evidence_of(drive.table)
    arguments = [_argument(evidence, a) for a in case.arguments]
    root = Node(case.goal, _worst([a.state for a in arguments]), children=arguments)
    return Tree(root)


def _argument(nodes: Nodes, argument: Argument) -> Node:
    """Returns the tree node of an argument with its statements below it and the worst of their states."""
    statements = [_statement(nodes, s) for s in argument.statements]
    return Node(argument.claim, _worst([s.state for s in statements]), children=statements)


def _statement(nodes: Nodes, statement: Statement) -> Node:
    """Returns the node of a statement: silent without values, challenged if any of them violates."""
    evidence = node_evidence(nodes, statement)
    known, against = sum(n.evaluated for n in evidence), sum(n.violated for n in evidence)
    state = SILENT if not known else CHALLENGED if against else SUPPORTED
    text = f"violated in {against} of {known} evaluated values" if known else ""
    lines = [evidence_line(n) for n in evidence]
    return Node(f"{statement.id} {statement.claim}", state, text, lines, open=state == CHALLENGED)


def evidence_line(n: NodeEvidence) -> str:
    """Returns a line on an indicator: value at the end, range, cycles violated and not evaluated."""
    name = f"{words(n.indicator.value)} ({n.subject})"
    if n.now is None or n.least is None or n.greatest is None:
        return f"{name}: never evaluated in {n.cycles} cycles"
    return (
        f"{name}: at the end {n.now:.2f}, over the drive {n.least:.2f} to {n.greatest:.2f}; violated "
        f"in {n.violated} of {n.evaluated} cycles, not evaluated in {n.cycles - n.evaluated}"
    )


def _worst(states: Sequence[str]) -> str:
    """Returns CHALLENGED if among the states, else SUPPORTED if among them, else SILENT."""
    return next((s for s in (CHALLENGED, SUPPORTED) if s in states), SILENT)


def indicators(drive: MonitoredDrive) -> list[Block]:
    """Returns the table of every indicator and subject: claim, threshold, violations, gaps (C-17)."""
    return [
        table(
            _indicator_columns(drive),
            drive.summary["indicators"],
            "Indicators",
            "Published counts are of another simulator, other channels and 8 h of driving.",
        )
    ]


def _indicator_columns(drive: MonitoredDrive) -> tuple[Column[Row], ...]:
    """Returns the columns of the table of indicators: the drive's statistics, published violations."""
    said = published_rows(Source.VIOLATIONS, "spi")
    values = drive.table.group_by("indicator", "subject", maintain_order=True).agg(
        mean=pl.col("value").mean(), least=pl.col("value").min()
    )
    found = {(r["indicator"], r["subject"]): r for r in values.to_dicts()}
    cycles = max(drive.summary["cycles"], 1)
    meanings = {indicator.value: entry for indicator, entry in drive.thresholds.items()}

    def statistic(name: str, row: Row) -> float | None:
        return found.get((row["indicator"], row["subject"]), {}).get(name)

    def name(row: Row) -> Cell:
        entry = meanings.get(row["indicator"])  # None: of a package that is not installed
        return Cell(
            words(row["indicator"]), hint="" if entry is None else f"{entry.label}: {entry.meaning}"
        )

    def violations(row: Row) -> Quantity:
        events, share = row["violation_events"], row["violation_cycles"] / cycles
        return Quantity(value=events, kind="bad" if events else "muted", heat=min(1.0, share))

    return (
        Column("indicator", name, "hover for what a violation points at"),
        Column("of", lambda r: r["subject"], "channel, or pair of channels"),
        Column("claim", lambda r: r["claim"] or "", "statement of the safety case", kind="muted"),
        Column("threshold", lambda r: r["threshold"], "alarm beyond it; equality passes",
               format=TWO_DIGITS),
        Column("mean", partial(statistic, "mean"), "of evaluated cycles", format=TWO_DIGITS),
        Column("least", partial(statistic, "least"), format=TWO_DIGITS),
        Column("violations", violations, "events: repeats within 2 s count once"),
        Column("cycles violated", lambda r: r["violation_cycles"]),
        Column("cycles not evaluated", lambda r: r["not_evaluated_cycles"]),
        Column("published",
               lambda r: said.get(r["indicator"], {}).get("violations_sum_of_towns"),
               "violations in 8 h over six towns, sums of towns", format=Format(absent=""), kind="published"),
    )  # fmt: skip


TIMING_COLUMNS: tuple[Column[Row], ...] = (
    Column("module", lambda r: words(r["module"])),
    Column("mean", lambda r: r["mean_ms"], unit="ms", format=THREE_DIGITS),
    Column("greatest", lambda r: r["max_ms"], unit="ms", format=THREE_DIGITS),
    Column("least", lambda r: r["min_ms"], unit="ms", format=THREE_DIGITS),
    Column("deviation", lambda r: r["std_ms"], unit="ms", format=THREE_DIGITS),
    Column("99.9 %", lambda r: r["p999_ms"], unit="ms", format=THREE_DIGITS),
    Column("breaches", lambda r: r["breaches_pct"],
           "cycles above the threshold: 25 ms; of a module its own maximum", "%", TWO_DIGITS),
    Column("within 90 %", lambda r: r["within_90_pct"],
           "cycles from 0.9 of the threshold to the threshold", "%", TWO_DIGITS),
    Column("under 50 %", lambda r: r["under_50_pct"], "cycles below half the threshold", "%",
           TWO_DIGITS),
    Column("published mean", lambda r: _published_time(r["module"]),
           "least and greatest of six towns, four Cortex-A53", "ms", kind="published"),
)  # fmt: skip


def timing(drive: MonitoredDrive) -> list[Block]:
    """Returns the table of module times (C-233) beside the published; a note where not measured."""
    if drive.timing is None:
        return [
            Text("Not measured: `skidpad monitor --timing` measures every module.", tone="note")
        ]
    rows = timing_statistics(drive.timing).to_dicts()
    note = (
        "The total has a budget of 25 ms. Ours is the time of one thread on this machine; the "
        "published times come from an automotive processor and do not compare."
    )
    return [table(TIMING_COLUMNS, rows, "Processor time per cycle", note)]


def _published_time(module: str) -> str:
    """Returns the least and largest published mean time of a module in ms as text, "" if unknown."""
    name = PUBLISHED_MODULES.get(module, "")
    rows = read_published(Source.TIMING).filter(pl.col("statistic") == "mean_ms")
    known = sorted(rows.filter(pl.col("module") == name)["value"].to_list())
    return f"{known[0]:.2f} to {known[-1]:.2f}" if known else ""


LOSS_COLUMNS: tuple[Column[tuple[str, str, int]], ...] = (
    Column("what", lambda loss: loss[0]),
    Column("channel or kind", lambda loss: loss[1]),
    Column("count", lambda loss: loss[2], "cycles, objects or messages"),
)


def losses(drive: MonitoredDrive) -> list[Block]:
    """Returns the table of what was lost in reading or not evaluated; a sentence where nothing was."""
    s = drive.summary
    rows = [
        (words(kind), channel, n)
        for group in (s["unusable"], {"lost while reading": s["losses"]})
        for kind, counts in group.items()
        for channel, n in counts.items()
        if n and not isinstance(n, dict)
    ]
    rows += [
        ("objects seen for a moment by one channel", channel, n)
        for channel, n in s["brief_objects"].items()
    ]
    rows += [
        (f"rule of {words(hazard)} undecided", "all", n)
        for hazard, n in s["undecided_cycles"].items()
    ]
    if not rows:
        return [Text("Everything in the recording could be read and evaluated.")]
    note = "Objects that one channel shows for a moment hint at ghosts."
    return [table(LOSS_COLUMNS, rows, note=note)]
