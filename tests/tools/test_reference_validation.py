"""The reference driver against published distributions of human drivers that it was not fitted to."""

from __future__ import annotations

from pathlib import Path

import pytest

from reference_driver import CSV, LINES, compared, measured, table
from skidpad.stack.reference.person import person_of

PAGE = Path(__file__).parents[2] / "docs" / "reference-driver.md"
FEW = range(1, 9)  # seeds; the page has 200
WITHIN = 0.20  # of the human value, as the page says


def test_the_page_shows_the_values_of_the_csv_and_they_are_as_near_as_it_says():
    assert table(CSV) in PAGE.read_text()
    rows = table(CSV).splitlines()[2:]
    assert len(rows) == len(LINES)
    for row in rows:
        assert abs(float(row.split("|")[-2].removesuffix(" % "))) <= 100.0 * WITHIN


def test_a_few_persons_react_follow_and_enter_as_humans_do():
    """With few people the mean and median are compared; who is careful is not nearer than humans."""
    values = measured(person_of(seed) for seed in FEW)
    assert all(len(v) == len(FEW) for v in values.values()), "everybody brakes"
    for line, model in compared(values):
        if line.statistic in ("mean", "50 %"):
            assert model == pytest.approx(line.human, rel=0.35), line
            if "headway" in line.quantity or "gap" in line.quantity:
                assert model > line.human, line
