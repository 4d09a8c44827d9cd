import re
from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from lxml import etree
from scipy.stats import permutation_test
from typer.testing import CliRunner

import gate_table as gate
from skidpad.cli.main import app
from skidpad.core.errors import ConfigError
from skidpad.core.maths.randomness import stream
from skidpad.evidence.compare import (
    Answer,
    compare_campaigns,
    judge_rules,
    parse_rule,
    seeds_to_fire,
)
from skidpad.evidence.statistics import holm, sign_tests
from skidpad.recording.campaign.matrix import MATRIX, Metrics, RunKey
from skidpad.recording.campaign.results import definitions_of


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
    assert table["1", "fatal_collisions"].runs == 8
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


def test_a_misspelt_column_names_the_nearest_few_and_how_to_list_all(tmp_path):
    for name in "ab":
        MATRIX.write(tmp_path / name, rows())
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--fail-if"]
    with pytest.raises(ConfigError) as found:
        CliRunner().invoke(app, [*call, "intervention > 0"], catch_exceptions=False)
    known = [name for name, _, _ in definitions_of(Metrics)]
    said = str(found.value)
    assert said.startswith("unknown column 'intervention'; did you mean 'interventions'")
    assert said.endswith(f"? All {len(known)} are listed by: skidpad compare --columns")
    assert 1 <= sum(f"'{name}'" in said for name in known) <= 3
    with pytest.raises(ConfigError, match="'xyz'; all \\d+ are listed by: skidpad compare"):
        parse_rule("xyz > 0")
    listed = CliRunner().invoke(app, ["compare", "--columns"])
    assert listed.exit_code == 0
    assert [line.split()[0] for line in listed.stdout.splitlines()[1:]] == known


def test_the_command_fails_on_a_regression_and_writes_junit(tmp_path):
    MATRIX.write(tmp_path / "a", rows())
    MATRIX.write(tmp_path / "b", rows(extra=2))
    run = CliRunner().invoke
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--junit", str(tmp_path / "j.xml")]
    assert run(app, [*call, "--fail-if", "fatal_collisions > 0.5"]).exit_code == 1
    suite = etree.parse(tmp_path / "j.xml").getroot()
    assert suite.get("failures") == "1"
    assert run(app, [*call, "--fail-if", "mean_speed_kmh < -1"]).exit_code == 0


def in_weathers(rows, weathers):
    return [
        (replace(k, weather=f"weather-{w}", log_hash=f"{k.log_hash}{w}"), m)
        for k, m in rows
        for w in range(weathers)
    ]


@pytest.mark.req("T-6")
def test_the_seed_is_the_unit_in_however_many_weathers_it_was_driven():
    for weathers in (1, 6):
        a, b = (MATRIX.table(in_weathers(rows(extra=e), weathers)) for e in (0, 2))
        changes = by(compare_campaigns(a, b, ["fatal_collisions"])[0])
        assert changes["2", "fatal_collisions"].comparison.n == 8
        assert changes["2", "fatal_collisions"].runs == 8 * weathers
        assert changes["2", "fatal_collisions"].comparison.p == 2.0 / 2**8


@pytest.mark.req("T-6")
def test_a_single_configuration_is_judged_once():
    one = [r for r in rows() if r[0].config == "1"]
    changes, _, _ = compare_campaigns(MATRIX.table(one), MATRIX.table(one), ["fatal_collisions"])
    assert [c.config for c in changes] == ["1"]


@pytest.mark.req("T-6")
def test_the_gate_fires_on_the_adjusted_test_and_with_point_on_the_mean(tmp_path):
    noisy = MATRIX.table(rows()).with_columns(pl.col("fatal_collisions") + pl.Series([3, -2] * 8))
    changes, _, _ = compare_campaigns(MATRIX.table(rows()), noisy, ["fatal_collisions"])
    rule = parse_rule("fatal_collisions > 0.2")
    assert {j.answer for j in judge_rules([rule], changes, point=False)} == {Answer.PASSED}
    assert Answer.FIRED in {j.answer for j in judge_rules([rule], changes, point=True)}


@pytest.mark.req("T-6")
def test_rules_and_configurations_are_one_family():
    a, b = (MATRIX.table(rows(extra=e, seeds=range(1, 7))) for e in (0, 2))
    changes, _, _ = compare_campaigns(a, b, ["fatal_collisions", "mean_speed_kmh"])
    rule = parse_rule("fatal_collisions > 0")
    three = judge_rules([rule], changes, point=False)
    assert {(j.change.config, j.p) for j in three} == {("", 3 / 128), ("2", 3 / 128), ("1", 0.5)}
    six = judge_rules([rule, parse_rule("mean_speed_kmh < 0")], changes, point=False)
    assert {j.answer for j in six} == {Answer.UNDECIDED}, (
        "6 / 64 is above 5 %: mid-p alone must not fire"
    )
    assert {j.seeds_needed for j in six} == {7}


@pytest.mark.req("T-6")
@pytest.mark.parametrize("hypotheses", range(1, 40))
def test_the_seeds_needed_are_the_least_with_which_anything_could_fire(hypotheses):
    n = seeds_to_fire(hypotheses)
    assert hypotheses * 2.0**-n <= 0.05
    assert n == 6 or hypotheses * 2.0 ** (1 - n) > 0.05


@pytest.mark.req("T-6")
def test_too_few_seeds_are_said_to_be_undecided_and_an_option_decides_the_exit_code(tmp_path):
    few = [r for r in rows(seeds=range(1, 4)) if r[0].config == "2"]
    worse = [r for r in rows(extra=2, seeds=range(1, 4)) if r[0].config == "2"]
    MATRIX.write(tmp_path / "a", few)
    MATRIX.write(tmp_path / "b", worse)
    call = [
        "compare",
        str(tmp_path / "a"),
        str(tmp_path / "b"),
        "--fail-if",
        "fatal_collisions > 0",
    ]
    red = CliRunner().invoke(app, call)
    assert red.exit_code == 1
    assert "undecided (fatal_collisions > 0)" in red.stderr
    assert "3 seeds: needs about 6 seeds" in red.stderr
    assert "regression" not in red.stderr
    green = CliRunner().invoke(app, [*call, "--undecided", "pass"])
    assert green.exit_code == 0
    assert "needs about 6 seeds" in green.stdout
    assert CliRunner().invoke(app, [*call, "--point"]).exit_code == 1


@pytest.mark.req("X-2")
@pytest.mark.parametrize(
    ("place", "told"), [("x", "may be compared"), ("y", "may not be compared")]
)
def test_the_command_says_whether_hashes_may_be_compared(tmp_path, place, told):
    MATRIX.write(tmp_path / "a", rows(), fingerprints=["x"] * 16)
    MATRIX.write(tmp_path / "b", rows(), fingerprints=[place] * 16)
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b")]
    lines = CliRunner().invoke(app, call).stdout
    assert f"hashes {told}" in lines
    assert lines.splitlines()[-1].startswith(f"Next: skidpad report {tmp_path / 'b'}")


@pytest.mark.parametrize(
    ("before", "after", "told"),
    [
        (rows(), rows(), "Nothing changed: both runs of every pair are the same drive."),
        (rows(), rows()[:-1], "Nothing changed: both runs of every pair are the same drive."),
        (rows(), rows(outcome="crashed"), "No run was finished in both: nothing can be compared."),
        (
            rows(seeds=range(1, 4)), rows(extra=2, seeds=range(1, 4)),
            "6 differences compared: none is beyond chance.",
        ),
        (
            rows(seeds=range(1, 13)), rows(extra=2, seeds=range(1, 13)),
            ("Changed beyond chance: interventions (all configurations, +1) and interventions "
            "(configuration 2, +2)."),
        ),
    ],
    ids=["same", "one alone", "none finished", "few", "many"],
)  # fmt: skip
def test_the_command_ends_with_one_sentence_of_answer(tmp_path, before, after, told):
    MATRIX.write(tmp_path / "a", before)
    MATRIX.write(tmp_path / "b", after)
    done = CliRunner().invoke(app, ["compare", str(tmp_path / "a"), str(tmp_path / "b")])
    assert done.stdout.splitlines()[-2] == told


def test_one_run_without_a_partner_is_told_in_the_singular(tmp_path):
    MATRIX.write(tmp_path / "a", rows())
    MATRIX.write(tmp_path / "b", rows()[:-1])
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b"), "--fail-if", "interventions > 9"]
    told = CliRunner().invoke(app, call)
    assert f"without a partner: 1 run of {tmp_path / 'a'}, 0 of" in told.stdout
    assert "without a partner: 1 run of A, 0 of B" in told.stderr


@pytest.mark.req("T-6")
def test_no_text_of_one_seed_has_a_p_value_or_an_infinity(tmp_path):
    for name, extra in (("a", 0), ("b", 2)):
        MATRIX.write(tmp_path / name, rows(extra=extra, seeds=[1]))
    call = ["compare", str(tmp_path / "a"), str(tmp_path / "b")]
    told = CliRunner().invoke(app, call, env={"COLUMNS": "200"}).stdout
    assert "1 seed says nothing of others" in told
    assert not re.search(r"inf|p [=<]|unbounded|-0\.00", told)


# --- false alarms and power, from simulated counts


def clumped(rng, mean, shape):
    """Counts of variance/mean 3."""
    return rng.negative_binomial(mean / 2.0, 1.0 / 3.0, shape).astype(float)


def fired(differences, columns):
    """Share of trials in which any of so many judged columns fires. differences: (trials, columns, n)."""
    p = sign_tests(differences.reshape(-1, differences.shape[-1]), mid=True)[0].reshape(-1, columns)
    return np.mean([min(holm(row)) <= 0.05 for row in p])


@pytest.mark.req("T-6")
@pytest.mark.parametrize("weathers", [1, 6])
@pytest.mark.parametrize("seeds", [10, 20])
def test_where_nothing_differs_hardly_any_comparison_is_red(weathers, seeds):
    """Six columns; what all weathers of a seed share makes most of their counts."""
    trials, columns = 600, 6
    rng = stream(34, "test", "gate", weathers, str(seeds))
    shared = clumped(rng, 1.0, (2, trials, columns, seeds))
    own = clumped(rng, 0.3, (2, trials, columns, seeds, weathers)).mean(axis=-1)
    d = (shared[1] + own[1]) - (shared[0] + own[0])
    assert fired(d, columns) <= 0.05 + 2.0 * (0.05 * 0.95 / trials) ** 0.5


@pytest.mark.req("T-6")
def test_a_doubled_rate_is_found_as_often_as_by_an_exact_test_of_that_column():
    rng = stream(34, "test", "power")
    trials, seeds = 400, 50
    d = clumped(rng, 2.0, (trials, 1, seeds)) - clumped(rng, 1.0, (trials, 1, seeds))
    exact = np.mean([by_scipy(row[0]) <= 0.05 for row in d])
    assert fired(d, 1) >= exact


@pytest.mark.req("T-6")
@pytest.mark.parametrize("seeds", [10, 20])
def test_a_doubled_rate_of_poisson_counts_is_found_nearly_as_often_as_by_the_test_made_for_them(
    seeds,
):
    assert gate.power(seeds, 1, 2000, 1.0) >= 0.9 * gate.exact_power(seeds, 2000)


def by_scipy(d):
    """One-sided p of sign changes, by another implementation."""
    return permutation_test(
        (d, np.zeros(len(d))),
        lambda x, y, axis: np.mean(x - y, axis=axis),
        permutation_type="samples",
        vectorized=True,
        n_resamples=500,
        alternative="greater",
        rng=np.random.default_rng(1),
    ).pvalue


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
        (crashed(rows(), 2), "crashed"),
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
