"""`skidpad compare A B`: what changed between two campaigns; a gate for CI."""

from __future__ import annotations

from collections import defaultdict
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from skidpad.evidence.comparisons import LIST_COLUMNS, Flaw, parse_comparison

if TYPE_CHECKING:
    import polars as pl

    from skidpad.evidence.compare import Change, Rule, RuleJudgement


class Undecided(str, Enum):
    """Values that the option --undecided takes."""

    fail = "fail"
    let_pass = "pass"


SHOWN = (
    "interventions",
    "crashes_vehicle",
    "road_departures",
    "lane_invasions",
    "ttc_below_1_5_s",
    "min_gap_true_m",
    "mean_speed_kmh",
    "dropout_pct",
    "mean_error_m",
)


def _list_columns(wanted: bool) -> None:
    """Prints every column that a rule can be about, with its meaning, and ends the command."""
    if not wanted:
        return
    from rich.table import Table

    from skidpad.cli.output.tables import table_console
    from skidpad.recording.campaign.matrix import Metrics
    from skidpad.recording.campaign.results import definitions_of

    table = Table("column", "meaning", box=None, pad_edge=False)
    for name, meaning, _ in definitions_of(Metrics):
        table.add_row(name, meaning)
    table_console().print(table, markup=False)
    raise typer.Exit


def compare(
    a: Annotated[Path, typer.Argument(help="The campaign before, or one run's folder.")],
    b: Annotated[Path, typer.Argument(help="The campaign after, or one run's folder.")],
    fail_if: Annotated[
        list[str] | None,
        typer.Option(help="COLUMN > NUMBER about the mean difference B - A; exit 1 when shown."),
    ] = None,
    point: Annotated[
        bool, typer.Option("--point", help="Judge the mean difference alone, without a test.")
    ] = False,
    undecided: Annotated[
        Undecided,
        typer.Option(help="The exit code when there are too few seeds for any outcome to fire."),
    ] = Undecided.fail,
    junit: Annotated[Path | None, typer.Option(help="Write the rules as JUnit XML.")] = None,
    allow: Annotated[
        list[Flaw] | None,
        typer.Option(help="Data that --fail-if would not pass; may be repeated."),
    ] = None,
    _columns: Annotated[
        bool,
        typer.Option(
            "--columns", callback=_list_columns, is_eager=True, help="List all columns and exit."
        ),
    ] = False,
) -> None:
    """Pair two campaigns by configuration, weather and seed; exit 1 on a regression.

    The seed is the unit: its weathers are averaged. A rule fires when the difference is beyond its
    limit at 5 %, corrected for all rules and configurations (Holm). Rules also fail on runs that are
    missing or crashed and on columns without values. Of the folders of two runs, as a drive by hand
    leaves one, the metrics are shown side by side.

    Example: skidpad compare before after --fail-if "interventions > 0"
    """
    from skidpad.cli.options.folders import require_campaigns_or_runs
    from skidpad.core.errors import ConfigError

    if (junit is not None or allow or point) and not fail_if:
        raise ConfigError(
            "--junit, --allow and --point are about the rules of --fail-if, and none is given"
        )
    if require_campaigns_or_runs(a, b):
        if fail_if:
            raise ConfigError("--fail-if judges campaigns, and these are the folders of two runs")
        from skidpad.cli.runs.show import compare_runs

        compare_runs(a, b)
        return
    rules = _read_rules(fail_if or [])
    gate = Gate(point, undecided, {flaw.value for flaw in allow or []})
    failures = _compare(a, b, rules, gate)
    if junit is not None:
        from skidpad.cli.output.junit import write_junit

        write_junit(junit, "skidpad compare", failures)
    for text, by in failures.items():
        if by and text.startswith("data: "):
            typer.echo(f"regression ({text}): {by[0]}", err=True)
    typer.echo(f"Next: skidpad report {b} writes the page of the second campaign")
    if any(failures.values()):
        raise typer.Exit(1)


class Gate(NamedTuple):
    """How the rules of --fail-if are judged."""

    point: bool
    undecided: Undecided
    allowed: set[str]  # flaws of the data that fail nothing


def _read_rules(texts: list[str]) -> list[Rule]:
    """Returns the rules of these texts; one that cannot be read is refused before the tests load."""
    from skidpad.recording.campaign.matrix import Metrics
    from skidpad.recording.campaign.results import definitions_of

    columns = [name for name, _, _ in definitions_of(Metrics)]
    read = [(t, parse_comparison("--fail-if", t, columns, LIST_COLUMNS)) for t in texts]
    from skidpad.evidence.compare import Rule

    return [Rule(text, *parts) for text, parts in read]


def _compare(a: Path, b: Path, rules: list[Rule], gate: Gate) -> dict[str, list[str]]:
    """Prints what changed and what the rules say of it; returns what fails, by rule and flaw of data."""
    from skidpad.cli.output.tables import fit_terminal
    from skidpad.core.text.wording import count_text
    from skidpad.evidence.compare import compare_campaigns, flaws, judge_rules, summarise_changes
    from skidpad.recording.campaign.matrix import MATRIX
    from skidpad.recording.campaign.results import read_results
    from skidpad.recording.fingerprint import comparison_text

    wanted = list(dict.fromkeys([*SHOWN, *(r.column for r in rules)]))
    before, after = (_with_interventions(read_results(folder, MATRIX)) for folder in (a, b))
    changes, alone_a, alone_b = compare_campaigns(before, after, wanted)
    _print(changes)
    typer.echo(fit_terminal(comparison_text(*(_places(t) for t in (before, after)))))
    if alone_a or alone_b:
        typer.echo(f"without a partner: {count_text(alone_a, 'run')} of {a}, {alone_b} of {b}")
    typer.echo(fit_terminal(summarise_changes(changes)))
    judged = judge_rules(rules, changes, point=gate.point)
    failures = {
        rule.text: [j.text for j in _against(rule, judged, gate.undecided)] for rule in rules
    }
    for flaw, sentence in (flaws(before, after, rules) if rules else {}).items():
        failures[f"data: {flaw.value}"] = [] if flaw.value in gate.allowed else [sentence]
    for rule in rules:
        _say(rule, judged, gate.undecided)
    return failures


def _with_interventions(results: pl.DataFrame) -> pl.DataFrame:
    """Returns results with the column `interventions`, which older ones have under its published name."""
    import polars as pl

    return results.with_columns(
        pl.coalesce("interventions", "fatal_collisions").alias("interventions")
    )


def _places(results: pl.DataFrame) -> set[str]:
    """Returns the machines' fingerprints of the rows; empty where some row has none."""
    from skidpad.recording.campaign.results import FINGERPRINT

    if FINGERPRINT not in results.columns or results[FINGERPRINT].has_nulls():
        return set()
    return set(results[FINGERPRINT])


def _against(rule: Rule, judged: list[RuleJudgement], undecided: Undecided) -> list[RuleJudgement]:
    """Returns the judgements for which a rule fails the gate: fired, or undecided if that fails."""
    from skidpad.evidence.compare import Answer

    bad = {Answer.FIRED} | ({Answer.UNDECIDED} if undecided is Undecided.fail else set())
    return [j for j in judged if j.rule is rule and j.answer in bad]


def _say(rule: Rule, judged: list[RuleJudgement], undecided: Undecided) -> None:
    """Prints a line per judgement, to stderr for those that fail the gate."""
    against = _against(rule, judged, undecided)
    for j in judged:
        if j.rule is rule:
            typer.echo(f"{j.answer.value} ({rule.text}): {j.text}", err=j in against)


def _print(changes: list[Change]) -> None:
    """Prints the table of all changes; what so few seeds cannot tell stands once below it."""
    from rich.table import Table

    from skidpad.cli.output.tables import table_console
    from skidpad.evidence.statistics import holm
    from skidpad.evidence.statistics_text import no_limits_text, p_text, range_text

    tested = [c.comparison.p for c in changes]
    adjusted = holm([p for p in tested if p is not None])
    heads = ("config", "column", "B - A", "95 %", f"p of {len(changes)}", "seeds", "same drive")
    table = Table(*heads, box=None, pad_edge=False, padding=(0, 1, 0, 0))
    without: dict[str, list[str]] = defaultdict(list)
    for c in changes:
        found = c.comparison
        if found.interval is None:
            without[no_limits_text(found.n, "seed")].append(f"{c.column} ({c.subject})")
        table.add_row(
            c.config or "all",
            c.column,
            f"{found.mean:+.3g}",
            range_text(found.interval) if found.interval else "-",
            "-"
            if found.p is None
            else p_text(adjusted.pop(0)).removeprefix("p ").removeprefix("= "),
            str(found.n),
            f"{c.same} of {c.runs}",
        )
    table_console().print(table)
    for sentence, columns in without.items():
        everywhere = len(columns) == len(changes)
        typer.echo(sentence if everywhere else f"{sentence}: {', '.join(columns)}")
