import json

import msgspec
import numpy as np
import pytest

from skidpad.core.errors import FileError, InputError
from skidpad.evidence.channels.hazards import Signal
from skidpad.evidence.channels.judging.evaluation import Evaluation
from skidpad.evidence.channels.judging.reference import NAME as REFERENCE
from skidpad.evidence.channels.judging.segments import judge
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.drives import DriveOutcome, DriveRecord
from skidpad.report.channels.evaluation.page import (
    _curve,
    evaluation_page,
    redundancy,
    write_evaluation_report,
)
from skidpad.report.channels.evaluation.strata import precision_recall
from skidpad.report.elements.figures import PALETTE
from support.channel_worlds import Eyes, World, drive
from support.svg_values import curves_of, marks_of

EYES = (Eyes("a", 0.02), Eyes("b", 0.02, blind=(0,)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("evaluated")
    segments = []
    for i, (route, gap) in enumerate(((0, 6.0), (1, 45.0), (0, 6.5))):
        world = World(
            (0, 0, 0, 15.0, 0), np.array([(-gap - 4.5, 0, 0, 15.7, 0), (60, 3.5, 0, 15, 0)])
        )
        source = drive(world, EYES, 8.0)
        segments.append(
            judge(
                f"route-{i}.mcap", f"route-{route}", source.channels, list(cycles(source)),
                curve=Signal.GAP, context={"sun_altitude_deg": "-5", "seed": str(i)},
            )
        )  # fmt: skip
    table = Evaluation(segments).as_dict()
    (folder / "evaluation.json").write_text(json.dumps(table, allow_nan=False))
    return folder


def tables(page):
    return {b.caption: b for s in page.sections for b in s.blocks if b.kind == "table"}


@pytest.mark.req("C-210", "C-212", "C-214", "C-215", "C-216", "C-105", "X-6")
def test_the_page_holds_results_causes_verdicts_and_published_numbers(folder):
    text = write_evaluation_report(folder).read_text()
    for word in (
        "simulator truth",
        "world-model truth",
        "macro",
        "micro",
        "CF-30",
        "92.00 / 94.52",
    ):
        assert word in text
    assert "factor on the threshold" in text


@pytest.mark.req("C-216", "C-217")
def test_totals_are_the_sums_of_the_routes(folder):
    page = evaluation_page(json.loads((folder / "evaluation.json").read_text()), folder)
    found = tables(page)
    totals = {
        (row[0].text, row[1].text): [int(c.text) for c in row[2:5]]
        for row in found["World-model truth: what the channels reported, ghosts included"].rows
        if "all" not in row[1].text
    }
    sums = dict.fromkeys(totals, (0, 0, 0))
    routes = found["Found / false / missed per route, world-model truth"]
    hazards = [name for name, _ in routes.columns[2:]]
    for row in routes.rows:
        if row[0].kind == "published":
            continue
        for hazard, cell in zip(hazards, row[2:], strict=True):
            key = row[1].text, hazard
            counts = map(int, cell.text.split(" / "))
            sums[key] = tuple(a + b for a, b in zip(sums[key], counts, strict=True))
    assert {k: tuple(v) for k, v in totals.items()} == sums
    assert totals["practical", "ego tailgated"] == [2, 0, 0]


@pytest.mark.req("C-215")
def test_a_missed_hazard_names_the_clause_that_never_held(folder):
    causes = json.loads((folder / "evaluation.json").read_text())["causes"]
    missed = [c["cause"] for c in causes if c["missed"] and c["rules"] == "as_printed"]
    assert "the channels' objects agreed" in missed  # a gap of 0.5 does not exceed 0.5


@pytest.mark.req("C-010")
def test_redundancy_compares_equal_seeds(tmp_path):
    for driver, collisions in (("arbiter", 0), ("lav_like", 2)):
        for seed in range(8):
            outcome = DriveOutcome(
                route="route-1", seed=seed, drive_by=driver, driven_s=600.0, distance_m=1000.0,
                collisions=collisions + seed % 2, collisions_struck=0, red_lights_run=0, stalls=0,
                ended="time", switches=0, minimal_risk_s=0.0, driving_s={},
            )  # fmt: skip
            path = tmp_path / driver / f"route-1-{seed}.json"
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(msgspec.json.encode(DriveRecord({"drive_by": driver}, outcome)))
    table, text = redundancy(tmp_path)
    assert [row[4].text for row in table.rows] == ["4", "20"]
    assert "lav_like alone less the arbiter, collisions per segment: +2 " in text.text
    assert redundancy(tmp_path / "arbiter")[0].kind == "text"
    assert redundancy(tmp_path / "nothing")[0].kind == "text"


def test_a_folder_without_an_evaluation_is_named(tmp_path):
    with pytest.raises(FileError, match="evaluation"):
        write_evaluation_report(tmp_path)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"{}", "segments"),
        (b"[]", "object"),
        (b"\xff", "evaluation.json"),
        (b'{"segments": 1, "hours": "x"}', "hours"),
    ],
)
def test_a_file_that_is_no_evaluation_is_refused_in_a_sentence(tmp_path, content, said):
    (tmp_path / "evaluation.json").write_bytes(content)
    with pytest.raises(InputError, match=said) as refused:
        write_evaluation_report(tmp_path)
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "report.html").exists()


def test_an_evaluation_that_lost_a_word_is_refused(folder, tmp_path):
    whole = json.loads((folder / "evaluation.json").read_text())
    for word in ("results", "curve", "by_route", "causes", "segment_table", "truths_agree"):
        left = {k: v for k, v in whole.items() if k != word}
        (tmp_path / "evaluation.json").write_text(json.dumps(left))
        with pytest.raises(InputError, match=word):
            write_evaluation_report(tmp_path)
    odd = whole | {"results": [{"truth": "nobody"}]}
    (tmp_path / "evaluation.json").write_text(json.dumps(odd))
    with pytest.raises(InputError):
        write_evaluation_report(tmp_path)


@pytest.mark.req("C-105")
def test_the_curve_over_the_threshold_has_recall_and_false_alarms_of_each_hazard():
    names = ("inconsistent_localisation", "ego_tailgating", "ego_tailgated")
    by_factor = {  # found, false, missed of each hazard
        "0.5": ([4, 8, 0], [3, 2, 1], [1, 0, 3]),
        "1.0": ([3, 4, 1], [2, 1, 2], [0, 0, 4]),
        "2.0": ([1, 0, 3], [1, 0, 3], [0, 0, 4]),
    }
    counts = {f: dict(zip(names, rows, strict=True)) for f, rows in by_factor.items()}
    (figure,) = _curve({"curve": {"sim": counts, "world": {}}, "hours": 2.0})
    recall = ([1.0, 0.75, 0.25], [0.75, 0.5, 0.25], [0.25, 0.0, 0.0])
    false = ([4.0, 2.0, 0.0], [1.0, 0.5, 0.0], [0.0, 0.0, 0.0])
    for colour, found, alarms in zip(PALETTE, recall, false, strict=False):
        lines = dict(curves_of(figure.svg, colour))
        assert lines[0] == pytest.approx(np.column_stack([[0.5, 1.0, 2.0], found]), abs=5e-3)
        assert lines[1] == pytest.approx(np.column_stack([[0.5, 1.0, 2.0], alarms]), abs=2e-2)


@pytest.mark.req("C-105", "C-212")
def test_precision_stands_over_recall_at_each_limit_with_the_reference_as_a_star():
    # limit, right, false, -, weights found and true
    points = [[0.1, 6, 6, 0, 0.75, 1.0], [0.5, 3, 1, 0, 0.5, 1.0], [0.9, 0, 0, 0, 0.0, 1.0]]
    hindsight = [[0.0, 8, 2, 0, 0.9, 1.0], [5.0, 5, 5, 0, 1.0, 1.0]]
    hazards = ("inconsistent_localisation", "ego_tailgating", "ego_tailgated")
    reference = {h: {"recall_weighted": 0.9, "precision": 0.8} for h in hazards}
    part = {
        "hours": 1.0,
        "precision_recall": {
            "sim": {
                "tracked": dict.fromkeys(hazards, points),
                REFERENCE: dict.fromkeys(hazards, hindsight),
            }
        },
        "results": [{"rules": REFERENCE, "truth": "sim", "tolerance_s": 1.0, "hazards": reference}],
    }
    (figure,) = precision_recall({"strata": {"natural": part}})
    lines = curves_of(figure.svg, PALETTE[0])
    assert len([line for _, line in lines if len(line) == 2]) == 3, "one per hazard"
    for _, line in lines:
        assert line == pytest.approx(np.array([[0.75, 0.5], [0.5, 0.75]]), abs=5e-3)
    dashed = [line for _, line in curves_of(figure.svg, PALETTE[1]) if len(line) == 2]
    assert len(dashed) == 3
    for line in dashed:
        assert line == pytest.approx(np.array([[0.9, 0.8], [1.0, 0.5]]), abs=5e-3)
    stars = marks_of(figure.svg, PALETTE[2])
    assert len(stars) == 3
    for _, at in stars:
        assert at == pytest.approx(np.array([[0.9, 0.8]]), abs=5e-3)


@pytest.mark.req("C-210")
def test_metres_are_those_of_the_evaluated_time(folder):
    evaluation = json.loads((folder / "evaluation.json").read_text())
    for segment in evaluation["segment_table"]:
        assert segment["metres"] == pytest.approx(15.0 * 3600.0 * segment["hours"], rel=0.02)
        assert segment["sun_altitude_deg"] == -5.0
    driven = tables(evaluation_page(evaluation, folder))["Routes driven, ours and published"]
    assert [row[0].text for row in driven.rows[:3]] == ["route-0", "route-1", "all routes"]
    assert driven.rows[0][1].text == "night, sun -5°"
