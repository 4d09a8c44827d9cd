"""The map, curves and tables of a threshold page by value: rows in, numbers read back from the page."""

import re
from types import SimpleNamespace

import matplotlib as mpl
import numpy as np
import polars as pl
import pytest

from skidpad.evidence.grip.threshold import situations
from skidpad.report.elements.figures import PALETTE
from skidpad.report.grip.threshold import _map as map_blocks
from skidpad.report.grip.threshold import groups, title
from skidpad.report.grip.threshold_figures import COLOURS, NOT_SHOWN, TOP, curve_figures, map_figure
from support.svg_values import curves_of, frames, marks_of, texts

LEVELS = (0.9, 0.6, 0.3, 0.1)
SEEDS = range(1, 9)


def rows(braking, first_accident, start="1 s at 80", dry_failures=0):
    """Eight seeds of one situation; the k-th has its first accident on level first_accident[k]."""
    for seed, first in zip(SEEDS, first_accident, strict=True):
        for k, mu in enumerate(LEVELS):
            yield {
                "driver": "acc", "actors": "ideal", "start": start, "deceleration": braking,
                "speed_kmh": 80.0, "gap_m": 22.0, "road_mu": mu, "preset": "", "seed": seed,
                "completion": not (k >= first or (k == 0 and seed <= dry_failures)),
                "outcome": "completed",
            }  # fmt: skip


@pytest.fixture(scope="module")
def campaign():
    # all fail first on 0.3; half on 0.3 and half never; two of eight on dry road already
    table = pl.DataFrame(
        [
            *rows(4.0, [2] * 8),
            *rows(6.0, [2] * 3 + [4] * 5),
            *rows(8.0, [2] * 8, dry_failures=2),
        ]
    )
    found = situations(table)
    return SimpleNamespace(situations=found, telling=[s for s in found if s.tells], results=table)


@pytest.mark.req("B-141")
def test_the_map_shows_each_threshold_in_its_place_and_colour(campaign):
    svg = map_figure(groups(campaign))
    words = {t: (x, y) for t, x, y, _ in texts(svg)}
    # between 0.6, where all were well, and 0.3, where all had an accident
    assert "0.45" in words
    assert "< 0.10" in words, "fewer than half of the drives ever had an accident"
    assert {"4", "6", "8", "1 s at 80", "ACC, ideal lead"} <= set(words)
    for told, braking in (("0.45", "4"), ("< 0.10", "6")):
        nearest = min("468", key=lambda tick: abs(words[tick][0] - words[told][0]))
        assert nearest == braking, "above its deceleration"
    mu = campaign.telling[0].threshold.mu
    assert mu == pytest.approx(0.45)
    scale = mpl.colors.to_hex(mpl.colormaps[COLOURS](mu / TOP))
    assert len(re.findall(rf"fill: {scale}", svg)) == 1
    assert len(re.findall(rf"fill: {NOT_SHOWN}", svg)) == 1, "grey: not completed on dry road"


@pytest.mark.req("B-141")
def test_curves_are_the_shares_completed_on_each_level(campaign):
    ((name, svg),) = curve_figures(groups(campaign)).items()
    assert name == "ACC, ideal lead"
    (frame,) = frames(svg)
    for colour, shares in ((PALETTE[0], [100, 100, 0, 0]), (PALETTE[1], [100, 100, 62.5, 62.5])):
        lines = [p for _, p in curves_of(svg, colour) if len(p) == len(LEVELS)]
        assert len(lines) == 1
        assert lines[0][:, 0] == pytest.approx(LEVELS, abs=1e-3)
        assert lines[0][:, 1] == pytest.approx(shares, abs=0.2)
        ((_, marks),) = marks_of(svg, colour)
        assert len(marks) == len(LEVELS)
    assert not curves_of(svg, PALETTE[2]), "what is not completed on dry road is not drawn"
    assert frame.y(np.array([frame.top]))[0] == pytest.approx(103.0, abs=0.2)


@pytest.mark.req("B-141")
def test_the_table_has_the_threshold_and_the_share_on_each_level(campaign):
    _, table = map_blocks(campaign)
    assert [t for t, _ in table.columns] == [
        "driver", "lead", "start", "deceleration, m/s²", "baseline, %", "threshold",
        "completed again, %", "at 0.6, %", "at 0.3, %", "at 0.1, %",
    ]  # fmt: skip
    assert [[c.text for c in row] for row in table.rows] == [
        ["ACC", "ideal", "1 s at 80", "4", "100", "0.45", "0", "100", "0", "0"],
        ["ACC", "ideal", "1 s at 80", "6", "100", "none", "0", "100", "62", "62"],
    ]
    low, high = table.rows[0][5].limits
    assert 0.0 <= low <= 0.45 <= high <= 0.9
    assert title(campaign.telling[0]) == "ACC, ideal lead, 1 s at 80, 4 m/s²"
