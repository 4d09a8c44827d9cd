"""The report of a matrix campaign: from results.parquet and the run folders to one page."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

import polars as pl

from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.statistics import DISPERSION_ASSUMED, event_rate
from skidpad.evidence.verdicts import Judgement, judge
from skidpad.recording.campaign.quantities import name_of
from skidpad.report.crashes.cards import Found
from skidpad.report.elements.figures import Chart, Curve, curves
from skidpad.report.elements.page import (
    Block,
    Figure,
    Page,
    Section,
    Table,
    Text,
    write_report_page,
)
from skidpad.report.elements.page import Cell as ShownCell
from skidpad.report.elements.tables import Column, Format, Quantity, table
from skidpad.report.elements.verdicts import unjudged_text, verdict_blocks
from skidpad.report.matrix import figures as matrix_figures
from skidpad.report.matrix import tables as matrix_tables
from skidpad.report.matrix.answers import answers
from skidpad.report.matrix.comparisons.parity import Parity, load_parity, parity_section
from skidpad.report.matrix.comparisons.published import beside_published
from skidpad.report.matrix.comparisons.sides import side_blocks
from skidpad.report.matrix.comparisons.steps import step_blocks
from skidpad.report.matrix.crashes import Cell, crash_sections, found_crashes, worst_of_each
from skidpad.report.matrix.data import CONFIGS, EVENTS, Matrix, load_matrix
from skidpad.report.matrix.headline import baseline_text, headline_numbers, headline_tables
from skidpad.report.matrix.readings import envelope_blocks, reading_blocks
from skidpad.report.matrix.real_time import real_time_blocks
from skidpad.report.matrix.tables import RATE, mean_quantity, rate_quantity
from skidpad.report.matrix.ways import way_blocks

Level = tuple[str, float]  # functions, cruise target in km/h
COUNTS = tuple(
    (column, f"{name_of(column)} per run")
    for column in ("crashes_vehicle", "road_departures", EVENTS)
)
CLAIMS = (*FINDINGS, *ACCEPTANCE)
GRADED = """A crash is a serious contact, a departure or a roll-over. A contact is serious when it \
changes the speed of either side by 5 km/h or more; with a pedestrian or a two-wheeler every contact is. \
In a departure the car hits a barrier, has all wheels off every lane for 1 s, is more than 3 m beyond the \
edge, or faces the wrong way. In an intervention the car is put back on its lane, also after a light \
contact; the published study counts interventions as collisions. A seed sets where traffic begins and the \
noise of sensors."""
UNGRADED = """These results are older than the grading of contacts. A crash is every intervention: what puts \
the car back on its lane after a contact, a departure, or because it faces the wrong way."""
LEAD = f"""\
Each row is a set of driving functions, each column a weather. Seeds are common to all cells, so \
differences between cells are paired. Intervals are 95 %, over seeds, from 8 seeds on. Those of counts hold \
while the variance of counts is at most {DISPERSION_ASSUMED:g} times their mean. Where fewer than two seeds \
had an event, the largest share of seeds that have one stands instead: it holds however events clump."""


def write_report(folder: Path) -> Path:
    """Writes report.html into a campaign's folder; returns its path."""
    return write_report_page(build_page(load_matrix(folder)), folder)


def build_page(matrix: Matrix) -> Page:
    """Returns the report page of a campaign; writes the pages of crashes beside it."""
    claims = [f for f in CLAIMS if not f.study]
    judged = judge(claims, [matrix.results] * len(claims), astray(matrix.results))
    crashes = found_crashes(matrix)
    parity = load_parity(matrix)
    sections = [
        Section("What happened", _first(matrix, judged, crashes)),
        Section(
            "Crashes and interventions",
            matrix_tables.collisions(matrix) + matrix_figures.collisions(matrix),
        ),
        Section("Findings of the sources, judged", _verdicts(matrix, judged)),
        Section(
            "Lane keeping and perception",
            matrix_tables.others(matrix) + matrix_figures.others(matrix),
        ),
        *([Section("Functions and cruise target", varied)] if (varied := factors(matrix)) else []),
        Section("One step at a time", step_blocks(matrix)),
        Section("Two configurations side by side", side_blocks(matrix)),
        Section("Where it happened", way_blocks(matrix, crashes)),
        Section("Every crash", crash_sections(matrix, crashes)),
        Section("Beside the published numbers", beside_published(matrix)),
        Section("Pixels against objects", parity_section(parity)),
        *(
            [Section("Further sensors and functions", read)]
            if (read := reading_blocks(matrix))
            else []
        ),
        *([Section("Speed envelope", bound)] if (bound := envelope_blocks(matrix)) else []),
        Section("All metrics", matrix_tables.per_weather(matrix)),
        Section("Real time", real_time_blocks(matrix)),
        Section("Definitions", [matrix.definitions()]),
        Section("Configuration and versions", matrix.provenance()),
    ]
    return Page(
        title="Driver assistance in weather",
        subtitle=matrix.subtitle,
        facts=[*matrix.facts(), *_processor_time(matrix, parity)],
        sections=sections,
    )


def _first(
    matrix: Matrix, judged: Sequence[Judgement], crashes: dict[Cell, list[Found]]
) -> list[Block]:
    """Returns what is read first: answers, headline numbers, the worst crashes, how to read the rest."""
    return [
        *matrix.missing(),
        Text(GRADED if matrix.has_grades else UNGRADED),
        *baseline_text(matrix),
        answers(matrix, judged, crashes),
        headline_numbers(matrix),
        *headline_tables(matrix),
        matrix_figures.speed_figure(matrix),
        *worst_of_each(crashes),
        Text(LEAD),
        *_alike(matrix),
    ]


def _processor_time(matrix: Matrix, parity: Parity | None) -> list[tuple[str, str]]:
    """Returns the fact on processor minutes of each part of the campaign; empty where none are known."""
    told = [f"{matrix.processor_minutes:.1f} min"] if matrix.processor_minutes > 0.0 else []
    if parity and parity.pixels.processor_minutes > 0.0:
        minutes = parity.pixels.processor_minutes
        told.append(f"{minutes:.1f} min more for the comparison with images")
    return [("processor time", ", ".join(told))] if told else []


def _alike(matrix: Matrix) -> list[Block]:
    """Returns a note on drives that moved alike in weathers beyond the known groups; or nothing."""
    groups = {tuple(g.weathers) for g in matrix.weather_groups}
    others = [(c, w) for c, w in matrix.same_weather if tuple(w) not in groups]
    if not others:
        return []
    pairs = "; ".join(f"configuration {c}: {' = '.join(weathers)}" for c, weathers in others)
    text = f"Drives that moved alike in several weathers ({pairs}) count once in totals."
    return [Text(text, tone="note")]


def _verdicts(matrix: Matrix, judged: Sequence[Judgement]) -> list[Block]:
    """Returns the verdicts with their introduction; one sentence instead for a single seed."""
    if matrix.seeds == 1:
        return [Text(unjudged_text(judged))]
    intro = Text(
        "Each claim, its test and its margin were written down before results of the matrix were "
        "seen. One rule is not blind: that a margin comes before significance. It means that a difference "
        "below its margin supports nothing. All reports share it, and it was settled after results "
        "of the friction campaign had been seen. "
        "“By construction” says that both sides must be the same drive, “same drives” that they were, "
        "since what differs never came into play. An id that ends in v is the same claim for crashes with "
        "vehicles alone. "
        "The sources call an intervention a collision, and so do their claims."
    )
    rows = [[ShownCell(f.id), ShownCell(f.claim)] for f in CLAIMS if f.study]
    caption = "claims that need runs of their own, judged by skidpad study ID"
    own = Table((("claim", ""), ("what it says", "")), rows, caption=caption, folded=True)
    return [intro, *verdict_blocks(judged), own]


# What was varied beside the published configurations: functions and cruise target, as factors.


def factors(matrix: Matrix) -> list[Block]:
    """Returns tables of functions and targets, none when only published configurations were driven."""
    if all(config in CONFIGS for config in matrix.configs):
        return []
    levels = sorted(set(_known_runs(matrix).select("functions", "cruise_kmh").rows()))
    if not levels:
        return []
    return [_table(matrix, levels), *_figure(matrix, levels)]


def _known_runs(matrix: Matrix) -> pl.DataFrame:
    """Returns the runs of our own stack, each drive once."""
    return matrix.counted.filter(pl.col("cruise_kmh").is_not_null())


def _runs(matrix: Matrix, level: Level) -> pl.DataFrame:
    """Returns the known runs with this level's functions and cruise target in km/h."""
    return _known_runs(matrix).filter(
        (pl.col("functions") == level[0]) & (pl.col("cruise_kmh") == level[1])
    )


def _table(matrix: Matrix, levels: list[Level]) -> Block:
    """Returns the table of counts per run and of mean speed by functions and cruise target."""
    columns = [
        Column[Level]("functions", lambda level: level[0] or "none"),
        Column[Level]("cruise target, km/h", lambda level: f"{level[1]:g}"),
        *(
            Column[Level](title, partial(_count, matrix, name), format=RATE)
            for name, title in COUNTS
        ),
        Column[Level]("mean speed, km/h", partial(_mean, matrix), format=Format()),
    ]
    note = "Over all weathers, every drive once; small: 95 % interval."
    return table(columns, levels, "By functions and cruise target", note)


def _count(matrix: Matrix, column: str, level: Level) -> Quantity:
    """Returns the rate of events per run in `column` at a level; no value without runs."""
    counts = _runs(matrix, level)[column].drop_nulls()
    return rate_quantity(event_rate(counts.to_list()) if len(counts) else None)


def _mean(matrix: Matrix, level: Level) -> Quantity:
    """Returns the mean speed in km/h over the runs at a level."""
    return mean_quantity(_runs(matrix, level), "mean_speed_kmh")


def _figure(matrix: Matrix, levels: list[Level]) -> list[Block]:
    """Returns a figure of crashes per run over cruise target, a curve per set of functions; or none."""
    found = []
    for functions in sorted({functions for functions, _ in levels}):
        targets = [cruise for f, cruise in levels if f == functions]
        if len(targets) > 1:
            rates = [_count(matrix, EVENTS, (functions, v)).value for v in targets]
            there = [(v, r) for v, r in zip(targets, rates, strict=True) if r is not None]
            if there:
                x, y = zip(*there, strict=True)
                found.append(Curve(functions or "none", x, y))
    if not found:
        return []
    chart = Chart(found, "cruise target, km/h", f"{EVENTS} per run")
    return [
        Figure(curves([chart], height=3.6), f"{EVENTS.capitalize()} against the cruise target.")
    ]
