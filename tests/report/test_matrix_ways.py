"""The map of ways and crashes: gaps where the car was put back, a line per configuration."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from skidpad.report.elements.figures import PALETTE
from skidpad.report.matrix import ways as matrix_ways
from skidpad.report.matrix.ways import broken_way, way_blocks
from skidpad.roads.bundled import load_map
from support.matrix_made import campaign, metrics
from support.svg_values import texts


def test_a_way_has_a_gap_wherever_the_car_was_put_somewhere_else():
    x = np.concatenate([np.arange(0.0, 100.0, 0.5), np.arange(500.0, 520.0, 0.5)])
    way = broken_way(x, np.zeros_like(x))
    gap = np.flatnonzero(np.isnan(way[:, 0]))
    assert gap.tolist() == [20]
    assert (way[19, 0], way[21, 0]) == (95.0, 500.0)
    assert not np.isnan(broken_way(np.arange(0.0, 50.0), np.zeros(50))).any()


@pytest.mark.req("A-259")
def test_the_map_has_a_way_per_configuration_and_a_mark_per_crash(tmp_path, monkeypatch):
    matrix = campaign(tmp_path, lambda *_: metrics(barriers=1), seeds=1)
    road_map = load_map("figure8")
    way = np.array([[0.0, 0.0], [10.0, 5.0], [20.0, 0.0]])
    monkeypatch.setattr(matrix_ways, "_ways", lambda *_: [(way, road_map)])
    actors = SimpleNamespace(x=np.array([[3.0], [7.0]]), y=np.array([[1.0], [2.0]]))
    drive = SimpleNamespace(log=SimpleNamespace(actors=actors), row=lambda tick: tick)
    crash = (SimpleNamespace(tick=1), drive, road_map, None)
    (figure,) = way_blocks(matrix, {("0", "clear-noon"): [crash], ("3", "rain-noon"): [crash] * 2})
    words = {t for t, *_ in texts(figure.svg)}
    assert {"m east", "m north"} <= words
    assert {g.title for g in matrix.weather_groups} <= words, "the legend of the marks"
    for colour in PALETTE[:4]:  # of configurations 1 to 4; each has a way and its legend
        assert len(re.findall(rf"fill: none; stroke: {colour}", figure.svg)) == 2
    marks = re.findall(rf"fill: {PALETTE[2]}; stroke: #000000", figure.svg)
    assert len(marks) == 2, "of configuration 3; the baseline's crash is not drawn"


def test_without_logs_there_is_no_map(tmp_path):
    assert way_blocks(campaign(tmp_path, lambda *_: metrics(), seeds=1), {}) == []
