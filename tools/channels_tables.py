"""Writes the tables of docs/channels-evaluation.md and docs/channels-tables.md from docs/results/channels.

    python tools/channels_tables.py            # writes the pages anew
    python tools/channels_tables.py --check    # exit code 1 when one is not what is made

A table stands between `<!-- table: NAME -->` and `<!-- end -->`; all else on a page is written by hand.
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
PAGES = (ROOT / "docs" / "channels-evaluation.md", ROOT / "docs" / "channels-tables.md")
RESULTS = ROOT / "docs" / "results" / "channels"
FIGURE = RESULTS / "reference.svg"
REFERENCE = "reference "  # before the limit, in the names of rules.json
SLOT = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end -->)", re.DOTALL)
HAZARDS = ("inconsistent_localisation", "ego_tailgating", "ego_tailgated")
FEW = 100  # of the effective size
ON_ICE = "natural (on ice)"
PRECISION = ROOT / "src" / "skidpad" / "fleet" / "insight" / "precision.yaml"
TRACKED = {  # names in rules.json of what `tracked` has, the newest first
    "inconsistent_localisation": ("tracked",),
    "ego_tailgating": ("tracked",),
    "ego_tailgated": ("tracked",),
}
DEFAULT_AND_BEFORE = ("before: a dry road, vote", "tracked")
Rows = list[list[str]]


def main(words: list[str] | None = None) -> int:
    """Writes the pages, or returns 1 when one is out of date (`--check`)."""
    words = sys.argv[1:] if words is None else words
    before = {page: page.read_text(encoding="utf-8") for page in PAGES}
    after = {page: filled(text, RESULTS) for page, text in before.items()}
    known = PRECISION.read_text(encoding="utf-8")
    measured = with_tracked_precision(known, RESULTS)
    if "--check" in words:
        return int(before != after or known != measured)
    for page, text in after.items():
        page.write_text(text, encoding="utf-8")
    if measured != known:
        PRECISION.write_text(measured, encoding="utf-8")
    if (RESULTS / "rules.json").is_file():
        FIGURE.write_text(reference_figure(RESULTS), encoding="utf-8")
    for name, svg in ways_by_file(RESULTS).items():
        (RESULTS / name).write_text(svg, encoding="utf-8")
    return 0


def ways_by_file(results: Path) -> dict[str, str]:
    """The figures of the ways driven, by the name of their file; none where no way is known."""
    from skidpad.report.channels.evaluation.ways import ways_figures

    if not (results / "ways.json").is_file():
        return {}
    drawn = ways_figures(_read(results, "ways"), results)
    return {f"ways-{k + 1}.svg": svg for k, svg in enumerate(drawn)}


def ways(results: Path) -> str:
    """The same figures on the page."""
    shown = [f"![Ways driven, by map](results/channels/{name})\n" for name in ways_by_file(results)]
    return "".join(shown) or "No ways were kept of these drives.\n"


def with_tracked_precision(known: str, results: Path) -> str:
    """The fleet's table of precisions, its last part `tracked` made of the drives among natural drivers."""
    told = _rules_of(results)
    if told is None or "natural" not in told["drives"]:
        return known
    rules = told["drives"]["natural"]["rules"]
    lines = []
    for hazard, names in TRACKED.items():
        row = next(rules[name][hazard] for name in names if hazard in rules.get(name, {}))
        if not row["tp"] + row["fp"]:
            continue
        said = f'"true": {row["tp"]}, "false": {row["fp"]}'
        if row["precision_interval"] is not None:
            low, high = row["precision_interval"]
            said += f", low: {low:.3f}, high: {high:.3f}"
        lines.append(f"  {hazard}: {{{said}}}\n")
    return known[: known.index("tracked:\n")] + "tracked:\n" + "".join(lines)


def filled(page: str, results: Path) -> str:
    """The page with every table made anew; as it is where there are no results."""
    if not (results / "run.json").is_file():
        return page
    return SLOT.sub(lambda m: m[1] + TABLES[m[2]](results) + m[3], page)


def driven(results: Path) -> str:
    """When, where and how much."""
    run, report = _read(results, "run"), _read(results, "report")
    parts = report["strata"] | _on_ice(results)
    hours = ", ".join(
        f"{part['hours']:.2f} h among {drivers} drivers ({_segments(part)})"
        for drivers, part in parts.items()
    )
    model = report["model"]
    learned = (
        "" if model is None
        else f" The learned identifier was trained on {model['hours']:.2f} h of other drives."
    )  # fmt: skip
    seed = run["first_seed"]["report"]
    return (
        f"Driven {run['date']} at commit `{run['commit']}` on {run['processors']} processors, seeds from "
        f"{seed}: {hours}.{learned}\n"
    )


def scores(results: Path) -> str:
    """Every identifier among natural drivers against the simulator's truth."""
    return _scores(_read(results, "report")["strata"].get("natural"))


def ice(results: Path) -> str:
    """The same on ice."""
    return _scores(_on_ice(results).get(ON_ICE))


def _on_ice(results: Path) -> dict[str, Any]:
    """That part by its name; nothing where it was not driven."""
    if not (results / "ice.json").is_file():
        return {}
    return {ON_ICE: _read(results, "ice")["strata"]["natural"]}


def _scores(part: dict[str, Any] | None) -> str:
    if part is None:
        return "No natural drivers were driven among.\n"
    head = ["identifier", "hazard", "found", "false", "missed", "precision, % [95 %]",
            "recall, % [95 %]", "false per h"]  # fmt: skip
    rows = [
        [
            _words(r["rules"]), _words(hazard), str(row["tp"]), str(row["fp"]), str(row["fn"]),
            _share(row, "precision"), _share(row, "recall"), f"{row['false_alarms_per_hour']:.1f}",
        ]
        for r, hazard, row in _results(part, "sim")
    ]  # fmt: skip
    return _table(head, rows)


def missed(results: Path) -> str:
    """Weighted recall among risky drivers, with the effective size."""
    part = _read(results, "report")["strata"].get("risky")
    if part is None:
        return "No risky drivers were driven among.\n"
    head = ["identifier", "hazard", "true", "found", "weighted recall, % [95 %]", "effective size"]
    rows = [
        [
            _words(r["rules"]), _words(hazard), str(row["tp"] + row["fn"]), str(row["tp"]),
            _share(row, "recall_weighted"),
            f"{row['effective_size']:.0f}" + (", too few" if row["effective_size"] < FEW else ""),
        ]
        for r, hazard, row in _results(part, "sim")
    ]  # fmt: skip
    return _table(head, rows)


def curves(results: Path) -> str:
    """Best harmonic mean on each curve."""
    head = ["drivers", "identifier", "hazard", "limit", "precision, %", "recall, %"]
    rows: Rows = []
    parts = _read(results, "report")["strata"] | _on_ice(results)
    for stratum, part in parts.items():
        for identifier, by_hazard in part["precision_recall"].get("sim", {}).items():
            for hazard, points in by_hazard.items():
                best = max(points, key=lambda p: _harmonic(p[1], p[2], p[3]))
                limit, tp, fp, _, found, true = best
                if not tp:
                    continue
                precision, recall = 100.0 * tp / (tp + fp), 100.0 * found / true
                rows.append(
                    [stratum, _words(identifier), _words(hazard), f"{limit:g}", f"{precision:.0f}",
                     f"{recall:.0f}"]
                )  # fmt: skip
    return _table(head, rows) if rows else "No identifier found anything at any limit.\n"


def redundancy(results: Path) -> str:
    """What became of the drives by driver."""
    told = _read(results, "redundancy")
    head = ["driven by", "segments", "h", "km", "collisions", "red lights run", "stalls"]
    rows = [
        [row["drive_by"], str(row["segments"]), f"{row['hours']:.2f}", f"{row['km']:.1f}"]
        + [_rate(row["rates"][e]) for e in ("collisions", "red_lights_run", "stalls")]
        for row in told["drivers"]
    ]
    if not rows:
        return "Not driven.\n"
    when = (
        f"Driven {told['date']} at commit `{told['commit']}`, seeds from {told['first_seed']}.\n\n"
    )
    return when + _table(head, rows)


def rules(results: Path) -> str:
    """Today's rules and those that were tried, on the same drives; the judged kinds alone."""
    return _rules_table(results, "rules")


def answer(results: Path) -> str:
    """Returns the default rules beside the ones before them, on the same drives."""
    return _rules_table(results, "rules", only=DEFAULT_AND_BEFORE)


def variants(results: Path) -> str:
    """The same on further drives, with variants that came later."""
    return _rules_table(results, "variants")


def further(results: Path) -> str:
    """Returns what was found on the hours that were registered for one variant of positions."""
    return _rules_table(results, "further", HAZARDS[:1])


def _rules_table(
    results: Path, name: str, hazards: tuple[str, ...] = HAZARDS, only: tuple[str, ...] = ()
) -> str:
    told = _rules_of(results, name)
    if told is None:
        return "Not driven.\n"
    seeds = ", ".join(map(str, told["first_seeds"]))
    head = ["drives", "hazard", "rule", "true", "found", "false", "precision, % [95 %]",
            "recall, % [95 %]", "false per h [95 %]"]  # fmt: skip
    rows = [
        [drives, _words(hazard), rule, _count_true(row), str(row["tp"]), str(row["fp"]),
         _share(row, "precision"), _share(row, "recall"), _false_rate(row)]
        for drives, part in told["drives"].items()
        for hazard in hazards
        for rule, of in part["rules"].items()
        if (row := of.get(hazard)) and row["tp"] + row["fn"] and not rule.startswith(REFERENCE)
        and (not only or rule in only)
    ]  # fmt: skip
    hours = ", ".join(f"{p['hours']:.2f} h {n} ({_segments(p)})" for n, p in told["drives"].items())
    when = f"Driven {told['date']} at commit `{told['commit']}`, seeds from {seeds}: {hours}."
    return f"{when}{_cost(told)}\n\n{_table(head, rows)}"


def _cost(told: dict[str, Any]) -> str:
    """Processor time of what was driven; nothing where it was not measured."""
    if "cpu_s_per_hour" not in told:
        return ""
    of, failed = told["cpu_s_per_hour"], told["failed"]
    lost = f" {failed} segments failed and count as not driven." if failed else ""
    return (
        f" One driven hour takes {of['driving']:.0f} s of processor time to drive and "
        f"{of['judging']:.0f} s to judge by all rules.{lost}"
    )


def rarity(results: Path) -> str:
    """How many true hazards of each kind there were, and how many hours would bring enough of them."""
    told = _rules_of(results)
    if told is None:
        return "Not driven.\n"
    head = ["drives", "hazard", "true", "per h", f"hours that bring {FEW}"]
    rows = []
    for drives, part in told["drives"].items():
        for hazard in HAZARDS:
            row = next(of[hazard] for of in part["rules"].values() if hazard in of)
            true, hours = row["tp"] + row["fn"], part["hours"]
            need = f"{FEW * hours / true:.0f}" if true else f"more than {hours:.0f}"
            rows.append([drives, _words(hazard), _count_true(row), f"{true / hours:.2f}", need])
    return _table(head, rows)


def reference(results: Path) -> str:
    """The curve of the reference with hindsight, whose figure `reference_figure` draws."""
    told = _rules_of(results)
    if told is None or "reference" not in told:
        return "Not driven.\n"
    head = ["drives", "hazard", "limit", "precision, %", "recall, %"]
    rows = [
        [drives, _words(hazard), f"{limit:g}", f"{100.0 * precision:.1f}", f"{100.0 * recall:.1f}"]
        for drives, hazard, points in reference_curves(told)
        for limit, recall, precision in points
    ]
    return _table(head, rows)


def reference_curves(told: dict[str, Any]) -> Iterator[tuple[str, str, list[list[float]]]]:
    """Per kind of drives and hazard: limit, recall and precision of every point that is one."""
    for drives, part in told["reference"]["drives"].items():
        for hazard in HAZARDS:
            points = [
                [float(name.removeprefix(REFERENCE)), row["recall"], row["precision"]]
                for name, of in part["rules"].items()
                if name.startswith(REFERENCE) and (row := of.get(hazard))
                if row["recall"] is not None and row["precision"] is not None
            ]
            if points:
                yield drives, hazard, points


def reference_figure(results: Path) -> str:
    """Precision over recall of the reference, one chart per hazard, one line per kind of drives."""
    from skidpad.report.elements.figures import Chart, Curve, curves

    found = list(reference_curves(_rules_of(results) or {"reference": {"drives": {}}}))
    names = list(dict.fromkeys(drives for drives, *_ in found))
    charts = [
        Chart(
            [
                Curve(
                    drives, [p[1] for p in points], [p[2] for p in points],
                    colour=names.index(drives), style={"marker": ".", "ms": 5},
                )
                for drives, of, points in found
                if of == hazard
            ],
            "recall", "precision", _words(hazard), y_range=(-0.03, 1.03), x_range=(-0.03, 1.03),
        )
        for hazard in HAZARDS
    ]  # fmt: skip
    return curves(charts, width=11.0, height=3.6)


def _rules_of(results: Path, name: str = "rules") -> Any:
    return _read(results, name) if (results / f"{name}.json").is_file() else None


def _count_true(row: dict[str, Any]) -> str:
    true = row["tp"] + row["fn"]
    return f"{true}" + (", too few" if true < FEW else "")


def _false_rate(row: dict[str, Any]) -> str:
    limits = row["false_alarms_interval"]
    said = f"{row['false_alarms_per_hour']:.1f}"
    return said if limits is None else f"{said} [{limits[0]:.1f}, {limits[1]:.1f}]"


TABLES: dict[str, Callable[[Path], str]] = {
    "answer": answer, "driven": driven, "scores": scores, "missed": missed, "ice": ice, "curves": curves,
    "redundancy": redundancy, "rules": rules, "reference": reference, "rarity": rarity,
    "ways": ways, "variants": variants, "further": further,
}  # fmt: skip


def _results(part: dict[str, Any], truth: str) -> Iterator[tuple[dict[str, Any], str, Any]]:
    for result in part["results"]:
        if result["truth"] == truth:
            for hazard in HAZARDS:
                yield result, hazard, result["hazards"][hazard]


def _share(row: dict[str, Any], name: str) -> str:
    value, limits = row[name], row.get(f"{name}_interval")
    if value is None:
        return "-"
    said = f"{100.0 * value:.1f}"
    return said if limits is None else f"{said} [{100.0 * limits[0]:.1f}, {100.0 * limits[1]:.1f}]"


def _rate(rate: list[float | None]) -> str:
    events, per_hour, low, high = rate
    limits = "" if low is None or high is None else f" [{low:.1f}, {high:.1f}]"
    return f"{events:.0f}, {per_hour:.1f} per h{limits}"


def _harmonic(tp: float, fp: float, fn: float) -> float:
    return 2.0 * tp / max(2.0 * tp + fp + fn, 1.0)


def _segments(part: dict[str, Any]) -> str:
    return "1 segment" if part["segments"] == 1 else f"{part['segments']} segments"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _table(head: list[str], rows: Rows) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(line) + " |\n" for line in lines)


def _read(results: Path, name: str) -> Any:
    return json.loads((results / f"{name}.json").read_text(encoding="utf-8"))


if __name__ == "__main__":
    sys.exit(main())
