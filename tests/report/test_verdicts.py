import pytest

from skidpad.evidence.drive.findings import FINDINGS
from skidpad.evidence.verdicts import Judgement, Verdict, judge
from skidpad.report.verdicts import plain, tally_text


def judged(verdict, seeds=None):
    return Judgement(FINDINGS[0], verdict, 0.01, (), seeds, "numbers")


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (Verdict.SUPPORTED, "show it"),
        (Verdict.CONTRADICTED, "show the opposite"),
        (Verdict.UNDECIDED, "would take about 40 seeds"),
        (Verdict.BY_CONSTRUCTION, "the same drive"),
        (Verdict.NOT_TESTABLE, "cannot test it"),
    ],
)
def test_every_verdict_has_its_plain_sentence(verdict, said):
    assert said in plain(judged(verdict, 40))


def test_the_tally_counts_every_claim_once():
    empty = judge(FINDINGS, [None] * len(FINDINGS))
    assert (
        tally_text(empty)
        == f"Of the sources' {len(FINDINGS)} claims: {len(FINDINGS)} not testable."
    )
    mixed = [judged(Verdict.SUPPORTED), judged(Verdict.UNDECIDED), judged(Verdict.SUPPORTED)]
    assert tally_text(mixed) == "Of the sources' 3 claims: 2 supported, 1 undecided."
