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


def node_evidence(table: pl.DataFrame, statement: Statement) -> list[NodeEvidence]:
    """Evidence for a statement from the indicator table of a drive."""
    out = []
    for indicator in statement.indicators:
        rows = table.filter(pl.col("indicator") == indicator.value)
        for (subject,), group in rows.group_by("subject", maintain_order=True):
            values = group["value"].drop_nulls()
            out.append(
                NodeEvidence(
                    indicator,
                    str(subject),
                    float(values[-1]) if len(values) else None,
                    values.min() if len(values) else None,  # type: ignore[arg-type]
                    values.max() if len(values) else None,  # type: ignore[arg-type]
                    len(values),
                    int(group["violated"].sum()),
                    len(group),
                )
            )
    return out


def evidence_lines(table: pl.DataFrame) -> Iterator[str]:
    """The tree as text."""
    case = safety_case()
    yield case.goal
    for argument in case.arguments:
        yield f"  {argument.claim}"
        for statement in argument.statements:
            nodes = node_evidence(table, statement)
            against = sum(n.violated for n in nodes)
            known = sum(n.evaluated for n in nodes)
            verdict = "no evidence" if not known else "supported" if not against else "challenged"
            yield f"    {statement.id} {statement.claim}: {verdict}"
            for n in nodes:
                yield f"       {_line(n)}"


def _line(n: NodeEvidence) -> str:
    if n.now is None:
        return f"{n.indicator.value} ({n.subject}): never evaluated in {n.cycles} cycles"
    share = 100.0 * n.violated / n.evaluated
    return (
        f"{n.indicator.value} ({n.subject}): now {n.now:.3f}, from {n.least:.3f} to "
        f"{n.greatest:.3f}; violated in {n.violated} of {n.evaluated} cycles ({share:.1f} %), "
        f"not evaluated in {n.cycles - n.evaluated}"
    )
