"""Rules of the monitor judged on the same drives, and what the page shows of them, by value."""

from __future__ import annotations

import json
from math import cos, sin
from types import SimpleNamespace

import numpy as np
import pytest

import channels_tables as tables
import monitor_rules
import monitor_variants
from skidpad.evidence.channels.judging.curves import Looked
from skidpad.evidence.channels.tracked.tracks import Track
from skidpad.report.elements.figures import PALETTE
from skidpad.roads.bundled import load_map
from support.channel_worlds import Eyes, World, drive
from support.svg_values import curves_of

TAILGATED = "ego_tailgated"
FOLLOWED = World((0, 0, 0, 15.0, 0), np.array([(-10.5, 0, 0, 15.7, 0), (60.0, 3.5, 0, 15.0, 0)]))


def row(tp, fp, fn):
    share = {"precision": tp / (tp + fp), "recall": tp / (tp + fn)}
    return share | {
        "tp": tp, "fp": fp, "fn": fn, "precision_interval": None, "recall_interval": [0.1, 0.9],
        "false_alarms_per_hour": fp / 2.0, "false_alarms_interval": [0.0, 4.0],
    }  # fmt: skip


@pytest.fixture
def results(tmp_path):
    part = {"hours": 2.0, "segments": 12, "rules": {"today": {TAILGATED: row(3, 1, 1)}}}
    curve = {
        f"reference {at:g}": {TAILGATED: of}
        for at, of in ((0.0, row(4, 1, 4)), (5.0, row(6, 6, 2)))
    }
    told = {
        "commit": "abc", "date": "2026-01-01", "first_seeds": [70000000], "drives": {"risky": part},
        "reference": {"drives": {"risky": part | {"rules": curve}}},
    }  # fmt: skip
    (tmp_path / "rules.json").write_text(json.dumps(told))
    return tmp_path


def test_rules_stand_in_a_table_with_too_few_in_words(results):
    said = tables.rules(results)
    assert "2.00 h risky (12 segments)" in said
    assert "seeds from 70000000" in said
    (line,) = (x for x in said.splitlines() if "ego tailgated | today" in x)
    assert line.endswith("| 4, too few | 3 | 1 | 75.0 | 75.0 [10.0, 90.0] | 0.5 [0.0, 4.0] |")


@pytest.mark.req("C-105")
def test_the_curve_of_the_reference_is_drawn_as_its_table_says(results):
    (curve,) = curves_of(tables.reference_figure(results), PALETTE[0])
    assert curve[1] == pytest.approx(np.array([[0.5, 0.8], [0.75, 0.5]]), abs=5e-3)
    assert "| risky | ego tailgated | 5 | 50.0 | 75.0 |" in tables.reference(results).splitlines()


@pytest.mark.req("C-105")
def test_the_committed_figure_shows_the_committed_curves():
    svg = tables.FIGURE.read_text()
    told = json.loads((tables.RESULTS / "rules.json").read_text())
    found = list(tables.reference_curves(told))
    drawn = [line for colour in PALETTE for _, line in curves_of(svg, colour)]
    assert len([points for *_, points in found if len(points) > 1]) >= 2
    for drives, hazard, points in found:
        wanted = np.array([p[1:] for p in points])
        same = [x for x in drawn if len(x) == len(wanted) and np.abs(x - wanted).max() < 5e-3]
        assert same or len(points) == 1, (drives, hazard)


def test_every_rule_judges_a_recording_once(tmp_path, capsys, monkeypatch):
    source = drive(FOLLOWED, (Eyes("a", 0.02), Eyes("b", 0.02)), 6.0)
    source.path = None
    monkeypatch.setattr(monitor_rules, "McapRecording", lambda path: source)
    monkeypatch.setattr(monitor_rules, "context_of", lambda source: {"stratum": "risky"})
    for end in ("mcap", "json"):
        (tmp_path / f"route-1_risky-71000000.{end}").write_text("")
    out = tmp_path / "rules.json"
    for _ in range(2):
        words = [str(tmp_path), "--reference", str(tmp_path), "--out", str(out)]
        assert monitor_rules.main(words) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2  # the second time nothing is judged
    told = json.loads(out.read_text())
    assert told["first_seeds"] == [71000000]
    rules = told["drives"]["risky"]["rules"]
    for name in (monitor_rules.BEFORE, monitor_rules.TRACKED, "own grip, fusion", "told the grip"):
        assert (rules[name][TAILGATED]["tp"], rules[name][TAILGATED]["fn"]) == (1, 0), name
    at_truth = told["reference"]["drives"]["risky"]["rules"]["reference 0"][TAILGATED]
    assert (at_truth["tp"], at_truth["fp"], at_truth["fn"]) == (1, 0, 0)


def test_fused_tracks_weigh_by_their_covariances():
    """By hand: variances 1 and 3 weigh 3 to 1, and leave 3 / 4."""
    one, two = (
        Track(True, gap, v, (p, p, 0.0), 0.0, (0.0, 0.0))
        for gap, v, p in ((8, 10, 1.0), (12, 14, 3.0))
    )
    gap, v, p = monitor_variants.fused_state([one, two])
    assert (gap, v) == pytest.approx((9.0, 11.0))
    assert p == pytest.approx((0.75, 0.75, 0.0))


def test_smoothing_bridges_a_gap_and_drops_a_flicker():
    """By hand: 11 cycles of 0.1 s decide, so that 3 of them are no gap and 7 with a hole are one."""
    flicker = np.array([0.0] * 20 + [1.0] * 3 + [0.0] * 20)
    assert not monitor_variants.majority(flicker, 1.0).any()
    held = np.array([0.0] * 10 + [1.0] * 7 + [0.0] * 2 + [1.0] * 7 + [0.0] * 10)
    assert monitor_variants.majority(held, 1.0)[15:21].all()


def test_the_map_doubts_the_channel_that_is_off_its_lane():
    """On figure8, 0.6 m left of a lane's centre for a second, then on it."""
    map = load_map("figure8")
    beside = map.at(0, 20.0)
    lane = map.project(beside.x, beside.y, 0.0)
    left = (lane.x - 0.6 * sin(lane.heading), lane.y + 0.6 * cos(lane.heading))
    places = [left] * 10 + [(lane.x, lane.y)] * 20
    frames = [SimpleNamespace(ego=np.array(place)) for place in places]
    off = monitor_variants.off_centre(map, [Looked(0.0, [], [frame]) for frame in frames])
    assert off[2:7] == pytest.approx(0.6, abs=0.05)
    assert off[20:] == pytest.approx(0.0, abs=0.05)


def test_variants_that_came_later_stand_in_a_table_of_their_own(results):
    assert tables.variants(results) == "Not driven.\n"
    (results / "rules.json").rename(results / "variants.json")
    assert "| risky | ego tailgated | today |" in tables.variants(results)
    assert tables.rules(results) == "Not driven.\n"
