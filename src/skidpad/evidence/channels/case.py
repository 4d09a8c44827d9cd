"""The safety case with current and historical evidence per node (C-033, C-034, C-106)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import polars as pl

from skidpad.evidence.channels.indicators.catalogue import Indicator, Statement, safety_case


@dataclass(frozen=True, slots=True)
class NodeEvidence:
    """What one indicator of one channel or pair says for its claim."""

    indicator: Indicator
    subject: str
    now: float | None  # its newest value, None: never evaluated
    least: float | None
    greatest: float | None
    evaluated: int  # cycles
    violated: int
    cycles: int


Nodes = dict[str, list[NodeEvidence]]  # by indicator, in the order of the table


def evidence_of(table: pl.DataFrame) -> Nodes:
    """Returns by built-in indicator the evidence of each subject in a drive's table of indicators.

    An indicator without rows has an empty list; those that packages added are left out.
    """
    value = pl.col("value").drop_nulls()
    summed = table.group_by("indicator", "subject", maintain_order=True).agg(
        now=value.last(),
        least=value.min(),
        greatest=value.max(),
        evaluated=value.len(),
        violated=pl.col("violated").sum(),
        cycles=pl.len(),
    )
    found: Nodes = {indicator.value: [] for indicator in Indicator}
    for row in summed.iter_rows(named=True):
        name, subject = row.pop("indicator"), str(row.pop("subject"))
        if name in found:
            found[name].append(NodeEvidence(Indicator(name), subject, **row))
    return found


def node_evidence(nodes: Nodes, statement: Statement) -> list[NodeEvidence]:
    """Returns the evidence of all indicators that support a statement."""
    return [n for indicator in statement.indicators for n in nodes[indicator.value]]


def evidence_lines(table: pl.DataFrame) -> Iterator[str]:
    """Yields the safety case as indented lines: claims, verdicts of statements, and their evidence.

    A statement is supported without a violated cycle, else challenged; no evidence: never evaluated.
    """
    case, everything = safety_case(), evidence_of(table)
    yield case.goal
    for argument in case.arguments:
        yield f"  {argument.claim}"
        for statement in argument.statements:
            nodes = node_evidence(everything, statement)
            against = sum(n.violated for n in nodes)
            known = sum(n.evaluated for n in nodes)
            verdict = "no evidence" if not known else "supported" if not against else "challenged"
            yield f"    {statement.id} {statement.claim}: {verdict}"
            for n in nodes:
                yield f"       {_line(n)}"


def _line(n: NodeEvidence) -> str:
    """Returns a line of text on a node's evidence: value now, range and violated cycles."""
    if n.now is None:
        return f"{n.indicator.value} ({n.subject}): never evaluated in {n.cycles} cycles"
    share = 100.0 * n.violated / n.evaluated
    return (
        f"{n.indicator.value} ({n.subject}): now {n.now:.3f}, from {n.least:.3f} to "
        f"{n.greatest:.3f}; violated in {n.violated} of {n.evaluated} cycles ({share:.1f} %), "
        f"not evaluated in {n.cycles - n.evaluated}"
    )
