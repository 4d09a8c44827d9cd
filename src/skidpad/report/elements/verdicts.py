"""Judged findings as blocks of a page; every report shows them alike."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from skidpad.core.text.wording import count_text
from skidpad.evidence.statistics import seeds_for_verdict
from skidpad.evidence.verdicts import Judgement
from skidpad.evidence.verdicts import Verdict as Outcome
from skidpad.report.elements.page import Verdict

TALLIED = {Outcome.BY_CONSTRUCTION: "not measured (both sides are the same drive)"}


def verdict_blocks(judged: Iterable[Judgement]) -> list[Verdict]:
    """Returns one block per finding: claim, verdict, a plain sentence, numbers, and how it was judged."""
    return [
        Verdict(
            j.finding.id,
            j.finding.claim,
            j.verdict.value,
            plain(j),
            j.text,
            f"{j.finding.nature} {j.finding.estimand}; test: {j.finding.test}; "
            f"margin: {j.finding.margin}.",
        )
        for j in judged
    ]


def plain(j: Judgement) -> str:
    """Returns a sentence on what the runs say about a claim, without numbers of statistics."""
    match j.verdict:
        case Outcome.SUPPORTED if j.is_counted:
            return "Every case of these runs shows it; more runs may bring one that does not."
        case Outcome.CONTRADICTED if j.is_counted:
            return "These runs have a case that breaks it, and one is enough."
        case Outcome.SUPPORTED:
            return "These runs show it, beyond what chance explains."
        case Outcome.CONTRADICTED:
            small = any(c.small and c.margin for c in j.contrasts)
            return (
                "These runs show too small a difference to matter."
                if small
                else "These runs show the opposite, beyond what chance explains."
            )
        case Outcome.UNDECIDED:
            more = f"about {count_text(j.seeds_needed, 'seed')}" if j.seeds_needed else "more seeds"
            return f"These runs cannot tell; it would take {more}."
        case Outcome.BY_CONSTRUCTION:
            return "Both sides are the same drive: there is nothing to measure."
        case Outcome.SAME_DRIVES:
            return "What differs never came into play: both sides are the same drives."
        case Outcome.NOT_TESTABLE:
            return f"These runs cannot test it; it needs {j.finding.needs}."
        case Outcome.REFUSED:
            return j.text


def tally_text(judged: Sequence[Judgement]) -> str:
    """Returns a sentence on how many claims got which verdict; judged: at least one."""
    counts = Counter(j.verdict for j in judged)
    told = ", ".join(f"{counts[v]} {TALLIED.get(v, v.value)}" for v in Outcome if counts[v])
    if len(judged) == 1:
        return f"The published study's one claim is {told.removeprefix('1 ')}."
    return f"Of {len(judged)} claims of the published study: {told}."


def unjudged_text(judged: Sequence[Judgement]) -> str:
    """Returns the sentence that stands in place of verdicts where there is one seed per cell."""
    least = seeds_for_verdict(len(judged))
    return (
        f"One seed per cell judges none of the published study's {count_text(len(judged), 'claim')}: what "
        f"differs may be chance. With {least} seeds (`--seeds {least}`) they can be judged."
    )


def least_seeds_text(judged: Sequence[Judgement]) -> str:
    """Returns a sentence on the seeds that any verdict of this report takes; "" where none is tested."""
    tested = sum(j.p is not None for j in judged)
    if not tested:
        return ""
    least = seeds_for_verdict(tested)
    return (
        f" With {count_text(tested, 'claim')} tested at once, a paired comparison takes at least "
        f"{least} seeds per cell to decide one."
    )


def seeds_text(seeds: int) -> str:
    """Returns a sentence on how far verdicts can be trusted with so many seeds per cell."""
    if seeds == 1:
        return (
            "One seed per cell: what differs between two cells may be chance; no verdict can rest "
            "on it."
        )
    return f"{seeds} seeds per cell, the same in all cells."
