"""`skidpad risk`: the answer is that of the runs, resumes, and says what it does not know."""

import numpy as np
import pytest
from typer.testing import CliRunner

from skidpad.cli.main import app
from skidpad.core.errors import ConfigError, OutputError
from skidpad.core.maths.space import Normal, Uniform, Variable
from skidpad.recording.campaign.risks import RISK_RUNS, SCALES, read_risk, read_risk_found
from skidpad.recording.campaign.searches import Trial, read_trials
from skidpad.search.exposure import read_exposure
from skidpad.search.probability import Weighted
from skidpad.search.risk import influence_of
from support.report_page import read_page

CALL = (
    "ghost_cut_in", "--vary", "GhostS=25:60", "--vary", "GhostSpeed=15:23", "--vary", "MergeDistance=2:8",
    "--stack", "4", "--workers", "1", "--duration", "10", "--repetitions", "2", "--per-level", "50",
    "--samples", "100",
)  # fmt: skip


def risk(*call):
    return CliRunner().invoke(app, ["risk", *map(str, call)], catch_exceptions=False)


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    folder = tmp_path_factory.mktemp("risk")
    exposure = folder / "exposure.yaml"
    exposure.write_text("per_hour: {value: 0.5, source: 'assumed here'}\n")
    out = folder / "out"
    result = risk(*CALL, "--exposure", exposure, "--out", out)
    assert result.exit_code == 0, result.output
    return out, exposure, result.stdout


def test_counting_is_the_share_of_failures_of_the_first_draws(done):
    out, _, _ = done
    trials, found = read_trials(out, RISK_RUNS), read_risk_found(out)
    counted = found.probabilities[0]
    first = trials[: counted.runs]
    assert counted.runs == 2 * 50
    assert counted.p == pytest.approx(sum(t.is_failure for t in first) / counted.runs)
    assert counted.simulated_s == pytest.approx(sum(t.simulated_s for t in first))


def test_the_text_tells_answer_interval_and_rate(done):
    out, _, text = done
    asked, found = read_risk(out), read_risk_found(out)
    assert f"{found.p:.2g} [{found.low:.2g}, {found.high:.2g}] per encounter" in text
    assert f"Per hour, with 0.5 encounters: {0.5 * found.p:.2g} crashes" in text
    assert asked.assumptions == ["GhostS", "GhostSpeed", "MergeDistance"]
    page = read_page(out / "report.html")
    assert text.splitlines()[0] in page
    assert "Inputs without a source: GhostS, GhostSpeed, MergeDistance." in page


def test_what_was_cut_off_ends_alike(done, tmp_path):
    out, exposure, text = done
    with pytest.raises(OutputError, match="give --resume"):
        risk(*CALL, "--exposure", exposure, "--out", out)
    before = (out / RISK_RUNS).read_bytes()
    (out / RISK_RUNS).write_bytes(before[: len(before) // 2])
    again = risk(*CALL, "--exposure", exposure, "--out", out, "--resume")
    assert again.stdout == text
    assert (out / RISK_RUNS).read_bytes() == before


def test_weighing_anew_is_the_probability_with_the_changed_input():
    """A failure is a value above 11: with values 1.1 times as large, the share above 11 / 1.1."""
    rng, law = np.random.default_rng(2), Normal(10.0, 1.0)
    units = rng.random(20000)
    trials = [
        Trial(number=k, unit=(u,), values={}, margin=-1.0 if law.value(u) > 11.0 else 1.0)
        for k, u in enumerate(units)
    ]
    margins = np.array([t.margin for t in trials])
    found = influence_of(
        Variable("x", law), 0, trials, Weighted(np.empty((0, 0)), np.ones(20000), margins)
    )
    share = 1.0 - law.share_below(11.0)
    for scale, factor in zip(SCALES, found.factors, strict=True):
        expected = (1.0 - law.scale_by(scale).share_below(11.0)) / share
        assert factor is None or factor == pytest.approx(expected, rel=0.15)
    assert found.factors[1] is not None
    assert found.factors[2] is not None
    wide = influence_of(Variable("x", Uniform(0.0, 20.0)), 0, trials, Weighted(
        np.empty((0, 0)), np.ones(20000), margins))  # fmt: skip
    assert wide.factors[3] is None
    assert "never drawn" in wide.why_not


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("variable: {}", "unknown key 'variable'"),
        ("variables: {GhostS: 3}", "variables.GhostS must be a mapping, got 3"),
        ("variables: {GhostS: {law: 3}}", "law must be a text"),
        ("variables: {GhostS: {law: '3:2'}}", "variables.GhostS: GhostS: the range 3:2 is empty"),
        ("per_hour: {value: 0}", "per_hour.value must be a number above 0, got 0"),
        ("per_100km: {value: 1, sauce: x}", "unknown key 'sauce'"),
    ],
)
def test_a_wrong_exposure_is_refused_in_one_sentence(text, complaint, tmp_path):
    path = tmp_path / "exposure.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError) as caught:
        read_exposure(path)
    assert complaint in str(caught.value)
    assert "exposure.yaml" in str(caught.value)
    assert "\n" not in str(caught.value)
