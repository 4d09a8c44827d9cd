"""The report of an evaluation: who finds hazards how well, against which truth (C-210 to C-218)."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import polars as pl

from skidpad import __version__
from skidpad.core.errors import FileError
from skidpad.evidence.channels.findings import FINDINGS
from skidpad.evidence.channels.matching import percent
from skidpad.evidence.verdicts import judge
from skidpad.report.channels_redundancy import redundancy
from skidpad.report.figures import PALETTE, canvas, svg_of
from skidpad.report.page import (
    Block,
    Cell,
    Figure,
    Number,
    Numbers,
    Page,
    Section,
    Table,
    Text,
    write_page,
)
from skidpad.report.published import Source, published
from skidpad.report.verdicts import verdict_blocks

EVALUATION = "evaluation.json"
REPORT = "report.html"
HEADLINE_TOLERANCE = 1.0  # s
FEW = 100  # events; fewer are called too few
AIM = 0.95
PUBLISHED = {
    "inconsistent_localisation": "inconsistent_ego_localization",
    "ego_tailgating": "ego_tailgating",
    "ego_tailgated": "ego_tailgated",
}
TRUTHS = {
    "sim": "simulator truth: what was really so, with hindsight",
    "world": "world-model truth: what the channels reported, ghosts included",
    "labels": "human labels",
}
LEAD = """A detection is right when a true hazard of the same kind overlaps it within 1 s; each counts once. \
Two truths judge: the simulator's, which knows what was really so, and the world model's, which takes \
what the channels report as the world. Neither shares code with the rules.

Events within a drive depend on each other, so intervals come from resampling whole drive segments. \
Published numbers (8 h, other simulator, other channels, one human annotator) stand beside ours in italics."""


def write_evaluation_report(folder: Path) -> Path:
    """Write report.html beside evaluation.json; returns its path."""
    source, path = folder / EVALUATION, folder / REPORT
    try:
        table = json.loads(source.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise FileError(f"{source}: cannot be read as an evaluation ({error})") from error
    write_page(evaluation_page(table, folder), path)
    return path


def evaluation_page(table: Mapping[str, Any], folder: Path) -> Page:
    """All sections in the order in which a reader asks."""
    truths = sorted({r["truth"] for r in table["results"]}, key=list(TRUTHS).index)
    sections = [
        Section("What came out", [_numbers(table), Text(LEAD)]),
        *[Section(f"Against the {_short(t)}", [_results(table, t)]) for t in truths],
        Section("By route", [b for t in truths for b in _routes(table, t)]),
        Section("Findings of the source, judged", verdicts(table)),
        Section("Why it errs", _causes(table)),
        Section("One threshold, both errors", _curve(table)),
        Section("Does redundancy pay", redundancy(folder)),
        Section("How the two truths differ", _agreement(table)),
        Section("Segments", _segments(table)),
    ]
    return Page(
        title="Who finds the hazards",
        subtitle=f"{table['segments']} drive segments, {table['hours']:.2f} h evaluated",
        facts=[("Skidpad", __version__)],
        sections=[s for s in sections if s.blocks],
    )


def _short(truth: str) -> str:
    return TRUTHS[truth].split(":")[0]


def _numbers(table: Mapping[str, Any]) -> Numbers:
    items = [Number(f"{table['hours']:.2f} h", "evaluated", f"{table['segments']} segments")]
    for result in _headline(table):
        if result["truth"] != "world":
            continue
        precision, recall = result["micro"]
        items.append(
            Number(
                f"{_percent(precision)} / {_percent(recall)}",
                "precision / recall, %",
                f"{_name(result['rules'])}, world-model truth, all hazards",
            )
        )
    items.append(
        Number(
            f"{table['unseen_by_all_channels']}",
            "true hazards that no channel could see",
            "simulator truth",
        )
    )
    return Numbers(items)


def _headline(table: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [r for r in table["results"] if r["tolerance_s"] == HEADLINE_TOLERANCE]


def _name(identifier: str) -> str:
    return identifier.replace("_", " ")


def _percent(ratio: float | None) -> str:
    return "-" if ratio is None else percent(ratio)


def _results(table: Mapping[str, Any], truth: str) -> Table:
    """Every identifier and hazard against one truth."""
    rows = []
    for result in (r for r in _headline(table) if r["truth"] == truth):
        others = {
            r["tolerance_s"]: r
            for r in table["results"]
            if (r["rules"], r["truth"]) == (result["rules"], truth)
        }
        for hazard, row in result["hazards"].items():
            rows.append(_result_row(_name(result["rules"]), hazard, row, others, truth == "world"))
        for kind in ("macro", "micro"):
            precision, recall = result[kind]
            rows.append(
                [
                    Cell(_name(result["rules"])),
                    Cell(f"all, {kind}"),
                    *[Cell("") for _ in range(3)],
                    Cell(_percent(precision), precision),
                    Cell(_percent(recall), recall),
                    *[Cell("") for _ in range(4)],
                ]
            )
    return Table(
        [
            ("identifier", "rule profile, or learned"),
            ("hazard", ""),
            ("found", "true positives"),
            ("false", "false positives"),
            ("missed", "false negatives"),
            ("precision, %", "95 % interval below"),
            ("recall, %", "95 % interval below"),
            ("false per hour", ""),
            ("lead time, s", "median; positive: found before it was true"),
            ("precision / recall at 0.5 and 2 s", "the same with other tolerances of matching"),
            ("published precision / recall, %", "against world-model truth"),
        ],
        rows,
        caption=TRUTHS[truth].capitalize(),
    )


def _result_row(
    identifier: str,
    hazard: str,
    row: Mapping[str, Any],
    others: Mapping[float, Mapping[str, Any]],
    with_published: bool,
) -> list[Cell]:
    events = row["tp"] + row["fn"]
    rate, lead = row["false_alarms_per_hour"], row["lead_time_median_s"]
    return [
        Cell(identifier),
        Cell(_name(hazard), note="too few events to say more" if events < FEW else ""),
        *[Cell(f"{row[k]}", float(row[k])) for k in ("tp", "fp", "fn")],
        _ratio_cell(row["precision"], row["precision_interval"]),
        _ratio_cell(row["recall"], row["recall_interval"]),
        Cell("-" if rate is None else f"{rate:.2f}", rate),
        Cell("-" if lead is None else f"{lead:+.1f}", lead),
        Cell(
            ", ".join(
                f"{_percent(o['hazards'][hazard]['precision'])} / {_percent(o['hazards'][hazard]['recall'])}"
                for tolerance, o in sorted(others.items())
                if tolerance != HEADLINE_TOLERANCE
            ),
            kind="muted",
        ),
        Cell(_published_hazards().get(hazard, "") if with_published else "", kind="published"),
    ]


def _ratio_cell(ratio: float | None, interval: list[float] | None) -> Cell:
    if ratio is None or interval is None:
        return Cell("not defined", kind="muted")
    note = f"{_percent(interval[0])} to {_percent(interval[1])}"
    return Cell(_percent(ratio), ratio, note, kind="good" if ratio >= AIM else "")


def _published_hazards() -> dict[str, str]:
    rows = published(Source.HAZARDS)
    said = {
        name: f"{p:.2f} / {r:.2f}"
        for name, p, r in rows.select(
            "hazard", "precision_pct_computed", "recall_pct_computed"
        ).iter_rows()
    }
    return {ours: said[theirs] for ours, theirs in PUBLISHED.items()}


def _routes(table: Mapping[str, Any], truth: str) -> list[Block]:
    """Found, false and missed per route, and the published towns."""
    identifiers = [r["rules"] for r in _headline(table) if r["truth"] == truth]
    hazards = list(PUBLISHED)
    routes = sorted({r for i in identifiers for r in table["by_route"][f"{i}/{truth}"]})
    rows = []
    for route in routes:
        for identifier in identifiers:
            counts = table["by_route"][f"{identifier}/{truth}"].get(route, {})
            rows.append(
                [
                    Cell(route),
                    Cell(_name(identifier)),
                    *[Cell(" / ".join(map(str, counts.get(h, ["-"])))) for h in hazards],
                ]
            )
    if truth == "world":
        rows += _published_towns(hazards)
    return [
        Table(
            [("route", ""), ("identifier", ""), *[(_name(h), "") for h in hazards]],
            rows,
            caption=f"Found / false / missed per route, {_short(truth)}",
        )
    ]


def _published_towns(hazards: list[str]) -> list[list[Cell]]:
    towns = published(Source.HAZARDS_BY_TOWN)
    rows = []
    for (town,), group in towns.group_by("town", maintain_order=True):
        said = {
            h: f"{tp} / {fp} / {fn}"
            for h, tp, fp, fn in group.select(
                "hazard", "true_positives", "false_positives", "false_negatives"
            ).iter_rows()
        }
        cells = [Cell(said[PUBLISHED[h]], kind="published") for h in hazards]
        rows.append(
            [Cell(f"town {town}", kind="published"), Cell("published", kind="published"), *cells]
        )
    return rows


def verdicts(table: Mapping[str, Any]) -> list[Block]:
    """Each finding with its verdict, marked by what brings it about."""
    results = pl.DataFrame(table["segment_table"], infer_schema_length=None)
    judged = judge(FINDINGS, [results if len(results) else None] * len(FINDINGS))
    blocks: list[Block] = [
        Text(
            "Practical rules against world-model truth. Claims, tests and margins were written before "
            "results were seen; that a margin comes before significance is a rule of all reports, "
            "settled after results of the friction campaign. A finding that the simulated channels "
            "bring about by how they are made is marked; all others emerge from the drives."
        )
    ]
    blocks += verdict_blocks(judged)
    return blocks


def _causes(table: Mapping[str, Any]) -> list[Block]:
    rows = [
        [
            Cell(_name(c["hazard"])),
            Cell("missed" if c["missed"] else "false alarm"),
            Cell(c["cause"]),
            Cell(_name(c["rules"])),
            Cell(_short(c["truth"])),
            Cell(f"{c['count']}", float(c["count"])),
        ]
        for c in table["causes"]
    ]
    if not rows:
        return [Text("No identifier made a mistake.")]
    return [
        Table(
            [
                ("hazard", ""),
                ("mistake", ""),
                ("cause", "the first that applies; of a miss the clause that held least often"),
                ("identifier", ""),
                ("truth", ""),
                ("count", ""),
            ],
            rows,
            caption="Causes of mistakes, most frequent first",
        )
    ]


def _curve(table: Mapping[str, Any]) -> list[Block]:
    """Precision and recall against the factor on one threshold (C-105)."""
    return [
        Figure(
            _curve_figure(rows, table["hours"]),
            f"Practical rules with one threshold scaled, {_short(truth)}: a lower one finds more and "
            "floods with false alarms. Drawn to show the trade, not to choose by it.",
        )
        for truth, rows in table["curve"].items()
        if rows
    ]


def _curve_figure(rows: Mapping[str, Mapping[str, list[int]]], hours: float) -> str:
    factors = [float(f) for f in rows]
    with canvas(width=10.0, columns=2) as (figure, (left, right)):
        for k, hazard in enumerate(PUBLISHED):
            counts = [row[hazard] for row in rows.values()]
            recall = [tp / (tp + fn) if tp + fn else float("nan") for tp, _, fn in counts]
            left.plot(factors, recall, color=PALETTE[k], marker="o", label=_name(hazard))
            false = [fp / hours if hours else float("nan") for _, fp, _ in counts]
            right.plot(factors, false, color=PALETTE[k], marker="o")
        left.set_ylim(-0.03, 1.03)
        left.set_ylabel("recall")
        right.set_ylabel("false alarms per hour")
        for axes in (left, right):
            axes.set_xlabel("factor on the threshold")
        figure.legend(loc="outside upper center", ncols=3)
        return svg_of(figure)


def _agreement(table: Mapping[str, Any]) -> list[Block]:
    rows = [
        [
            Cell(_name(hazard)),
            *[Cell(f"{row[k]}", float(row[k])) for k in ("tp", "fp", "fn")],
            _ratio_cell(row["precision"], row["precision_interval"]),
            _ratio_cell(row["recall"], row["recall_interval"]),
        ]
        for hazard, row in table["truths_agree"].items()
    ]
    return [
        Table(
            [
                ("hazard", ""),
                ("in both", ""),
                ("only in the world model", "ghosts, pessimistic predictions"),
                ("only in the simulator", "unseen, or predicted away"),
                ("share of the world model's that is real, %", ""),
                ("share of the real that the world model has, %", ""),
            ],
            rows,
            caption="World-model truth as if it were a detector of simulator truth",
        )
    ]


def _segments(table: Mapping[str, Any]) -> list[Block]:
    columns = (
        ("hours", "h"), ("objects_mean", "objects"), ("total_mean_ms", "mean, ms"),
        ("total_p999_ms", "99.9 %, ms"), ("total_max_ms", "greatest, ms"),
    )  # fmt: skip
    rows = [
        [
            Cell(row["name"]),
            Cell(row["route"]),
            *[Cell(_cell_text(row.get(c)), row.get(c)) for c, _ in columns],
        ]
        for row in table["segment_table"]
    ]
    return [
        Table(
            [("recording", ""), ("route", ""), *[(title, "") for _, title in columns]],
            rows,
            caption="Every segment, with the monitor's processor time per cycle",
        )
    ]


def _cell_text(value: float | None) -> str:
    return "" if value is None else f"{value:.3f}"
