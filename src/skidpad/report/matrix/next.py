"""What should be looked at next: the commonest kind of crash, the hardest one, and the sources' claims."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import polars as pl

from skidpad.core.text.wording import capitalize_first, count_text
from skidpad.evidence.verdicts import Judgement, Verdict
from skidpad.report.crashes.cards import Found, headline, severity
from skidpad.report.elements.figures import Series, stacked_bars
from skidpad.report.elements.page import Answer, Figure
from skidpad.report.elements.verdicts import tally_text, unjudged_text
from skidpad.report.matrix.crashes import Cell
from skidpad.report.matrix.data import BASELINE, EVENT, EVENTS, Matrix, config_list, config_title

FIRST_COLOUR = 2  # of kinds: those before are weathers
DECIDED = (Verdict.CONTRADICTED, Verdict.SUPPORTED)
DECIDED_MAX = 3  # claims that the first page names
QUESTION = "What should be looked at next?"


def look_next(
    matrix: Matrix, judged: Sequence[Judgement], crashes: dict[Cell, list[Found]]
) -> Answer:
    """Returns the answer on the commonest kind of crash, the hardest one, and what is left open."""
    runs = {c: matrix.cell(c) for c in matrix.comparison_configs}
    totals = {c: int(r[EVENTS].sum()) for c, r in runs.items()}
    worst = max(totals, key=lambda c: totals[c] / max(1, len(runs[c])))
    if not totals[worst]:
        sentence = f"No configuration had a {EVENT}: drive harder conditions or more seeds."
        return Answer(QUESTION, sentence, _claims(matrix, judged))
    sentence = (
        f"{_commonest(matrix, sum(totals.values()))} {capitalize_first(config_list([worst]))} had most "
        f"{EVENTS} of all kinds ({totals[worst]} in {count_text(len(runs[worst]), 'drive')}"
        f"{_next_most(totals, runs, worst)})."
    )
    lines = [*_hardest(matrix, crashes), *_claims(matrix, judged)]
    return Answer(QUESTION, sentence, lines, _kinds_figure(matrix))


def _kinds_figure(matrix: Matrix) -> Figure:
    """Returns the figure of kinds of crashes per run, a bar per configuration and climate."""
    cells = {
        f"{config_title(c)}, {g.name}": matrix.within(c, g)
        for c in matrix.comparison_configs
        for g in matrix.climates
    }
    series = [
        Series(
            kind.title,
            [count(kind, runs) / max(1, len(runs)) for runs in cells.values()],
            colour=FIRST_COLOUR + k,
        )
        for k, kind in enumerate(kinds_of(matrix.has_grades))
    ]
    return Figure(
        stacked_bars(list(cells), series, f"{EVENTS} per run"),
        f"What the {EVENTS} were, by configuration and weather.",
    )


def _next_most(totals: dict[str, int], runs: dict[str, pl.DataFrame], worst: str) -> str:
    """Returns a clause, "; next ...", on the configuration with most events per run but `worst`.

    It gives events and runs. totals: events by configuration. "" where no other has runs.
    """
    others = [c for c in totals if c != worst and len(runs[c])]
    if not others:
        return ""
    second = max(others, key=lambda c: totals[c] / len(runs[c]))
    return f"; next {config_list([second])} with {totals[second]} in {len(runs[second])}"


def _commonest(matrix: Matrix, total: int) -> str:
    """Returns a sentence on the kind that most crashes were of, and the climate with most of these."""
    compared = [matrix.cell(c) for c in matrix.comparison_configs]
    kinds = {k: sum(count(k, r) for r in compared) for k in kinds_of(matrix.has_grades)}
    most = max(kinds, key=lambda kind: kinds[kind])
    kind = f"of the kind “{most.title}”"
    if len(matrix.climates) < 2:
        return f"{kinds[most]} of {count_text(total, EVENT, EVENTS)} were {kind}."
    within = {
        g: sum(count(most, matrix.within(c, g)) for c in matrix.comparison_configs)
        for g in matrix.climates
    }
    first, *others = sorted(within, key=lambda g: -within[g])
    rest = others[0].name if len(others) == 1 else "other weather"
    return (
        f"{kinds[most]} of {count_text(total, EVENT, EVENTS)} were {kind}: {within[first]} in "
        f"{first.name}, {kinds[most] - within[first]} in {rest}."
    )


def _claims(matrix: Matrix, judged: Sequence[Judgement]) -> list[str]:
    """Returns lines on what became of the sources' claims; DECIDED_MAX that were decided are named."""
    if matrix.seeds == 1:
        return [unjudged_text(judged)]
    decided = [j for verdict in DECIDED for j in judged if j.verdict is verdict]
    named = [
        f"{j.verdict.value.capitalize()}{_by_cases(j)}: claim {j.finding.id}, "
        f"“{j.finding.claim.rstrip('.')}”."
        for j in decided[:DECIDED_MAX]
    ]
    return [tally_text(judged), *named]


def _by_cases(judged: Judgement) -> str:
    """Returns words for a supported claim that cases decide: these runs are all that is known; else ""."""
    return (
        " by every case of these runs"
        if judged.is_counted and judged.verdict is Verdict.SUPPORTED
        else ""
    )


def _hardest(matrix: Matrix, crashes: dict[Cell, list[Found]]) -> list[str]:
    """Returns a line on the hardest crash of all compared configurations; empty without a log of one."""
    found = [(cell, items[0]) for cell, items in crashes.items() if cell[0] != BASELINE and items]
    if not found:
        return []
    (config, weather), (crash, _, _, run) = max(found, key=lambda f: severity(f[1][0]))
    group = next(g for g in matrix.weather_groups if weather in g.weathers)
    where = f"{config_list([config])} in {group.name}, run {run.name} at {crash.t:.0f} s"
    title = headline(crash)
    what = title[:1].lower() + title[1:]
    return [f"The hardest crash with a driving function: {what}, {where}. Its card stands below."]


# --- the kinds of crashes, which add up to all of them


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind: columns that are added, columns that are taken off."""

    title: str
    plus: tuple[str, ...]
    minus: tuple[str, ...] = ()
    meaning: str = ""


CONTACTS = (
    Kind("contact above 20 km/h", ("contacts_heavy",), (), "change of speed, with a road user"),
    Kind("contact of 5 to 20 km/h", ("contacts_medium",), (),
         "or slower, with a person or two wheels"),
)  # fmt: skip
# Rows without grades are older than 2026-11-25, when a touch at the side still counted as one from behind.
UNGRADED = (
    Kind("into a vehicle", ("crashes_vehicle",), ("rear_ended",), "the ego drove into a vehicle"),
    Kind("struck from behind or touched sideways", ("rear_ended",), (),
         "by another vehicle; rows of this age do not tell the two apart"),
)  # fmt: skip
DEPARTURES = (
    Kind("into a barrier", ("collisions_static",), (), "or anything else that stands"),
    Kind("off the road", ("off_road",), (), "left all lanes and was put back"),
    Kind("facing the wrong way", ("wrong_way",), (), "and was turned round"),
    Kind("rolled over", ("roll_overs",), (), "lay on its side and was put back"),
)  # fmt: skip


def kinds_of(graded: bool) -> tuple[Kind, ...]:
    """Returns the kinds that add up to all crashes; graded: False for results of older versions."""
    return (*(CONTACTS if graded else UNGRADED), *DEPARTURES)


def count(kind: Kind, runs: pl.DataFrame) -> int:
    """Returns how many crashes of a kind there were in these runs, at least 0."""
    total = sum(int(runs[c].sum() or 0) for c in kind.plus)
    return max(0, total - sum(int(runs[c].sum() or 0) for c in kind.minus))
