"""Tables of the report of an evaluation: scores, routes, causes, agreement, segments (C-210 to C-218)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from skidpad.evidence.channels.matching import Tally, percent
from skidpad.evidence.statistics import Interval
from skidpad.report.elements.page import Block, Cell, Table, Text, words
from skidpad.report.elements.tables import Column, Format, table
from skidpad.report.published import Source, published_rows, read_published

Row = Mapping[str, Any]  # of evaluation.json
HEADLINE_TOLERANCE = 1.0  # s
FEW = 100  # events; fewer are called too few
AIM = 0.95
HAZARDS = {
    "inconsistent_localisation": "inconsistent_ego_localization",
    "ego_tailgating": "ego_tailgating",
    "ego_tailgated": "ego_tailgated",
}  # ours and published
TRUTHS = {
    "sim": "simulator truth: what was really so, with hindsight",
    "world": "world-model truth: what the channels reported, ghosts included",
    "labels": "human labels",
}


def short(truth: str) -> str:
    """Returns the name of a truth ("sim", "world", ...) in two words."""
    return TRUTHS[truth].split(":")[0]


def headline(evaluation: Row) -> list[Row]:
    """Returns the results at the tolerance of HEADLINE_TOLERANCE s."""
    return [r for r in evaluation["results"] if r["tolerance_s"] == HEADLINE_TOLERANCE]


def ratio_text(ratio: float | None) -> str:
    """Returns a ratio in percent as text, without the sign; "-" for None."""
    return "-" if ratio is None else percent(ratio)


def ratio(name: str, row: Row) -> Cell:
    """Returns a cell in % of a precision or recall with its interval, good from AIM on; None: not defined."""
    value, limits = row[name], row.get(f"{name}_interval")
    if value is None:
        return Cell("not defined", kind="muted")
    return Cell(
        percent(value),
        sort=100.0 * value,
        note=f"{percent(limits[0])} to {percent(limits[1])}" if limits else "",
        kind="good" if limits and value >= AIM else "",
        limits=Interval(*(100.0 * end for end in limits)) if limits else None,
    )


def count(name: str, row: Row) -> float | None:
    """Returns the value of a row's field `name` as it is; None where it is absent or null."""
    return row.get(name)


NOTHING = Format(absent="")


def _counts(titles: Mapping[str, tuple[str, str]]) -> list[Column[Row]]:
    """Returns a column of counts per name, from titles and definitions by field name."""
    return [
        Column(title, partial(count, name), definition, format=NOTHING)
        for name, (title, definition) in titles.items()
    ]


def _ratio(name: str, title: str, definition: str = "") -> Column[Row]:
    """Returns a column in % of the ratio in the field `name`."""
    return Column(title, partial(ratio, name), definition, "%")


def results(evaluation: Row, truth: str) -> Table:
    """Returns the table of every identifier and hazard against one truth, with macro and micro means."""
    rows: list[Row] = []
    for result in (r for r in headline(evaluation) if r["truth"] == truth):
        name = {"identifier": words(result["rules"])}
        others = [
            r
            for r in sorted(evaluation["results"], key=lambda r: r["tolerance_s"])
            if (r["rules"], r["truth"]) == (result["rules"], truth)
            and r["tolerance_s"] != HEADLINE_TOLERANCE
        ]
        for hazard, row in result["hazards"].items():
            elsewhere = [other["hazards"][hazard] for other in others]
            rows.append({**name, "hazard": hazard, "others": elsewhere, **row})
        for kind in ("macro", "micro"):
            precision, recall = result[kind]
            both = {"precision": precision, "recall": recall}
            rows.append({**name, "hazard": f"all, {kind}", **both})
    return table(_result_columns(truth), rows, TRUTHS[truth].capitalize())


def _result_columns(truth: str) -> list[Column[Row]]:
    """Returns the columns of the results table; the published ones are filled for the truth "world" alone."""
    counts = {
        "tp": ("found", "true positives"),
        "fp": ("false", "false positives"),
        "fn": ("missed", "false negatives"),
    }
    said = _published_hazards() if truth == "world" else {}
    return [
        Column("identifier", lambda r: r["identifier"], "rule profile, or learned"),
        Column("hazard", _hazard),
        *_counts(counts),
        _ratio("precision", "precision", "95 % interval below"),
        _ratio("recall", "recall", "95 % interval below"),
        Column("false per hour", partial(count, "false_alarms_per_hour"),
               format=Format(".2f", absent="-")),
        Column("lead time", partial(count, "lead_time_median_s"),
               "median; positive: found before it was true", "s", Format("+.1f", absent="-")),
        Column("precision / recall at 0.5 and 2 s", _elsewhere,
               "the same with other tolerances of matching", kind="muted"),
        Column("published precision / recall", lambda r: said.get(r["hazard"], ""),
               "against world-model truth", "%", kind="published"),
    ]  # fmt: skip


def _hazard(row: Row) -> Cell:
    """Returns a cell with the hazard's name, and a note where there are fewer than FEW true events."""
    few = "tp" in row and row["tp"] + row["fn"] < FEW
    return Cell(words(row["hazard"]), note="too few events to say more" if few else "")


def _elsewhere(row: Row) -> str:
    """Returns precision and recall in % with the other tolerances as text, "" where there are none."""
    return ", ".join(
        f"{ratio_text(o['precision'])} / {ratio_text(o['recall'])}" for o in row.get("others", ())
    )


def _published_hazards() -> dict[str, str]:
    """Returns the published precision and recall in % as text, by our name of the hazard."""
    rows = published_rows(Source.HAZARDS, "hazard")
    return {
        ours: f"{r['precision_pct_computed']:.2f} / {r['recall_pct_computed']:.2f}"
        for ours, theirs in HAZARDS.items()
        for r in [rows[theirs]]
    }


def routes(evaluation: Row, truth: str) -> Table:
    """Returns the table of found / false / missed per route; for "world" the published towns, too."""

    def counts(hazard: str, row: Row) -> str:
        return " / ".join(map(str, row["counts"].get(hazard, ["-"])))

    return _by_route(evaluation, truth, counts, "Found / false / missed per route")


def route_ratios(evaluation: Row, truth: str) -> Table:
    """Returns the table of precision and recall per route, made from the counts; published towns, too."""

    def ratios(hazard: str, row: Row) -> str:
        if not (counts := row["counts"].get(hazard)):
            return "-"
        found = Tally(*counts)
        return f"{ratio_text(found.precision)} / {ratio_text(found.recall)}"

    note = "From the counts above. A dash: nothing was found, or nothing was there to find."
    return _by_route(evaluation, truth, ratios, "Precision / recall per route, %", note)


def _by_route(
    evaluation: Row,
    truth: str,
    of_hazard: Callable[[str, Row], str],
    caption: str,
    note: str = "",
) -> Table:
    """Returns a table with a row per route and identifier, and a column per hazard."""
    judged = [r["rules"] for r in headline(evaluation) if r["truth"] == truth]
    by_route = {i: evaluation["by_route"][f"{i}/{truth}"] for i in judged}
    rows: list[Row] = [
        {"route": route, "identifier": words(i), "counts": by_route[i].get(route, {})}
        for route in sorted({route for i in judged for route in by_route[i]})
        for i in judged
    ]
    if truth == "world":
        rows += _published_towns()

    def cell(of: Any, row: Row) -> Cell:
        return Cell(of(row), kind=row.get("kind", ""))

    columns: list[Column[Row]] = [
        Column("route", partial(cell, lambda r: r["route"])),
        Column("identifier", partial(cell, lambda r: r["identifier"])),
        *(Column(words(h), partial(cell, partial(of_hazard, h))) for h in HAZARDS),
    ]
    return table(columns, rows, f"{caption}, {short(truth)}", note)


def _published_towns() -> list[Row]:
    """Returns the published counts as rows per town: [tp, fp, fn] by our name of the hazard."""
    towns: dict[str, dict[str, list[int]]] = {}
    ours = {theirs: ours for ours, theirs in HAZARDS.items()}
    for r in read_published(Source.HAZARDS_BY_TOWN).to_dicts():
        numbers = [r["true_positives"], r["false_positives"], r["false_negatives"]]
        towns.setdefault(f"town {r['town']}", {})[ours[r["hazard"]]] = numbers
    marks = {"identifier": "published", "kind": "published"}
    return [{"route": town, "counts": counts, **marks} for town, counts in towns.items()]


CAUSE_COLUMNS: tuple[Column[Row], ...] = (
    Column("hazard", lambda c: words(c["hazard"])),
    Column("mistake", lambda c: "missed" if c["missed"] else "false alarm"),
    Column("cause", lambda c: c["cause"],
           "the first that applies; of a miss the clause that held least often"),
    Column("identifier", lambda c: words(c["rules"])),
    Column("truth", lambda c: short(c["truth"])),
    Column("count", partial(count, "count")),
)  # fmt: skip


def causes(evaluation: Row) -> Block:
    """Returns the table of why identifiers erred (C-215); a sentence where none did."""
    if not evaluation["causes"]:
        return Text("No identifier made a mistake.")
    return table(CAUSE_COLUMNS, evaluation["causes"], "Causes of mistakes, most frequent first")


AGREEMENT_COLUMNS: tuple[Column[Row], ...] = (
    Column("hazard", lambda r: words(r["hazard"])),
    *_counts(
        {
            "tp": ("in both", ""),
            "fp": ("only in the world model", "ghosts, pessimistic predictions"),
            "fn": ("only in the simulator", "unseen, or predicted away"),
        }
    ),
    _ratio("precision", "share of the world model's that is real"),
    _ratio("recall", "share of the real that the world model has"),
)


def agreement(evaluation: Row) -> Table:
    """Returns a table that scores world-model truth as a detector of simulator truth (C-212)."""
    rows = [{"hazard": hazard, **row} for hazard, row in evaluation["truths_agree"].items()]
    caption = "World-model truth as if it were a detector of simulator truth"
    return table(AGREEMENT_COLUMNS, rows, caption)


SEGMENT = Format(".3f", absent="")
SEGMENT_COLUMNS: tuple[Column[Row], ...] = (
    Column("recording", lambda s: s["name"]),
    Column("route", lambda s: s["route"]),
    Column("h", partial(count, "hours"), format=SEGMENT),
    Column("objects", partial(count, "objects_mean"), format=SEGMENT),
    Column("mean", partial(count, "total_mean_ms"), unit="ms", format=SEGMENT),
    Column("99.9 %", partial(count, "total_p999_ms"), unit="ms", format=SEGMENT),
    Column("greatest", partial(count, "total_max_ms"), unit="ms", format=SEGMENT),
)


def segments(evaluation: Row) -> Table:
    """Returns the table of every segment, with the monitor's processor time."""
    caption = "Every segment, with the monitor's processor time per cycle"
    return table(SEGMENT_COLUMNS, evaluation["segment_table"], caption)
