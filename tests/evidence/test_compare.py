from dataclasses import replace

import polars as pl
import pytest
from lxml import etree
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import ConfigError
from skidpad.evidence.compare import compare_campaigns, parse_rule
from skidpad.recording.matrix import MATRIX, Metrics, RunKey


def rows(extra=0, seeds=range(1, 9), outcome="completed"):
    return [
        (
            RunKey(
                config=c,
                weather="clear-noon",
                precipitation_kind="clear",
                time_of_day="noon",
                seed=s,
                profile="recommended",
                map="figure8",
                sensors="objects",
                grip="none",
                range="none",
                outcome=outcome,
                log_hash=f"{c}{s}{extra if c == '2' else 0}",
            ),
            Metrics(fatal_collisions=s % 3 + (extra if c == "2" else 0), mean_speed_kmh=50.0 + s),
        )
        for c in ("1", "2")
        for s in seeds
    ]


def by(changes):
    return {(c.config, c.column): c for c in changes}


def test_differences_are_paired_per_driver_and_equal_drives_counted():
    changes, _, _ = compare_campaigns(
        MATRIX.table(rows()), MATRIX.table(rows(extra=2)), ["fatal_collisions"]
    )
    table = by(changes)
    assert table["1", "fatal_collisions"].comparison.mean == 0.0
    assert table["1", "fatal_collisions"].same == 8
    assert table["2", "fatal_collisions"].comparison.mean == 2.0
    assert table["2", "fatal_collisions"].same == 0
    assert table["", "fatal_collisions"].comparison.mean == 1.0


def test_runs_without_a_partner_are_counted_and_none_in_common_is_refused():
    _, alone_a, alone_b = compare_campaigns(
        MATRIX.table(rows()), MATRIX.table(rows(seeds=range(5, 12))), ["mean_speed_kmh"]
    )
    assert (alone_a, alone_b) == (8, 6)
    with pytest.raises(ConfigError, match="share no run"):
        compare_campaigns(MATRIX.table(rows()), MATRIX.table(rows(seeds=[99])), ["mean_speed_kmh"])


def test_a_rule_that_cannot_be_read_says_how_to_write_one():
    with pytest.raises(ConfigError, match="COLUMN > NUMBER"):
        parse_rule("fatal_collisions increases")
    with pytest.raises(ConfigError, match="unknown column 'colour'"):
        parse_rule("colour > 1")


def test_the_command_fails_on_a_regression_and_writes_junit(tmp_path):
    MATRIX.write(tmp_path / "a", rows())
    MATRIX.write(tmp_path / "b", rows(extra=2))
    run = CliRunner().invoke
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--junit", str(tmp_path / "j.xml")]
    assert run(app, [*call, "--fail-if", "fatal_collisions > 0.5"]).exit_code == 1
    suite = etree.parse(tmp_path / "j.xml").getroot()
    assert suite.get("failures") == "1"
    assert run(app, [*call, "--fail-if", "mean_speed_kmh < -1"]).exit_code == 0


def test_surely_needs_the_whole_interval(tmp_path):
    noisy = MATRIX.table(rows())
    noisy = noisy.with_columns(pl.col("fatal_collisions") + pl.Series([3, -2] * 8))
    changes, _, _ = compare_campaigns(MATRIX.table(rows()), noisy, ["fatal_collisions"])
    rule = parse_rule("fatal_collisions > 0")
    assert rule.broken_by(by(changes)["", "fatal_collisions"], surely=False)
    assert not rule.broken_by(by(changes)["", "fatal_collisions"], surely=True)


def told(tmp_path, before, after, *more):
    """Exit code of the gate, and the names of JUnit's cases with their failures."""
    MATRIX.write(tmp_path / "a", before)
    MATRIX.write(tmp_path / "b", after)
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--junit", str(tmp_path / "j.xml")]
    ended = CliRunner().invoke(app, [*call, "--fail-if", "fatal_collisions > 0.5", *more])
    cases = etree.parse(tmp_path / "j.xml").getroot()
    return ended.exit_code, {c.get("name"): len(c) for c in cases}


def emptied(rows, config):
    return [(k, Metrics() if k.config == config else m) for k, m in rows]


def crashed(rows, n):
    return [
        (replace(k, outcome="crashed"), None) if i < n else (k, m) for i, (k, m) in enumerate(rows)
    ]


@pytest.mark.parametrize(
    ("after", "flaw"),
    [
        (crashed(rows(), 5), "crashed"),
        (crashed(rows(), 16), "crashed"),
        (rows()[1:], "missing"),
        (emptied(rows(), "2"), "empty"),
    ],
)
def test_the_gate_is_red_on_what_was_not_driven_unless_allowed(tmp_path, after, flaw):
    code, cases = told(tmp_path, rows(), after)
    assert code == 1
    assert cases[f"data: {flaw}"] == 1
    allowed = [flaw, "empty"]  # where all crashed there is nothing to compare either
    code, cases = told(tmp_path, rows(), after, *(w for f in allowed for w in ("--allow", f)))
    assert code == 0
    assert cases[f"data: {flaw}"] == 0


def test_a_rule_without_a_number_is_one_sentence():
    with pytest.raises(ConfigError, match=r"'1\.2\.3' is no number"):
        parse_rule("fatal_collisions > 1.2.3")
