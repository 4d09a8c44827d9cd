"""The independent check of how far a car is seen: its formula by hand, its table, and its network."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

import sight_check as check
from skidpad.core.weather import Weather
from skidpad.physics.optics import label_range, sight
from skidpad.sensors.object_level.objects import SIGHT

DOCS = Path(__file__).parents[2] / "docs"
TABLE = {
    row["weather"]: row
    for row in csv.DictReader((DOCS / "sight-check.csv").read_text(encoding="utf-8").splitlines())
}


def test_the_eye_by_hand() -> None:
    """Adrian at 1 cd/m^2 and 10': 0.0499 uncorrected, a glance of 0.2 s 1.623, 30 years 1.046."""
    assert check.eye_threshold(1.0, 10.0, is_darker=False) == pytest.approx(0.0847, rel=2e-3)
    assert check.eye_threshold(1.0, 10.0, is_darker=True) < 0.0847


def test_an_eye_needs_more_contrast_for_less_and_for_smaller_things() -> None:
    """As figure 3.1 of a book on road lighting has it, from 0.1 to 10 cd/m^2 and 4 to 9 minutes of arc."""
    dim, bright = (check.eye_threshold(b, 7.0, False) / b for b in (0.1, 10.0))
    assert dim > 3.0 * bright
    small, large = (check.eye_threshold(1.0, a, False) for a in (4.0, 9.0))
    assert small > 2.0 * large


def test_the_table_is_what_the_formulas_say() -> None:
    assert set(TABLE) == set(check.WEATHERS)
    for name, weather in check.WEATHERS.items():
        row = TABLE[name]
        assert row["optical_range_m"] == f"{sight(weather):.0f}"
        assert row["contrast_limit_m"] == f"{label_range(weather):.0f}"
        for level in check.LEVELS:
            assert row[f"eye_level_{level}_m"] == f"{check.eye_range(weather, level):.0f}"
        assert float(row["object_level_m"]) == pytest.approx(
            min(label_range(weather), SIGHT), abs=0.6
        )


def test_where_the_limit_acts_an_eye_at_level_7_sees_as_far() -> None:
    acting = [row for row in TABLE.values() if float(row["contrast_limit_m"]) < SIGHT]
    assert len(acting) == 3
    for row in acting:
        limit, eye = float(row["contrast_limit_m"]), float(row["eye_level_7_m"])
        assert limit == pytest.approx(eye, rel=0.07)


def test_the_page_shows_every_row_of_the_table() -> None:
    text = (DOCS / "rendering.md").read_text(encoding="utf-8")
    for name, row in TABLE.items():
        eye = " / ".join(row[f"eye_level_{level}_m"] for level in check.LEVELS)
        told = [f"{float(row[f'network_held{k}_m']):g}" for k in ("", "_low", "_high")]
        start = f"| {name} | {row['optical_range_m']} | {float(row['object_level_m']):g} | {eye} | "
        (line,) = (one for one in text.splitlines() if one.startswith(start))
        assert f"; {told[0]} ({told[1]} to {told[2]}) | {row['false_alarms_of_20']} of 20 |" in line


def test_the_network_finds_a_near_car_by_day_and_takes_an_empty_road_in_dense_fog_for_occupied() -> (
    None
):
    approach = check.Approach(2)
    day, fog = check.WEATHERS["clear-noon"], Weather(fog_density=100.0)
    assert approach.finds(day, [30.0, 15.0]) == [True, True]
    assert not approach.is_fooled(day, 2)
    assert approach.is_fooled(fog, 2)
    assert not any(approach.finds(fog, [30.0, 15.0]))
