"""The main job's two parts: objects with many seeds, one seed once more on pixels."""

from dataclasses import replace

import pytest

from skidpad.campaign.cells.matrix import cross, published_drivers
from skidpad.cli.campaigns.adas_plan import on_pixels
from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.recording.campaign.matrix import MATRIX, PIXELS
from skidpad.recording.campaign.results import Timing
from skidpad.report.matrix.comparisons.parity import load_parity, parity_section
from skidpad.report.matrix.data import load_matrix
from skidpad.report.matrix.page import build_page
from support.matrix_drawn import key
from support.matrix_made import metrics
from support.runs import adas_run


def row(config, seed, sensors, motion, **values):
    named = key(config, "rain-noon", seed)
    return replace(named, sensors=sensors, motion_hash=motion), metrics(**values)


@pytest.fixture
def matrix(tmp_path):
    objects = [
        row("0", 1, "objects", "a", hit=30),
        row("3", 1, "objects", "b", barriers=1, speed=40.0),
        row("4", 1, "objects", "c", barriers=2, speed=38.0),
        row("3", 2, "objects", "d", barriers=9, speed=10.0),
    ]
    pixels = [
        row("0", 1, "pixels", "x", hit=20),
        row("3", 1, "pixels", "b", barriers=1, speed=40.0),
        row("4", 1, "pixels", "y", hit=4, speed=36.5),
    ]
    MATRIX.write(tmp_path, objects, [Timing(wall_s=9, cpu_s=30, rtf=55)] * 4)
    MATRIX.write(tmp_path / PIXELS, pixels, [Timing(wall_s=9, cpu_s=60, rtf=5)] * 3)
    return load_matrix(tmp_path)


def test_every_run_on_pixels_stands_beside_its_twin_of_the_same_seed(matrix):
    parity = load_parity(matrix)
    words, figure, table = parity_section(parity)
    assert (
        "2 different drives of the compared configurations had 3 crashes on objects and 5 on pixels; "
        "1 moved alike to the last bit at both levels, with configuration 3." in words.text
    )
    assert [r[0].text[0] for r in table.rows] == ["0", "3", "4"]
    four = table.rows[2]
    assert (four[1].text, four[1].note) == ("4.00", "objects 2.00")
    assert (four[2].text, four[2].note) == ("36.50", "objects 38.00")
    assert "on the line they agree" in figure.caption


def test_pairs_that_moved_alike_in_several_weathers_are_one_pair(tmp_path):
    def at(weather, sensors, motion, **values):
        named = replace(key("3", weather, 1), sensors=sensors, motion_hash=motion)
        return named, metrics(**values)

    dry = ("clear-sunrise", "clear-noon", "clear-night")
    MATRIX.write(
        tmp_path,
        [*(at(w, "objects", "a", barriers=1) for w in dry), at("rain-noon", "objects", "b")],
    )
    on_images = [*(at(w, "pixels", "x", barriers=2) for w in dry), at("rain-noon", "pixels", "y")]
    MATRIX.write(tmp_path / PIXELS, on_images)
    words, _, table = parity_section(load_parity(load_matrix(tmp_path)))
    assert "2 different drives of the compared" in words.text
    assert "had 1 crash on objects and 2 on pixels; 0 moved alike" in words.text
    assert [r[0].note for r in table.rows] == [
        "Clear Sky: sunrise, noon and night, seed 1", "Heavy Rain - Noon, seed 1"
    ]  # fmt: skip


def test_a_drive_on_objects_counts_once_where_images_of_two_times_of_day_drove_twice(tmp_path):
    """At night the pixels moved the car by a hair: that is no second set of crashes."""

    def at(weather, sensors, motion, **values):
        named = replace(key("3", weather, 1), sensors=sensors, motion_hash=motion)
        return named, metrics(**values)

    MATRIX.write(tmp_path, [at(w, "objects", "a", barriers=1) for w in ("rain-noon", "rain-night")])
    on_images = [
        at("rain-noon", "pixels", "x", barriers=3),
        at("rain-night", "pixels", "y", barriers=3),
    ]
    MATRIX.write(tmp_path / PIXELS, on_images)
    words, _, table = parity_section(load_parity(load_matrix(tmp_path)))
    assert (
        "1 different drive of the compared configurations had 1 crash on objects and 3 on pixels"
        in (words.text)
    )
    assert "their mean counts" in words.text
    assert len(table.rows) == 2


def test_the_page_tells_the_processor_minutes_of_each_part(matrix):
    assert ("processor time", "2.0 min, 3.0 min more for the comparison with images") in build_page(
        matrix
    ).facts


def test_a_campaign_without_runs_on_pixels_has_no_such_section(tmp_path):
    MATRIX.write(tmp_path, [row("3", 1, "objects", "b")])
    assert load_parity(load_matrix(tmp_path)) is None
    assert parity_section(None) == []


def test_the_runs_on_pixels_are_those_of_the_first_seeds_and_nothing_else_of_them_differs():
    template = adas_run(0, duration=4.0)
    cells = cross(published_drivers("3,4"), [find_weather("rain-noon")], 3, template)
    twins = on_pixels(cells, 1)
    assert [(t.driver.label, t.seed) for t in twins] == [("3", 1), ("4", 1)]
    assert {t.sensors for t in twins} == {SensorLevel.PIXELS}
    assert [t.name for t in twins] == [c.name for c in cells if c.seed == 1]
    assert on_pixels(cells, 0) == []
    with pytest.raises(ConfigError, match="--parity-seeds 4 needs as many --seeds; there are 3"):
        on_pixels(cells, 4)
    with pytest.raises(ConfigError, match="pass --sensors objects too"):
        on_pixels(twins, 1)
