"""The page on natural and risky drivers: recall by stratum, curves, the reference with hindsight."""

from __future__ import annotations

import json

import numpy as np
import pytest

from skidpad.evidence.channels.judging.evaluation import Evaluation
from skidpad.evidence.channels.judging.segments import judge
from skidpad.recording.channels.cycles import cycles
from skidpad.report.channels.evaluation.page import evaluation_page
from support.channel_worlds import Eyes, World, drive

EYES = (Eyes("a", 0.02), Eyes("b", 0.02, blind=(0,)))


@pytest.fixture(scope="module")
def evaluation():
    segments = []
    for i, stratum in enumerate(("natural", "risky", "risky")):
        world = World((0, 0, 0, 15.0, 0), np.array([(-10.5 - 0.1 * i, 0, 0, 15.7, 0)]))
        source = drive(world, EYES, 8.0)
        context = {"stratum": stratum, "weights": json.dumps({"0": [0.25, 1.0]}), "seed": str(i)}
        segments.append(
            judge(f"s{i}", "route-1", source.channels, list(cycles(source)), context=context)
        )
    return json.loads(json.dumps(Evaluation(segments).as_dict(), allow_nan=False))


def section(page, title):
    (found,) = [s for s in page.sections if s.title == title]
    return found


@pytest.mark.req("C-2", "C-105")
def test_recall_stands_per_stratum_and_precision_does_not(evaluation, tmp_path):
    page = evaluation_page(evaluation, tmp_path)
    _, table = section(page, "Natural and risky drivers").blocks
    head = [name.split(",")[0] for name, *_ in table.columns]
    rows = [dict(zip(head, row, strict=True)) for row in table.rows]
    (tracked,) = [
        r for r in rows
        if (r["drivers"].text, r["identifier"].text, r["hazard"].text)
        == ("Risky drivers", "tracked", "ego tailgated")
    ]  # fmt: skip
    assert (tracked["true"].text, tracked["found"].text) == ("2", "2")
    assert (tracked["recall"].text, tracked["effective size"].text) == ("100.00", "2")
    assert tracked["effective size"].note == "too few"
    assert "precision" not in tracked
    assert {r["drivers"].text for r in rows} == {"Natural drivers", "Risky drivers"}
    first = [b for b in page.sections[0].blocks if b.kind == "answers"]
    assert "ego tailgated 100.00 % of 2" in str(first)


@pytest.mark.req("C-105")
def test_each_stratum_has_its_curves_with_the_reference(evaluation, tmp_path):
    figures = section(evaluation_page(evaluation, tmp_path), "Precision against recall").blocks
    assert len(figures) == 2
    for figure in figures:
        assert "reference" in figure.svg
        assert figure.svg.count("tracked") >= 1
    del evaluation["strata"]
    assert (
        len(section(evaluation_page(evaluation, tmp_path), "Precision against recall").blocks) == 1
    )


def test_one_stratum_alone_says_so(evaluation, tmp_path):
    alone = {**evaluation, "strata": {"natural": {**evaluation, "strata": {}}}}
    (text,) = section(evaluation_page(alone, tmp_path), "Natural and risky drivers").blocks
    assert "--strata natural,risky" in text.text
