"""`skidpad compare A B`: what changed between two campaigns; a gate for CI."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from skidpad.evidence.compare import Change, Rule

SHOWN = (
    "fatal_collisions",
    "crashes_vehicle",
    "road_departures",
    "lane_invasions",
    "ttc_below_1_5_s",
    "min_gap_true_m",
    "mean_speed_kmh",
    "dropout_pct",
    "mean_error_m",
)


def compare(
    a: Annotated[Path, typer.Argument(help="The campaign before.")],
    b: Annotated[Path, typer.Argument(help="The campaign after.")],
    fail_if: Annotated[
        list[str] | None,
        typer.Option(help="COLUMN > NUMBER about the mean difference B - A; exit 1 when true."),
    ] = None,
    surely: Annotated[
        bool, typer.Option("--surely", help="Only when the whole 95 % interval says so.")
    ] = False,
    junit: Annotated[Path | None, typer.Option(help="Write the rules as JUnit XML.")] = None,
) -> None:
    """Pair two campaigns by configuration, weather and seed; exit 1 on a regression."""
    from skidpad.evidence.compare import compare_campaigns, parse_rule
    from skidpad.recording.results import read_results

    rules = [parse_rule(text) for text in fail_if or []]
    wanted = list(dict.fromkeys([*SHOWN, *(r.column for r in rules)]))
    changes, alone_a, alone_b = compare_campaigns(read_results(a), read_results(b), wanted)
    _print(changes)
    if alone_a or alone_b:
        typer.echo(f"without a partner: {alone_a} runs of {a}, {alone_b} of {b}")
    broken = {
        rule.text: [c for c in changes if c.column == rule.column and rule.broken_by(c, surely)]
        for rule in rules
    }
    if junit is not None:
        _write_junit(junit, rules, broken)
    for text, by in broken.items():
        for c in by:
            who = f"configuration {c.config}" if c.config else "all"
            typer.echo(f"regression ({text}): {who}, {c.comparison.mean:+.3g}", err=True)
    if any(broken.values()):
        raise typer.Exit(1)


def _print(changes: list[Change]) -> None:
    from rich.console import Console
    from rich.table import Table

    from skidpad.evidence.statistics import interval_text, p_text

    table = Table("configuration", "column", "B - A", "interval", "p", "pairs", "same drive")
    for c in changes:
        table.add_row(
            c.config or "all",
            c.column,
            f"{c.comparison.mean:+.3g}",
            interval_text(c.comparison.interval),
            p_text(c.comparison.p),
            str(c.comparison.n),
            str(c.same),
        )
    Console().print(table)


def _write_junit(path: Path, rules: list[Rule], broken: dict[str, list[Change]]) -> None:
    from lxml import etree

    failures = sum(bool(broken[r.text]) for r in rules)
    suite = etree.Element(
        "testsuite", name="skidpad compare", tests=str(len(rules)), failures=str(failures)
    )
    for rule in rules:
        case = etree.SubElement(suite, "testcase", classname="skidpad.compare", name=rule.text)
        for change in broken[rule.text]:
            told = f"{change.config or 'all'}: {change.comparison.mean:+.3g}"
            etree.SubElement(case, "failure", message=told)
    path.write_bytes(etree.tostring(suite, xml_declaration=True, encoding="utf-8"))
