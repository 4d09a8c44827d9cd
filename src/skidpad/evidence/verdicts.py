"""Findings as data: a claim, what would show it, and a verdict computed from results (X-7).

A finding is written before its results are seen; the rule that margins come before significance was
settled after those of the friction campaign, and reports say so. A finding consists of contrasts:
differences that the claim says are positive. It is supported when all of them are shown, contradicted
when one is shown to be reversed or smaller than its margin, and otherwise undecided, with the seeds
that it would take.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from math import ceil

import polars as pl

from skidpad.core.text.wording import count_text
from skidpad.evidence.contrasts import Contrast, Criterion, drop_unfinished
from skidpad.evidence.statistics import EVER_SIGNIFICANT, holm
from skidpad.evidence.statistics_text import interval_text, p_text

ALPHA = 0.05


class Verdict(str, Enum):
    """What the results say about a claim."""

    SUPPORTED = "supported"
    CONTRADICTED = "contradicted"
    UNDECIDED = "undecided"
    BY_CONSTRUCTION = "by construction"  # the two sides must be the same drive
    SAME_DRIVES = "same drives"  # what differs never came into play: nothing was measured
    NOT_TESTABLE = "not testable"  # the runs that it needs are not there
    REFUSED = "refused"  # the runs are there, but nothing can be said of them


@dataclass(frozen=True, slots=True)
class Finding:
    """One claim of the sources and how it is judged."""

    id: str
    claim: str
    estimand: str
    needs: str  # which runs
    criteria: tuple[Criterion, ...]  # all must be shown
    study: bool = False  # needs runs of its own (`skidpad study ID`)
    built_in: str = ""  # what in the simulation brings the effect about; empty: it emerges

    @property
    def test(self) -> str:
        """Returns the names of the tests that judge the finding."""
        return "; ".join(dict.fromkeys(phrase for c in self.criteria for phrase in c.test))

    @property
    def margin(self) -> str:
        """Returns the amounts below which a difference does not matter, in words; "none" without any."""
        amounts = dict.fromkeys(a for c in self.criteria for a in c.amounts if a.value)
        return ", ".join(map(str, amounts)) or "none"

    @property
    def nature(self) -> str:
        """Returns in words whether the simulation is built so or the effect emerges."""
        return f"By construction: {self.built_in}." if self.built_in else "Emergent."

    def contrasts(self, table: pl.DataFrame) -> list[Contrast]:
        """Returns one contrast per criterion, or none at all: a claim is judged whole."""
        drawn = [c for criterion in self.criteria if (c := criterion.draw(drop_unfinished(table)))]
        return drawn if len(drawn) == len(self.criteria) else []


@dataclass(frozen=True, slots=True)
class Judgement:
    """A finding with its verdict and numbers."""

    finding: Finding
    verdict: Verdict
    p: float | None  # the smaller of both sides, Holm-adjusted within the report
    contrasts: tuple[Contrast, ...]
    seeds_needed: int | None
    text: str

    @property
    def is_counted(self) -> bool:
        """Returns whether single cases decide the claim, so that nothing is said of chance."""
        return any(contrast.words for contrast in self.contrasts)


def judge(
    findings: Sequence[Finding], results: Sequence[pl.DataFrame | None], refused: str = ""
) -> list[Judgement]:
    """Judges a report's findings, each on its table (None: never run), Holm-adjusted together.

    refused: why these runs allow no verdict at all; empty: they do.
    """
    if refused:
        return [Judgement(f, Verdict.REFUSED, None, (), None, refused) for f in findings]
    evidence = [
        [] if table is None else finding.contrasts(table)
        for finding, table in zip(findings, results, strict=True)
    ]
    tested = [k for k, c in enumerate(evidence) if c and not all(x.identical for x in c)]
    sides = holm([p for k in tested for p in _sides(evidence[k])])
    adjusted = dict(zip(tested, zip(sides[::2], sides[1::2], strict=True), strict=True))
    seeds = [0 if t is None or "seed" not in t.columns else t["seed"].n_unique() for t in results]
    return [
        _judgement(finding, evidence[k], adjusted.get(k), seeds[k])
        for k, finding in enumerate(findings)
    ]


def _sides(contrasts: list[Contrast]) -> tuple[float, float]:
    """Returns p for and against a claim: all contrasts must show it, one suffices against it."""
    claimed = max(c.p_claimed for c in contrasts)
    return claimed, min(1.0, len(contrasts) * min(c.p_against for c in contrasts))


def _judgement(
    finding: Finding, contrasts: list[Contrast], p: tuple[float, float] | None, seeds: int
) -> Judgement:
    """Returns a finding's judgement from its contrasts; `p` are its p values, None: not tested."""
    verdict = _verdict(contrasts, p, built_in=bool(finding.built_in))
    needed = _seeds_needed(contrasts, seeds) if verdict is Verdict.UNDECIDED else None
    least = min(p) if p else None
    text = _text(finding, verdict, contrasts, least, needed)
    return Judgement(finding, verdict, least, tuple(contrasts), needed, text)


def _verdict(
    contrasts: list[Contrast], p: tuple[float, float] | None, *, built_in: bool
) -> Verdict:
    """Returns the verdict by the adjusted p for and against a claim.

    Against is judged first: a difference that is sure may still be too small to matter.
    """
    if not contrasts:
        return Verdict.NOT_TESTABLE
    if p is None:
        return Verdict.BY_CONSTRUCTION if built_in else Verdict.SAME_DRIVES
    claimed, against = p
    if against < ALPHA:
        return Verdict.CONTRADICTED
    return Verdict.SUPPORTED if claimed < ALPHA else Verdict.UNDECIDED


def _seeds_needed(contrasts: list[Contrast], seeds: int) -> int | None:
    """Returns how many seeds would decide; None where a contrast cannot tell or there are no seeds."""
    ratios = [c.units_needed / c.units if c.units_needed else None for c in contrasts]
    if not seeds or None in ratios:
        return None
    return max(seeds + 1, ceil(seeds * max(r for r in ratios if r is not None)))


def _limits(contrast: Contrast) -> str:
    """Returns a contrast's interval as text, or why it has none."""
    found = contrast.interval
    return contrast.without_limits if found is None else interval_text(found)


def _text(
    finding: Finding,
    verdict: Verdict,
    contrasts: list[Contrast],
    p: float | None,
    needed: int | None,
) -> str:
    """Returns the sentence of a verdict: numbers, p, margin missed, seeds needed."""
    if verdict is Verdict.NOT_TESTABLE:
        return f"Not testable: it needs {finding.needs}."
    if verdict is Verdict.BY_CONSTRUCTION:
        return "By construction: both sides are the same drive, so there is nothing to measure."
    if verdict is Verdict.SAME_DRIVES:
        return "Not measured: what differs never came into play, both sides are the same drives."
    parts = [c.words or f"{c.label} {c.mean:+.3g} ({_limits(c)})" for c in contrasts]
    text = f"{verdict.value.capitalize()}: {'; '.join(parts)}."
    few = min(c.units for c in contrasts)
    if verdict is Verdict.UNDECIDED and few < EVER_SIGNIFICANT:
        text += f" {count_text(few, 'unit')} cannot be tested."
    elif p is not None and not any(c.words for c in contrasts):
        text += f" {p_text(p)} after correction for all findings of this report."
    if verdict is Verdict.CONTRADICTED:
        small = [c.label for c in contrasts if c.small and c.margin]
        text += f" Smaller than the margin: {', '.join(small)}." if small else ""
    if verdict is Verdict.UNDECIDED:
        text += f" It needs about {needed} seeds." if needed else " More seeds are needed."
    return text
