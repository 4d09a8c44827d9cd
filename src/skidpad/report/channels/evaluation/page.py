"""The report of an evaluation: how well identifiers find hazards, against which truth (C-210 to C-218)."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec
import polars as pl

from skidpad import __version__
from skidpad.core.files.reading import convert_plain, decode_json, read_bytes
from skidpad.evidence.channels.findings import FINDINGS
from skidpad.evidence.channels.judging.reference import NAME as REFERENCE
from skidpad.evidence.channels.judging.segments import TOLD
from skidpad.evidence.channels.redundancy import (
    EVENTS,
    Difference,
    DriverRow,
    compare_drivers,
    differences,
)
from skidpad.evidence.statistics_text import interval_text, p_text, rate_text
from skidpad.evidence.verdicts import Judgement, judge
from skidpad.recording.channels.drives import read_outcomes
from skidpad.report.channels.evaluation import scores
from skidpad.report.channels.evaluation.driven import route_list_blocks
from skidpad.report.channels.evaluation.routes import route_blocks
from skidpad.report.channels.evaluation.scores import (
    FEW,
    HAZARDS,
    TRUTHS,
    Row,
    headline,
    ratio_text,
    short,
)
from skidpad.report.channels.evaluation.strata import headline_of_risky, precision_recall, strata
from skidpad.report.channels.evaluation.ways import draw_ways
from skidpad.report.elements.figures import Chart, Curve, curves
from skidpad.report.elements.page import (
    Answer,
    Answers,
    Block,
    Cell,
    Figure,
    Number,
    Numbers,
    Page,
    Section,
    Text,
    words,
    write_report_page,
)
from skidpad.report.elements.tables import Column, Format, table
from skidpad.report.elements.verdicts import tally_text, verdict_blocks

TITLES = {
    "collisions": "collisions",
    "collisions_struck": "of these, hit by the ego",
    "red_lights_run": "red lights run",
    "stalls": "stalls",
}
EVALUATION = "evaluation.json"
LEAD = """A detection is right when a true hazard of the same kind overlaps it within 1 s; each counts once. \
Two truths judge: the simulator's, which knows what was really so, and the world model's, which takes \
what the channels report as the world. Neither shares code with the rules.

Events within a drive depend on each other, so intervals are over whole drive segments, \
from 8 segments on. \
Published numbers (8 h, other simulator, other channels, one human annotator) stand beside ours in italics."""


def write_evaluation_report(folder: Path) -> Path:
    """Writes report.html beside evaluation.json; returns its path."""
    return write_report_page(evaluation_page(_read(folder / EVALUATION), folder), folder)


class _Result(msgspec.Struct):
    """The result of one identifier against one truth."""

    rules: str
    truth: Literal["sim", "world", "labels"]
    tolerance_s: float
    hazards: dict[str, dict[str, Any]]
    micro: list[float | None]


class _Evaluation(msgspec.Struct):
    """What the page takes from an evaluation."""

    segments: int
    hours: float
    results: list[_Result]
    segment_table: list[dict[str, Any]]
    curve: dict[str, dict[str, Any]]
    by_route: dict[str, Any]
    causes: list[dict[str, Any]]
    truths_agree: dict[str, dict[str, Any]]
    unseen_by_all_channels: Any


def _read(source: Path) -> Row:
    """Returns evaluation.json as plain data; InputError when it has not what the page shows."""
    data = read_bytes(source, "an evaluation")
    evaluation: Row = decode_json(data, str(source), dict[str, Any])
    convert_plain(evaluation, _Evaluation, str(source))
    return evaluation


def evaluation_page(evaluation: Row, folder: Path) -> Page:
    """Returns the report page of an evaluation; folder: of the drives, for outcomes and ways."""
    judged = _read_judgements(evaluation)
    truths = sorted({r["truth"] for r in evaluation["results"]}, key=list(TRUTHS).index)
    return Page(
        title="Who finds the hazards",
        subtitle=f"{evaluation['segments']} drive segments, {evaluation['hours']:.2f} h evaluated",
        facts=[("Skidpad", __version__)],
        sections=[
            Section(
                "What came out",
                [
                    _answers(evaluation, judged),
                    _numbers(evaluation),
                    Text(LEAD),
                    *_about_model(evaluation),
                ],
            ),
            *[Section(f"Against the {short(t)}", [scores.results(evaluation, t)]) for t in truths],
            Section("Natural and risky drivers", strata(evaluation)),
            Section("Precision against recall", precision_recall(evaluation)),
            Section(
                "By route",
                [
                    *route_list_blocks(evaluation),
                    *(scores.routes(evaluation, t) for t in truths),
                    *(scores.route_ratios(evaluation, t) for t in truths),
                ],
            ),
            Section("Indicators and times by route", route_blocks(evaluation)),
            Section("Findings of the source, judged", verdicts(judged)),
            Section("Why it errs", [scores.causes(evaluation)]),
            Section("One threshold, both errors", _curve(evaluation)),
            Section("Does redundancy pay", redundancy(folder)),
            Section("How the two truths differ", [scores.agreement(evaluation)]),
            Section("Ways driven", draw_ways(folder)),
            Section("Segments", [scores.segments(evaluation)]),
        ],
    )


def _about_model(evaluation: Row) -> list[Block]:
    """Returns a note on what the learned identifier was trained on; empty without a model."""
    model = evaluation.get("model")
    if not model:
        return []
    text = (
        f"The learned identifier was trained on {model['recordings']} other drives "
        f"({model['hours']:.2f} h)."
    )
    if model["sees_labels"]:
        text += (
            " It sees times to collision, which nearly are the labels of world-model truth: its "
            "scores against that truth say little."
        )
    return [Text(text, tone="note")]


def _answers(evaluation: Row, judged: Sequence[Judgement]) -> Answers:
    """Returns the answers to how good each deciding identifier is, what is missed, and how sure that is."""
    judged_by, of = _deciding(evaluation)
    items = []
    for result in judged_by:
        precision, recall = map(ratio_text, result["micro"])
        sentence = f"{recall} % of {of} are found, and {precision} % of what is found is one."
        items.append(Answer(f"How good is {words(result['rules'])}?", sentence))
    rows = [row for result in judged_by[:1] for row in result["hazards"].values()]
    true = sum(row["tp"] + row["fn"] for row in rows)
    few = ", too few to say much" if true < FEW else ""
    sure = f"{evaluation['segments']} drive segments with {true} true hazards{few}. "
    sure += tally_text(judged)
    risky = headline_of_risky(evaluation)
    items += [Answer("What is missed?", risky)] if risky else []
    return Answers([*items, Answer("How sure is that?", sure)])


def _deciding(evaluation: Row) -> tuple[list[Row], str]:
    """Returns the headline results of identifiers against the truth that decides, and its name in words.

    That is "sim" if any was judged by it, else "world" (C-3). The reference and the rules that are
    told the grip are left out.
    """
    rows = [r for r in headline(evaluation) if r["rules"] not in (REFERENCE, TOLD)]
    if any(r["truth"] == "sim" for r in rows):
        return [r for r in rows if r["truth"] == "sim"], "the hazards that were really there"
    world = [r for r in rows if r["truth"] == "world"]
    return world, "the hazards that the channels' own reports hold"


def _numbers(evaluation: Row) -> Numbers:
    """Returns the head numbers: hours, precision and recall per judged result, unseen hazards."""
    hours, unseen = evaluation["hours"], evaluation["unseen_by_all_channels"]
    judged, _ = _deciding(evaluation)
    return Numbers(
        [
            Number(f"{hours:.2f} h", "evaluated", f"{evaluation['segments']} segments"),
            *(
                Number(
                    " / ".join(map(ratio_text, result["micro"])),
                    "precision / recall, %",
                    f"{words(result['rules'])}, {short(result['truth'])}, all hazards",
                )
                for result in judged
            ),
            Number(f"{unseen}", "true hazards that no channel could see", "simulator truth"),
        ]
    )


def _read_judgements(evaluation: Row) -> list[Judgement]:
    """Returns the judgements of FINDINGS on the evaluation's segment table."""
    results = pl.DataFrame(evaluation["segment_table"], infer_schema_length=None)
    return judge(FINDINGS, [results if len(results) else None] * len(FINDINGS))


def verdicts(judged: Sequence[Judgement]) -> list[Block]:
    """Returns an introduction and a block per finding with its verdict, marked by its cause."""
    intro = Text(
        "Practical rules against world-model truth. Claims, tests and margins were written before "
        "results were seen; that a margin comes before significance is a rule of all reports, "
        "settled after results of the friction campaign. A finding that the simulated channels "
        "bring about by how they are made is marked; all others emerge from the drives."
    )
    return [intro, *verdict_blocks(judged)]


def _curve(evaluation: Row) -> list[Block]:
    """Returns a figure per truth of recall and false alarms against the factor on one threshold (C-105)."""
    return [
        Figure(
            _curve_figure(rows, evaluation["hours"]),
            f"Practical rules with one threshold scaled, {short(truth)}: a lower one finds more and "
            "floods with false alarms. Drawn to show the trade, not to choose by it.",
        )
        for truth, rows in evaluation["curve"].items()
        if rows
    ]


def _curve_figure(rows: Row, hours: float) -> str:
    """Returns an SVG of recall and false alarms per hour by the factor on the threshold, per hazard."""
    factors = [float(f) for f in rows]
    recall, false = [], []
    for hazard in HAZARDS:
        counts = [row[hazard] for row in rows.values()]
        found = [tp / (tp + fn) if tp + fn else float("nan") for tp, _, fn in counts]
        rate = [fp / hours if hours else float("nan") for _, fp, _ in counts]
        recall.append(Curve(words(hazard), factors, found, style={"marker": "o"}))
        false.append(Curve(words(hazard), factors, rate, style={"marker": "o"}))
    axis = "factor on the threshold"
    charts = [
        Chart(recall, axis, "recall", y_range=(-0.03, 1.03)),
        Chart(false, axis, "false alarms per hour"),
    ]
    return curves(charts, width=10.0)


# Whether redundancy pays: the same seeds driven by one channel and by the arbiter (decision C-9).


def redundancy(folder: Path) -> list[Block]:
    """Returns outcomes per driver and their differences from the arbiter at equal seeds.

    A note instead where fewer than two drivers share seeds below the folder.
    """
    outcomes = read_outcomes([folder])
    drivers = compare_drivers(outcomes)
    if len(drivers) < 2 or not drivers[0].segments:
        return [
            Text(
                "Not shown: it needs the same seeds driven by the arbiter and by a channel alone "
                "(`skidpad channels drive --drive-by NAME` into a folder below this one).",
                tone="note",
            )
        ]
    columns = [
        Column[DriverRow]("driven by", lambda d: d.drive_by),
        Column[DriverRow]("segments", lambda d: d.segments, "driven by all"),
        Column[DriverRow]("hours", lambda d: d.hours, format=Format(".2f")),
        Column[DriverRow]("km", lambda d: d.km, format=Format(".1f")),
        *(
            Column(TITLES[event], partial(_rate, event), "count, rate per hour below")
            for event in EVENTS
        ),
    ]
    return [
        table(columns, drivers, "Outcomes by driver, on the seeds that all have driven"),
        Text(" ".join(map(_sentence, differences(outcomes)))),
    ]


def _rate(event: str, driver: DriverRow) -> Cell:
    """Returns a cell with a driver's number of events and, as note, their rate per segment or hour."""
    rate = driver.rates[event]
    return Cell(str(rate.events), float(rate.events), note=rate_text(rate, "segment", "h"))


def _sentence(d: Difference) -> str:
    """Returns a sentence on the paired difference per segment: interval, p value, number of pairs."""
    c = d.pairs
    return (
        f"{d.drive_by} alone less the arbiter, {TITLES[d.event]} per segment: {c.mean:+.3g} "
        f"({interval_text(c.interval, c.n, 'pair')}, {p_text(c.p)}, {c.n} pairs)."
    )
