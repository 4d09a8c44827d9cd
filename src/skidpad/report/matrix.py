"""The report of a matrix campaign: from results.parquet and the run folders to one page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.verdicts import Judgement, judge
from skidpad.report import matrix_figures, matrix_tables
from skidpad.report.crashes import crash_sections, found_crashes, worst_of_each
from skidpad.report.matrix_answers import answers, speed_figure
from skidpad.report.matrix_data import Matrix, load_matrix
from skidpad.report.matrix_factors import factors
from skidpad.report.matrix_headline import headline_table
from skidpad.report.page import Block, Number, Numbers, Page, Section, Text, write_report_page
from skidpad.report.verdicts import verdict_blocks

CLAIMS = (*FINDINGS, *ACCEPTANCE)
LEAD = """Each row below is a set of driving functions, each column a weather. A cell was driven with \
every seed; seeds are common to all cells, so differences between cells are paired. A fatal collision \
is a contact that started the recovery supervisor, a departure from the road (all wheels off every lane \
for 1 s, or more than 3 m beyond the edge), or a wrong-way correction.

Intervals are 95 %: of counts score limits that take the spread of the runs into account, of means \
Student's, widened where values are skew; where neither holds its coverage it says too few. Published \
numbers stand beside ours in italics. They come from one run per cell on another simulator and another \
map: they are there to compare, and nothing here was tuned to meet them."""


def write_report(folder: Path) -> Path:
    """Write report.html into a campaign's folder; returns its path."""
    return write_report_page(build_page(load_matrix(folder)), folder)


def build_page(matrix: Matrix) -> Page:
    """All sections in the order in which a reader asks."""
    claims = [f for f in CLAIMS if not f.study]
    judged = judge(claims, [matrix.results] * len(claims), astray(matrix.results))
    crashes = found_crashes(matrix)
    sections = [
        Section(
            "What happened",
            [
                *_warnings(matrix),
                answers(matrix, judged),
                _headline(matrix),
                headline_table(matrix),
                speed_figure(matrix),
                *worst_of_each(crashes),
                Text(LEAD),
            ],
        ),
        Section("Collisions", matrix_tables.collisions(matrix) + matrix_figures.collisions(matrix)),
        Section("Findings of the sources, judged", _verdicts(judged)),
        Section(
            "Lane keeping and perception",
            matrix_tables.others(matrix) + matrix_figures.others(matrix),
        ),
        *([Section("Functions and cruise target", varied)] if (varied := factors(matrix)) else []),
        Section("One step at a time", matrix_tables.pairs(matrix)),
        Section("Every crash", crash_sections(matrix, crashes)),
        Section("All metrics", matrix_tables.per_weather(matrix)),
        Section("Definitions", [matrix.definitions()]),
        Section("Configuration and versions", matrix.provenance()),
    ]
    return Page(
        title="Driver assistance in weather",
        subtitle=matrix.subtitle,
        facts=matrix.facts(),
        sections=sections,
    )


def _warnings(matrix: Matrix) -> list[Block]:
    if not matrix.same_weather:
        return matrix.missing()
    pairs = "; ".join(f"configuration {c}: {' = '.join(group)}" for c, group in matrix.same_weather)
    text = (
        f"Identical drives, because weather cannot act here ({pairs}). They count once in totals."
    )
    return [*matrix.missing(), Text(text, tone="warning")]


def _headline(matrix: Matrix) -> Numbers:
    t = matrix.counted
    km = float(t["distance_km"].sum())
    fatal, hits, left, first = (
        int(t[c].sum())
        for c in ("fatal_collisions", "crashes_vehicle", "road_departures", "fatal_first")
    )

    def per_100_km(events: int) -> str:
        return f"{100 * events / km:.1f} per 100 km" if km else ""

    return Numbers(
        [
            Number(f"{hits}", "crashes with vehicles", per_100_km(hits)),
            Number(f"{left}", "departures from the road", per_100_km(left)),
            Number(f"{fatal}", "fatal events", f"{first} of them first of a chain"),
            Number(
                f"{len(matrix.results)}",
                "runs",
                f"{matrix.results['seed'].n_unique()} seeds per cell",
            ),
            Number(
                f"{km:,.0f} km",
                "driven",
                f"{float(t['duration_s'].sum()) / 3600:.1f} h of simulated time",
            ),
        ]
    )


def _verdicts(judged: Sequence[Judgement]) -> list[Block]:
    intro = Text(
        "Each claim, its test and its margin were written down before results of the matrix were "
        "seen. One rule is not blind: that a margin comes before significance, so that a difference "
        "below its margin supports nothing, is shared by all reports and was settled after results "
        "of the friction campaign had been seen. "
        "By construction: both sides must be the same drive. Same drives: they happened to be, what "
        "differs never came into play. A v behind an id: the same claim for crashes with vehicles alone."
    )
    own = ", ".join(f.id for f in CLAIMS if f.study)
    rest = Text(f"Claims that need runs of their own are judged by `skidpad study`: {own}.")
    return [intro, *verdict_blocks(judged), rest]
