"""Files with one element each, against what esmini made of them: equal places at equal times.

The tables beside the files name esmini's version; where the two differ, docs/openscenario-results.md says
which follows the standard.
"""

from __future__ import annotations

import csv
from math import hypot
from pathlib import Path

import pytest

from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import compile_scenario

FILES = sorted(Path(__file__).with_name("esmini").glob("*.xosc"))
NEAR = 0.1  # m


def test_there_are_files():
    assert len(FILES) >= 12


@pytest.mark.parametrize("file", FILES, ids=lambda f: f.stem)
def test_everybody_is_where_esmini_puts_them(file):
    told = play_ideal(compile_scenario(file), 9.0)
    ours = {(round(r.time / 0.05), r.name): r for r in told.rows}
    lines = [line for line in file.with_suffix(".csv").read_text().splitlines() if line[0] != "#"]
    compared = 0
    for row in csv.DictReader(lines):
        found = ours[round(float(row["time"]) / 0.05), row["name"]]
        assert hypot(found.x - float(row["x"]), found.y - float(row["y"])) <= NEAR, row
        compared += 1
    assert compared >= 70
