"""The ways driven, by value: what a drive keeps of its places, and what the page draws."""

from __future__ import annotations

import json
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

import channels_tables as tables
from skidpad.campaign.channels.outcomes import Referee
from skidpad.core.channels import Decision
from skidpad.recording.channels.drives import WAY_STEP, DriveOutcome, DriveRecord, read_records
from skidpad.report.channels.evaluation.ways import draw_ways, lane_lines
from skidpad.report.elements.figures import PALETTE
from skidpad.roads.bundled import load_map
from support.svg_values import curves_of

WAYS = {
    "figure8": [((0.0, 0.0), (30.0, 40.0), (60.0, 0.0))],
    "unheard-of": [((5.0, 5.0), (9.0, 5.0))],
}


def outcome(way):
    return DriveOutcome(
        route="route-1", seed=1, drive_by="arbiter", driven_s=600.0, distance_m=4000.0, collisions=0,
        collisions_struck=0, red_lights_run=0, stalls=0, ended="time", switches=0, minimal_risk_s=0.0,
        driving_s={}, way=way,
    )  # fmt: skip


def write(folder, ways):
    for map, of in ways.items():
        for k, way in enumerate(of):
            record = DriveRecord({"course": {"map": map}}, outcome(way))
            (folder / f"{map}-{k}.json").write_bytes(msgspec.json.encode(record))


def test_a_page_draws_the_ways_on_their_maps(tmp_path):
    write(tmp_path, WAYS)
    (figure,) = draw_ways(tmp_path)
    assert (
        figure.caption == "Where the ego drove. figure8: 1 drive, 4 km, unheard-of: 1 drive, 4 km."
    )
    drawn = [line for _, line in curves_of(figure.svg, PALETTE[0])]
    for of in WAYS.values():
        want = np.array(of[0])
        assert any(len(x) == len(want) and np.abs(x - want).max() < 0.5 for x in drawn)


def test_drives_that_kept_no_places_say_so(tmp_path):
    write(tmp_path, {"figure8": [()]})
    (text,) = draw_ways(tmp_path)
    assert text.text.startswith("Not shown")
    assert read_records([tmp_path])[0].outcome.way == ()


def test_the_page_of_docs_shows_a_figure_of_each_three_maps(tmp_path):
    assert tables.ways(tmp_path) == "No ways were kept of these drives.\n"
    (tmp_path / "ways.json").write_text(json.dumps(WAYS))
    assert tables.ways(tmp_path) == "![Ways driven, by map](results/channels/ways-1.svg)\n"
    (svg,) = tables.ways_by_file(tmp_path).values()
    assert len(curves_of(svg, PALETTE[0])) == 2


def test_lanes_are_drawn_from_end_to_end():
    lines = list(lane_lines(load_map("figure8")))
    assert len(lines) > 3
    for line in lines:
        assert len(line) >= 2
        assert np.hypot(*np.diff(line, axis=0).T).max() < 6.0


def test_a_drive_keeps_a_place_every_ten_metres(monkeypatch):
    referee = Referee(SimpleNamespace(points=None, lines=(), length=1e9), None, 0.1)
    monkeypatch.setattr("skidpad.campaign.channels.outcomes.locate", lambda *_: (0, 0.0))
    monkeypatch.setattr(Referee, "_lines", lambda *_: None)
    for k in range(100):
        at = [np.array([value]) for value in (1.5 * k, 2.0, 15.0, 0.0)]
        states = SimpleNamespace(x=at[0], y=at[1], vx=at[2], vy=at[3])
        referee.observe(SimpleNamespace(states=states), Decision(0.1 * k, "", "", ()))
    way = referee.outcome("r", 1, "arbiter").way
    steps = np.hypot(*np.diff(np.array(way), axis=0).T)
    assert way[0] == (0.0, 2.0)
    assert WAY_STEP - 0.1 <= steps.min() <= steps.max() < WAY_STEP + 1.6
    assert way[-1][0] == pytest.approx(148.5, abs=WAY_STEP)
