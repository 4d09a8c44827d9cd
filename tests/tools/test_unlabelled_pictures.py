"""The unlabelled pictures: dealt evenly, the same again, and no answer among them."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

import unlabelled_pictures as tool
from skidpad.roads.bundled import load_map
from skidpad.scenery.sides import RoadKind


def test_weathers_and_times_of_day_come_equally_often():
    skies = tool.deal_skies(np.random.default_rng(5), 24)
    assert set(Counter(weather for weather, _ in skies).values()) == {4}
    assert set(Counter(time for _, time in skies).values()) == {8}
    assert set(skies) == set(tool.SKIES), "each weather at each time"


def test_a_place_has_its_road_before_it_and_is_away_from_others():
    road_map = load_map("town")
    places = tool.places_on(road_map)
    assert set(places) == {RoadKind.TOWN, RoadKind.RURAL}
    for kind, found in places.items():
        for here in found[::40]:
            ahead = road_map.ahead(here, tool.AHEAD - 0.1)
            assert ahead is not None
            assert ahead.lane == here.lane, kind
    rng = np.random.default_rng(1)
    first = tool.choose_place(rng, places[RoadKind.TOWN], [])
    other = tool.choose_place(rng, places[RoadKind.TOWN], [first])
    assert np.hypot(first.x - other.x, first.y - other.y) > tool.REMOTE


def test_pictures_and_answers_are_the_same_again_and_apart(tmp_path, monkeypatch):
    monkeypatch.setattr(tool, "VIEWS", 2)
    monkeypatch.setattr(tool, "CAMERA", replace(tool.CAMERA, width=96, height=54))
    read = []
    for name in ("a", "b"):
        out, key = tmp_path / name, tmp_path / f"{name}.json"
        tool.main(["straight", "--out", str(out), "--key", str(key), "--seed", "3"])
        pictures = sorted(out.iterdir())
        assert [p.name for p in pictures] == ["01.png", "02.png"]
        read.append((key.read_text("utf-8"), [p.read_bytes() for p in pictures]))
    assert read[0] == read[1]
    answers = json.loads(read[0][0])
    assert [a["road"] for a in answers] == ["motorway"] * 2
    assert all((a["weather"], a["time"]) in tool.SKIES for a in answers)
    assert Image.open(tmp_path / "a" / "01.png").size == (96, 54)


def test_answers_among_the_pictures_are_refused(tmp_path, capsys):
    with pytest.raises(SystemExit):
        tool.main(["straight", "--out", str(tmp_path), "--key", str(tmp_path / "key.json")])
    assert "--key lies among the pictures" in capsys.readouterr().err
