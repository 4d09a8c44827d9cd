"""Judged findings as blocks of a page; every report shows them alike."""

from __future__ import annotations

from collections.abc import Iterable

from skidpad.evidence.verdicts import Judgement
from skidpad.report.page import Verdict


def verdict_blocks(judged: Iterable[Judgement]) -> list[Verdict]:
    """One block per finding: claim, verdict, numbers, and how it was judged."""
    return [
        Verdict(
            j.finding.id,
            j.finding.claim,
            j.verdict.value,
            j.text,
            f"{j.finding.nature} {j.finding.estimand}; test: {j.finding.test}; margin: {j.finding.margin}.",
        )
        for j in judged
    ]
