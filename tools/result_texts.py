"""How numbers and verdicts of committed results are written in pages."""

from __future__ import annotations

from collections.abc import Sequence

from skidpad.evidence.statistics import Interval
from skidpad.evidence.verdicts import Judgement
from skidpad.report.elements.verdicts import plain


def markdown(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def limits(interval: Interval | None) -> str:
    """Limits in brackets."""
    return "no limits" if interval is None else f"[{bound(interval.low)}, {bound(interval.high)}]"


def bound(value: float) -> str:
    """Two decimals; of a smaller value two digits, so that it is not shown as zero."""
    if abs(value) < 1e-9:
        return "0.00"
    return f"{value:.2f}" if abs(value) >= 0.01 else f"{value:.2g}"


def verdict_rows(judged: Sequence[Judgement]) -> str:
    """One row per claim: verdict, a plain sentence, the numbers."""
    rows = [
        [j.finding.id, j.finding.claim, j.verdict.value, plain(j), j.text.replace("|", "\\|")]
        for j in judged
    ]
    return markdown(("id", "claim", "verdict", "in a sentence", "numbers"), rows)
