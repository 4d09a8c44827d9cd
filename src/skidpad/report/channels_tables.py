"""Tables and trees of the report of a monitored drive."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import polars as pl

from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.case import NodeEvidence, node_evidence
from skidpad.evidence.channels.indicators.catalogue import (
    Argument,
    Indicator,
    Statement,
    safety_case,
)
from skidpad.evidence.channels.timing import timing_statistics
from skidpad.recording.hazards import HazardRecord
from skidpad.report.channels_data import MonitoredDrive
from skidpad.report.page import Block, Cell, Node, Table, Text, Tree
from skidpad.report.published import Source, published

CHALLENGED, SUPPORTED, SILENT = "challenged", "supported", "no evidence"
PUBLISHED_MODULES = {
    "total": "spi_and_hsi_total",
    "comfort": "comfort",
    "similarity": "similarity",
    "motion_prediction": "motion_prediction",
}


def hazard_list(records: Sequence[HazardRecord], names: Mapping[HazardType, str]) -> Table:
    """One row per record."""
    rows = [
        [
            Cell(r.id),
            Cell(names[r.type]),
            Cell(f"{r.t_start:.1f}", r.t_start),
            Cell(f"{r.t_end - r.t_start:.1f}", r.t_end - r.t_start),
            Cell(f"{r.count}", float(r.count)),
            Cell(_number(r.extremes.get("safety_score")), r.extremes.get("safety_score")),
            Cell(", ".join(r.involved)),
            Cell(", ".join(r.flags), kind="muted"),
        ]
        for r in records
    ]
    return Table(
        [
            ("record", "as in hazards.txt"),
            ("hazard", ""),
            ("start, s", ""),
            ("length, s", "first to last cycle in which it was found"),
            ("cycles", "in which it was found"),
            ("safety score", "when it was worst"),
            ("channels", "that stand behind it"),
            ("flags", "assumed: no objects were paired; cut: the record ends early"),
        ],
        rows,
        caption="All hazards",
    )


def safety_case_tree(drive: MonitoredDrive) -> Tree:
    """Goal, arguments, statements and indicators with evidence now and over the drive (C-033)."""
    case = safety_case()
    arguments = [_argument(drive, a) for a in case.arguments]
    root = Node(case.goal, _worst([a.state for a in arguments]), children=arguments)
    return Tree(root)


def _argument(drive: MonitoredDrive, argument: Argument) -> Node:
    statements = [_statement(drive, s) for s in argument.statements]
    return Node(argument.claim, _worst([s.state for s in statements]), children=statements)


def _statement(drive: MonitoredDrive, statement: Statement) -> Node:
    evidence = node_evidence(drive.table, statement)
    known, against = sum(n.evaluated for n in evidence), sum(n.violated for n in evidence)
    state = SILENT if not known else CHALLENGED if against else SUPPORTED
    text = f"violated in {against} of {known} evaluated values" if known else ""
    lines = [evidence_line(n) for n in evidence]
    return Node(f"{statement.id} {statement.claim}", state, text, lines, open=state == CHALLENGED)


def evidence_line(n: NodeEvidence) -> str:
    """Now and so far, of one indicator."""
    name = f"{words(n.indicator.value)} ({n.subject})"
    if n.now is None or n.least is None or n.greatest is None:
        return f"{name}: never evaluated in {n.cycles} cycles"
    return (
        f"{name}: at the end {n.now:.2f}, over the drive {n.least:.2f} to {n.greatest:.2f}; violated "
        f"in {n.violated} of {n.evaluated} cycles, not evaluated in {n.cycles - n.evaluated}"
    )


def _worst(states: Sequence[str]) -> str:
    return next((s for s in (CHALLENGED, SUPPORTED) if s in states), SILENT)


def words(name: str) -> str:
    """A name as it is read."""
    return name.replace("_", " ")


def indicators(drive: MonitoredDrive) -> list[Block]:
    """Every indicator and subject: claim, threshold, violations and gaps (decision C-17)."""
    said = _published_violations()
    values = _statistics(drive.table)
    rows = []
    for row in drive.summary["indicators"]:
        entry = drive.thresholds[Indicator(row["indicator"])]
        mean, least = values.get((row["indicator"], row["subject"]), (None, None))
        cycles, events = drive.summary["cycles"], row["violation_events"]
        rows.append(
            [
                Cell(words(row["indicator"]), hint=entry.meaning),
                Cell(row["subject"]),
                Cell(row["claim"] or "", kind="muted"),
                Cell(_number(row["threshold"]), row["threshold"]),
                Cell(_number(mean), mean),
                Cell(_number(least), least),
                Cell(
                    f"{events}",
                    float(events),
                    kind="bad" if events else "muted",
                    heat=min(1.0, row["violation_cycles"] / max(cycles, 1)),
                ),
                Cell(f"{row['violation_cycles']}", float(row["violation_cycles"])),
                Cell(f"{row['not_evaluated_cycles']}", float(row["not_evaluated_cycles"])),
                Cell(said.get(row["indicator"], ""), kind="published"),
            ]
        )
    table = Table(
        [
            ("indicator", "hover for what a violation points at"),
            ("of", "channel, or pair of channels"),
            ("claim", "statement of the safety case"),
            ("threshold", "alarm beyond it; equality passes"),
            ("mean", "of evaluated cycles"),
            ("least", ""),
            ("violations", "events: repeats within 2 s count once"),
            ("cycles violated", ""),
            ("cycles not evaluated", ""),
            ("published", "violations in 8 h over six towns, sums of towns"),
        ],
        rows,
        caption="Indicators",
        note="Published counts are of another simulator, other channels and 8 h of driving.",
    )
    return [table]


def _statistics(table: pl.DataFrame) -> dict[tuple[str, str], tuple[float | None, float | None]]:
    rows = table.group_by("indicator", "subject").agg(
        pl.col("value").mean().alias("mean"), pl.col("value").min().alias("least")
    )
    return {(i, s): (mean, least) for i, s, mean, least in rows.iter_rows()}


def _published_violations() -> dict[str, str]:
    table = published(Source.VIOLATIONS)
    return {spi: f"{n}" for spi, n in table.select("spi", "violations_sum_of_towns").iter_rows()}


def timing(drive: MonitoredDrive) -> list[Block]:
    """The table of C-233 with the published means beside ours."""
    if drive.timing is None:
        return [
            Text("Not measured: `skidpad monitor --timing` measures every module.", tone="note")
        ]
    said = published(Source.TIMING).filter(pl.col("statistic") == "mean_ms")
    rows = []
    for row in timing_statistics(drive.timing).iter_rows(named=True):
        theirs = said.filter(pl.col("module") == PUBLISHED_MODULES.get(row["module"], ""))["value"]
        known = sorted(theirs.to_list())
        text = f"{known[0]:.2f} to {known[-1]:.2f}" if known else ""
        numbers = [row[c] for c in TIMING_COLUMNS]
        rows.append(
            [
                Cell(words(row["module"])),
                *[Cell(f"{v:.3f}", v) for v in numbers[:5]],
                *[Cell(f"{v:.2f}", v) for v in numbers[5:]],
                Cell(text, kind="published"),
            ]
        )
    return [
        Table(
            [
                ("module", ""),
                ("mean, ms", ""),
                ("greatest, ms", ""),
                ("least, ms", ""),
                ("deviation, ms", ""),
                ("99.9 %, ms", ""),
                ("breaches, %", "cycles above the threshold: 25 ms; of a module its own maximum"),
                ("within 90 %, %", "cycles from 0.9 of the threshold to the threshold"),
                ("under 50 %, %", "cycles below half the threshold"),
                ("published mean, ms", "least and greatest of six towns, four Cortex-A53"),
            ],
            rows,
            caption="Processor time per cycle",
            note="The total has a budget of 25 ms. Ours is the time of one thread on this machine; the "
            "published times come from an automotive processor and do not compare.",
        )
    ]


TIMING_COLUMNS = (
    "mean_ms", "max_ms", "min_ms", "std_ms", "p999_ms", "breaches_pct", "within_90_pct",
    "under_50_pct",
)  # fmt: skip


def losses(drive: MonitoredDrive) -> list[Block]:
    """What was lost while reading or could not be evaluated."""
    rows = [
        [Cell(words(kind)), Cell(channel), Cell(f"{n}", float(n))]
        for group in (drive.summary["unusable"], {"lost while reading": drive.summary["losses"]})
        for kind, table in group.items()
        for channel, n in table.items()
        if n and not isinstance(n, dict)
    ]
    rows += [
        [Cell("objects seen for a moment by one channel"), Cell(channel), Cell(f"{n}", float(n))]
        for channel, n in drive.summary["brief_objects"].items()
    ]
    rows += [
        [Cell(f"rule of {words(hazard)} undecided"), Cell("all"), Cell(f"{n}", float(n))]
        for hazard, n in drive.summary["undecided_cycles"].items()
    ]
    if not rows:
        return [Text("Everything in the recording could be read and evaluated.")]
    return [
        Table(
            [("what", ""), ("channel or kind", ""), ("count", "cycles, objects or messages")],
            rows,
            note="Objects that one channel shows for a moment hint at ghosts.",
        )
    ]


def _number(value: float | None) -> str:
    return "" if value is None else f"{value:.2f}"
