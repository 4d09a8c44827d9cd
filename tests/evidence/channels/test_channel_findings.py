"""Synthetic drives in which a finding holds, and the same turned over: the verdict must follow."""

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.channels.findings import FINDINGS, INDICATORS
from skidpad.evidence.verdicts import Verdict, judge

BY_ID = {f.id: f for f in FINDINGS}
HEADLINE = {1, 2, 3, 4, 5, 7, 8, 10, 14, 15, 17, 30, 31}
N = 24
HAZARDS = ("inconsistent_localisation", "ego_tailgating", "ego_tailgated")


def segments(**columns):
    """N segments of ten minutes; a column is a number, or one value per segment."""
    rng = np.random.default_rng(4)
    base = {"name": [f"s{i}" for i in range(N)], "seed": [str(i) for i in range(N)], "hours": 1 / 6}
    table = {}
    for name, value in (base | columns).items():
        values = np.full(N, value) if np.isscalar(value) else np.asarray(value)
        if values.dtype.kind == "f" and name != "hours":
            values = values + rng.normal(0.0, 0.02, N) * np.abs(values)
        table[name] = values
    return pl.DataFrame(table)


def counts(**by_hazard):
    """tp, fp, fn per segment of each hazard."""
    out = {}
    for short, (tp, fp, fn) in by_hazard.items():
        (hazard,) = (h for h in HAZARDS if h.endswith(short))
        out |= {f"tp_{hazard}": tp, f"fp_{hazard}": fp, f"fn_{hazard}": fn}
    return out


def ranked(first, others, last):
    values = dict.fromkeys(INDICATORS, others) | {INDICATORS[0]: first}
    values |= dict.fromkeys(INDICATORS[-3:], last)
    return {f"violations_{i.value}": float(v) for i, v in values.items()}


NIGHT = np.arange(N) % 3 == 0
ROWS = {
    "CF-01": (
        counts(localisation=(9, 0, 1), tailgating=(9, 1, 0), tailgated=(9, 0, 0)),
        counts(localisation=(5, 5, 5), tailgating=(5, 5, 5), tailgated=(5, 5, 5)),
    ),
    "CF-02": (
        counts(localisation=(5, 2, 2), tailgating=(5, 3, 3), tailgated=(9, 0, 1)),
        counts(localisation=(9, 0, 1), tailgating=(9, 0, 1), tailgated=(5, 3, 3)),
    ),
    "CF-03": (
        counts(localisation=(2, 0, 0)) | {"hours": 0.5},  # no false alarm in 4 h says too little
        counts(localisation=(2, 4, 0)),
    ),
    "CF-04": (
        counts(localisation=(9, 0, 1), tailgating=(5, 3, 3), tailgated=(9, 0, 1)),
        counts(localisation=(5, 3, 3), tailgating=(9, 0, 1), tailgated=(5, 2, 2)),
    ),
    "CF-05": (
        counts(tailgating=(1, 4, 0)) | {"false_tailgating_explained": 4},
        counts(tailgating=(1, 4, 0)) | {"false_tailgating_explained": 0},
    ),
    "CF-07": ({"unseen": 3.0, "unseen_found": 0.0}, {"unseen": 3.0, "unseen_found": 3.0}),
    "CF-08": (
        {"night": NIGHT, "world_inconsistent_localisation": np.where(NIGHT, 6, 1)},
        {"night": NIGHT, "world_inconsistent_localisation": np.where(NIGHT, 1, 6)},
    ),
    "CF-10": (ranked(9, 4, 0), ranked(0, 4, 9)),
    "CF-14": (
        {"cross_path_straight_minus_turn": 0.2, "cross_path_moving_minus_standing": 0.2},
        {"cross_path_straight_minus_turn": -0.2, "cross_path_moving_minus_standing": -0.2},
    ),
    "CF-15": (
        {"object_location_few_minus_many": 0.1, "object_trajectory_few_minus_many": 0.1},
        {"object_location_few_minus_many": -0.1, "object_trajectory_few_minus_many": -0.1},
    ),
    "CF-17": ({"steady_standing_minus_moving": 0.5}, {"steady_standing_minus_moving": -0.5}),
    "CF-30": ({"total_p999_ms": 3.0}, {"total_p999_ms": 40.0}),
    "CF-31": ({"motion_prediction_share": 0.7}, {"motion_prediction_share": 0.2}),
}


def verdict(id, table):
    return judge([BY_ID[id]], [table])[0].verdict


def test_every_headline_finding_is_there_and_tested():
    assert {int(i[3:]) for i in BY_ID} == HEADLINE == {int(i[3:]) for i in ROWS}


@pytest.mark.req("C-217", "X-7")
@pytest.mark.parametrize("id", list(ROWS))
def test_the_verdict_follows_the_data_and_turns_with_them(id):
    holds, turned = ROWS[id]
    assert verdict(id, segments(**holds)) is Verdict.SUPPORTED
    assert verdict(id, segments(**turned)) is Verdict.CONTRADICTED


@pytest.mark.parametrize("id", list(ROWS))
def test_without_its_data_a_finding_is_not_testable(id):
    assert verdict(id, segments()) is Verdict.NOT_TESTABLE
    assert judge([BY_ID[id]], [None])[0].verdict is Verdict.NOT_TESTABLE


def test_what_the_simulated_channels_bring_about_is_marked():
    assert {f.id for f in FINDINGS if f.built_in} == {"CF-03", "CF-07", "CF-08", "CF-14"}


def test_a_noisy_difference_is_undecided():
    rng = np.random.default_rng(0)
    table = segments(steady_standing_minus_moving=0.0).with_columns(
        steady_standing_minus_moving=pl.Series(rng.normal(0.02, 0.5, N))
    )
    assert verdict("CF-17", table) is Verdict.UNDECIDED
