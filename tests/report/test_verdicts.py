from dataclasses import replace

import polars as pl
import pytest

from skidpad.evidence.contrasts import Never
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.verdicts import Judgement, Verdict, judge
from skidpad.report.elements.verdicts import plain, tally_text


def judged(verdict, seeds=None):
    return Judgement(FINDINGS[0], verdict, 0.01, (), seeds, "numbers")


@pytest.mark.parametrize(
    ("verdict", "said"),
    [
        (Verdict.SUPPORTED, "show it"),
        (Verdict.CONTRADICTED, "show the opposite"),
        (Verdict.UNDECIDED, "would take about 40 seeds"),
        (Verdict.BY_CONSTRUCTION, "the same drive:"),
        (Verdict.SAME_DRIVES, "never came into play"),
        (Verdict.NOT_TESTABLE, "cannot test it"),
        (Verdict.REFUSED, "numbers"),
    ],
)
def test_every_verdict_has_its_plain_sentence(verdict, said):
    assert said in plain(judged(verdict, 40))


@pytest.mark.parametrize(("broken", "said"), [(0, "more runs may bring one"), (1, "one is enough")])
def test_claims_that_cases_decide_say_nothing_of_chance(broken, said):
    claim = replace(FINDINGS[0], criteria=(Never("cases", lambda table: (broken, 4)),))
    (one,) = judge([claim], [pl.DataFrame({"seed": [1, 2]})])
    assert said in plain(one)
    assert "chance" not in plain(one)


def test_the_tally_counts_every_claim_once():
    empty = judge(FINDINGS, [None] * len(FINDINGS))
    assert (
        tally_text(empty)
        == f"Of {len(FINDINGS)} claims of the published study: {len(FINDINGS)} not testable."
    )
    mixed = [judged(Verdict.SUPPORTED), judged(Verdict.UNDECIDED), judged(Verdict.SUPPORTED)]
    assert tally_text(mixed) == "Of 3 claims of the published study: 2 supported, 1 undecided."


@pytest.mark.req("R-6")
@pytest.mark.parametrize(("shares", "refused"), [((0.0, 2.0), False), ((0.5, 1.6), True)])
def test_nothing_is_judged_of_drives_off_the_road(shares, refused):
    runs = [{"outcome": "completed", "off_lanes_pct": s} for s in shares]
    table = pl.DataFrame([*runs, {"outcome": "crashed", "off_lanes_pct": 90.0}])
    verdicts = {j.verdict for j in judge(FINDINGS, [None] * len(FINDINGS), astray(table))}
    assert verdicts == {Verdict.REFUSED if refused else Verdict.NOT_TESTABLE}
    assert ("at most 1 %" in astray(table)) is refused
