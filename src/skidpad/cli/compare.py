"""`skidpad compare A B`: what changed between two campaigns; a gate for CI."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from skidpad.evidence.compare import Change, Rule


class Flaws(str, Enum):
    """Choices of --allow."""

    missing = "missing"
    crashed = "crashed"
    empty = "empty"


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
    a: Annotated[Path, typer.Argument(help="The campaign before, or one run's folder.")],
    b: Annotated[Path, typer.Argument(help="The campaign after, or one run's folder.")],
    fail_if: Annotated[
        list[str] | None,
        typer.Option(help="COLUMN > NUMBER about the mean difference B - A; exit 1 when true."),
    ] = None,
    surely: Annotated[
        bool, typer.Option("--surely", help="Only when the whole 95 % interval says so.")
    ] = False,
    junit: Annotated[Path | None, typer.Option(help="Write the rules as JUnit XML.")] = None,
    allow: Annotated[
        list[Flaws] | None,
        typer.Option(help="Data that --fail-if would not pass; may be repeated."),
    ] = None,
) -> None:
    """Pair two campaigns by configuration, weather and seed; exit 1 on a regression.

    Rules also fail on runs that are missing or crashed and on columns without values. Of the
    folders of two runs, as a drive by hand leaves one, the metrics are shown side by side.
    """
    from skidpad.core.errors import ConfigError
    from skidpad.evidence.compare import compare_campaigns, flaws, parse_rule
    from skidpad.recording.logfiles import TICKS
    from skidpad.recording.matrix import MATRIX
    from skidpad.recording.results import read_results

    rules = [parse_rule(text) for text in fail_if or []]
    if (junit is not None or allow) and not rules:
        raise ConfigError("--junit and --allow are about the rules of --fail-if, and none is given")
    if all((folder / TICKS).is_file() for folder in (a, b)):
        from skidpad.cli.show import compare_runs

        if rules:
            raise ConfigError("--fail-if judges campaigns, and these are the folders of two runs")
        compare_runs(a, b)
        return
    wanted = list(dict.fromkeys([*SHOWN, *(r.column for r in rules)]))
    before, after = (read_results(folder, MATRIX) for folder in (a, b))
    changes, alone_a, alone_b = compare_campaigns(before, after, wanted)
    _print(changes)
    if alone_a or alone_b:
        typer.echo(f"without a partner: {alone_a} runs of {a}, {alone_b} of {b}")
    failures = {rule.text: _broken(rule, changes, surely) for rule in rules}
    passed = {flaw.value for flaw in allow or []}
    failures |= {
        f"data: {flaw.value}": [] if flaw.value in passed else [sentence]
        for flaw, sentence in (flaws(before, after, rules) if rules else {}).items()
    }
    if junit is not None:
        from skidpad.cli.junit import write_junit

        write_junit(junit, "skidpad compare", failures)
    for text, by in failures.items():
        for sentence in by:
            typer.echo(f"regression ({text}): {sentence}", err=True)
    if any(failures.values()):
        raise typer.Exit(1)


def _broken(rule: Rule, changes: list[Change], surely: bool) -> list[str]:
    """What breaks a rule, in words."""
    return [_told(c) for c in changes if c.column == rule.column and rule.broken_by(c, surely)]


def _told(change: Change) -> str:
    who = f"configuration {change.config}" if change.config else "all"
    return f"{who}, {change.comparison.mean:+.3g}"


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
