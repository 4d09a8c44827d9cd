"""Figures and tables of the matrix page: recomputed from rows, read back from the HTML."""

import re
from html import unescape

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.statistics import Interval, mean_limits
from skidpad.recording.campaign.matrix import MATRIX, Metrics
from skidpad.recording.campaign.results import Timing
from skidpad.report.elements.figures import PALETTE, Series, stacked_bars
from skidpad.report.matrix.answers import answers
from skidpad.report.matrix.comparisons.sides import side_blocks
from skidpad.report.matrix.comparisons.steps import step_blocks, step_differences
from skidpad.report.matrix.data import WEATHERS, load_matrix
from skidpad.report.matrix.page import write_report
from skidpad.report.matrix.real_time import real_time_blocks
from skidpad.report.matrix.tables import (
    count_table,
    grades_table,
    kinds_table,
    mean_table,
    per_weather,
    possible_part,
)
from skidpad.report.published import Source, read_published
from support.matrix_drawn import key, write_drawn_campaign
from support.report_page import read_page
from support.svg_values import bars, curves_of, frames, marks_of, shapes, texts

CONFIGS = ("1", "2", "3", "4")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("seven")
    write_drawn_campaign(folder, seeds=3)
    html = read_page(write_report(folder))
    rows = pl.read_parquet(folder / "results.parquet")
    return html, rows.with_columns(crashes=pl.col("fatal_collisions"))  # no contact is graded here


def figure(html, caption):
    """The SVG of the figure whose caption begins so."""
    pattern = r'<figure class="chart">((?:(?!</svg>).)*</svg>)\s*<figcaption>([^<]*)</figcaption>'
    found = [svg for svg, told in re.findall(pattern, html, re.DOTALL) if told.startswith(caption)]
    assert len(found) == 1, caption
    return found[0]


def means(rows, column, config, weathers=tuple(WEATHERS)):
    """Mean per weather of the rows of a configuration."""
    cells = [rows.filter(config=config, weather=w) for w in weathers]
    return [float(cell[column].mean()) for cell in cells]


@pytest.mark.req("A-259")
@pytest.mark.parametrize(
    ("caption", "column"),
    [
        ("Crashes per run by weather and configuration", "crashes"),
        ("Dropout by weather and configuration.", "dropout_pct"),
    ],
)
def test_bars_by_weather_are_the_means_of_the_rows(page, caption, column):
    html, rows = page
    svg = figure(html, caption)
    for config, colour in zip(CONFIGS, PALETTE, strict=False):
        assert bars(svg, colour) == pytest.approx(means(rows, column, config), abs=1e-4)
    assert {f"configuration {c}" for c in CONFIGS} <= {t for t, *_ in texts(svg)}


@pytest.mark.req("A-259")
def test_the_bars_over_all_weathers_and_the_variance_are_those_of_the_rows(page):
    html, rows = page
    total = bars(figure(html, "The same over all weathers"), PALETTE[0])
    expected = [float(rows.filter(config=c)["crashes"].mean()) for c in CONFIGS]
    assert total == pytest.approx(expected, abs=1e-4)
    variance = bars(figure(html, "Variance of the distance error by weather"), PALETTE[0])
    assert variance == pytest.approx(means(rows, "headway_variance_m2", "4"), abs=1e-3)


@pytest.mark.req("A-259")
def test_every_panel_of_configuration_3_has_its_own_quantity(page):
    html, rows = page
    svg = figure(html, "Configuration 3 in every weather")
    labels = (
        "crashes",
        "dropout, %",
        "mean distance error, m",
        "variance of the distance error, m²",
        "radar false positives, %",
    )
    assert set(labels) <= {t for t, *_ in texts(svg)}
    columns = ("crashes", "dropout_pct", "mean_error_m", "headway_variance_m2", "radar_fpr_pct")
    expected = [v for column in columns for v in means(rows, column, "3")]
    assert bars(svg, PALETTE[0]) == pytest.approx(expected, rel=1e-3, abs=1e-4)


@pytest.mark.req("A-258", "A-259")
def test_published_numbers_stand_in_their_own_section_with_what_differs_said_first(page):
    html, _ = page
    before, section = html.split('<section id="beside-the-published-numbers">')
    section = section.split("</section>")[0]
    assert not re.search(r"<small>published \d", before)
    assert "Not the published experiment: that had" in section
    assert "vehicles at fixed places" in section
    assert "the map Town04 (here: figure8)" in section
    table = read_published(Source.MATRIX).filter(
        pl.col("config_id") == 0, weather="Clear Sky", time_of_day="Sunrise"
    )
    assert f"published {table['collisions'][0]:g}" in unescape(section)


@pytest.mark.req("A-259")
@pytest.mark.parametrize(
    ("caption", "published", "ours"),
    [
        ("Interventions (bars) and published", "collisions", "fatal_collisions"),
        ("Dropout (bars) and the published", "dropout_pct", "dropout_pct"),
    ],
)
def test_bars_are_ours_and_diamonds_the_published_values(page, caption, published, ours):
    html, rows = page
    svg, table = figure(html, caption), read_published(Source.MATRIX)
    configs = ("0", *CONFIGS)
    cells = [
        table.filter(
            config_id=int(config),
            weather={"clear": "Clear Sky", "rain": "Heavy Rain"}[kind],
            time_of_day=time.capitalize(),
        )[published].item()
        for config in configs
        for kind, time in (weather.split("-") for weather in WEATHERS)
    ]
    ((_, diamonds),) = marks_of(svg, "#ffffff")
    assert [y for _, y in diamonds] == pytest.approx(cells, rel=2e-3, abs=0.02)
    for config, colour in zip(configs, PALETTE, strict=False):
        assert bars(svg, colour) == pytest.approx(means(rows, ours, config), abs=1e-3)


@pytest.mark.req("A-259")
def test_two_configurations_stand_side_by_side_with_their_difference(page, tmp_path):
    _, rows = page
    rows_of = write_drawn_campaign(tmp_path, seeds=3)
    assert len(rows_of) == len(rows)
    one, figure_one, two, _ = side_blocks(load_matrix(tmp_path))
    assert [title for title, _ in one.columns] == [
        "metric", "1 · ACC", "2 · ACC + lane centring", "2 minus 1"
    ]  # fmt: skip
    assert [title for title, _ in two.columns][-1] == "4 minus 2"
    speed = next(row for row in one.rows if row[0].text == "mean speed, km/h")
    first, second = (float(rows.filter(config=c)["mean_speed_kmh"].mean()) for c in "12")
    assert [c.sort for c in speed[1:]] == pytest.approx([first, second, second - first])
    assert bars(figure_one.svg, PALETTE[1]) == pytest.approx(means(rows, "crashes", "2"), abs=1e-4)


@pytest.mark.req("A-246")
def test_real_time_is_told_by_weather_with_its_share_of_slow_ticks(tmp_path):
    rows = [(key("1", w, seed), Metrics()) for w in ("clear-noon", "rain-noon") for seed in (1, 2)]
    clocks = [
        Timing(wall_s=9, rtf=rtf, rtf_below_0_9_pct=slow)
        for rtf, slow in ((50.0, 0.0), (40.0, 1.0), (20.0, 3.0), (0.8, 60.0))
    ]
    MATRIX.write(tmp_path, rows, clocks)
    words, table, said = real_time_blocks(load_matrix(tmp_path))
    assert "another experiment" in words.text
    assert [[c.text for c in row] for row in table.rows] == [
        ["Clear Sky - Noon", "2", "45.0", "40.0", "0.50"],
        ["Heavy Rain - Noon", "2", "10.4", "0.8", "31.50"],
    ]
    theirs = {row[0].text: [c.text for c in row[1:3]] for row in said.rows}
    assert theirs["preliminary, all 11 runs"] == ["0.59 to 0.6", "100"]
    assert theirs["final, clear weather"] == ["1", "less than 0.2"]
    assert theirs["final, Clear Sky - Night"] == ["", "6.5"]
    assert theirs["final, night with rain"] == ["0.99", "5 to 6"]


@pytest.mark.req("R-7")
def test_what_steps_change_is_tested_as_one_family_and_marked_only_where_it_is_sure(tmp_path):
    """Of 28 tests of ten seeds even ten equal signs (p = 2 / 2^10) are not sure by themselves."""
    matrix = pairs_of_ten_seeds(tmp_path)
    found = step_differences(matrix, [("1", "2"), ("2", "3")])
    dropout, speed = found["dropout_pct", ("1", "2")], found["mean_speed_kmh", ("1", "2")]
    ps = [float(q.lines[0].removeprefix("p = ").removeprefix("p < ")) for q in found.values()]
    assert dropout.value == pytest.approx(5.0)
    assert dropout.lines == (f"p = {14 * 2 / 2**10:.2g}",), "14 comparisons, the two extreme signs"
    assert dropout.kind == "bad"
    assert speed.kind == "", "being slower is neither better nor worse"
    assert all(q.kind == "" for q, p in zip(found.values(), ps, strict=True) if p > 0.05)
    *_, table = step_blocks(matrix)
    assert "corrected for all 14 of this table (Holm)" in table.note
    assert [title for title, _ in table.columns][1:3] == ["interventions", "solid markings crossed"]


def pairs_of_ten_seeds(folder):
    """Configuration 2 has five points more dropout than 1 in every seed, and 3 drives as 2."""
    rng = np.random.default_rng(3)
    rows = []
    for seed in range(1, 11):
        base = float(rng.uniform(5, 12))
        speed = float(rng.uniform(40, 60))
        for config in "123":
            values = Metrics(
                fatal_collisions=int(config == "2" and seed < 4),
                serious_contacts=int(config == "2" and seed < 3),
                road_departures=0,
                lane_invasions=1,
                mean_speed_kmh=speed - (config != "1"),
                dropout_pct=base + (config != "1") * (4.945 + 0.01 * seed),
                ttc_below_1_5_s=1.0,
                mean_error_m=2.0,
                headway_variance_m2=9.0,
                radar_fpr_pct=99.0 if seed < 10 else 40.0,
                distance_km=5.0,
                duration_s=500.0,
            )
            rows.append((key(config, "clear-noon", seed), values))
    MATRIX.write(folder, rows)
    return load_matrix(folder)


def test_a_rate_has_one_interval_wherever_it_stands_on_the_page(tmp_path):
    matrix = pairs_of_ten_seeds(tmp_path)
    beside = next(row for row in side_blocks(matrix)[0].rows if row[0].text == "serious contacts")
    in_full = next(row for row in per_weather(matrix)[1].rows if row[0].text == "serious contacts")
    counted = count_table(matrix, "serious_contacts", "").rows[1][1]
    assert counted.limits is not None
    assert beside[2].limits == in_full[1].limits == counted.limits


def test_no_interval_goes_where_the_quantity_cannot_be(tmp_path):
    matrix = pairs_of_ten_seeds(tmp_path)
    skew = mean_limits([99.0] * 9 + [40.0])
    assert skew.high > 100.0, "the method alone does not know that"
    shown = mean_table(matrix, "radar_fpr_pct", "").rows[0][1].limits
    assert shown == (pytest.approx(skew.low), 100.0)
    assert possible_part(Interval(-2.0, 7.0), "dropout_pct", 0.1) == (0.0, 7.0)
    assert possible_part(Interval(-2.0, 7.0), "mean_error_m", -0.5) == (-0.5, 7.0)
    assert possible_part(Interval(1.0, 170.0), "mean_error_m", 1.0) == (1.0, 170.0)


def test_a_mean_of_some_seeds_says_of_how_many(tmp_path):
    rows = [
        (key("1", "clear-noon", seed), Metrics(radar_fpr_pct=50.0 + seed if seed < 4 else None))
        for seed in range(1, 11)
    ]
    MATRIX.write(tmp_path, rows)
    cell = mean_table(load_matrix(tmp_path), "radar_fpr_pct", "").rows[0][1]
    assert (cell.text, cell.note) == ("52", "3 of 10 seeds")


def points_of(svg, colour):
    """Marks of a colour within the axes, sorted."""
    return sorted(map(tuple, np.vstack([p for _, p in marks_of(svg, colour)]).round(6)))


@pytest.mark.req("A-259")
@pytest.mark.parametrize(
    ("caption", "column", "by_drive"),
    [
        ("Dropout against crashes", "dropout_pct", True),
        ("Crashes against mean speed", "mean_speed_kmh", False),
    ],
)
def test_each_point_of_a_scatter_is_a_drive_or_the_mean_of_a_cell(page, caption, column, by_drive):
    html, rows = page
    svg = figure(html, caption)
    for config, colour in zip(CONFIGS, PALETTE, strict=False):
        mine = rows.filter(config=config)
        if not by_drive:
            mine = mine.group_by("weather").agg(pl.col(column).mean(), pl.col("crashes").mean())
        expected = sorted(mine.select(column, pl.col("crashes").cast(pl.Float64)).rows())
        drawn = points_of(svg, colour)
        assert len(drawn) == len(expected)
        span = rows[column].max() - rows[column].min()
        for (x, y), (at, events) in zip(drawn, expected, strict=True):
            assert (x - at) / span == pytest.approx(0.0, abs=2e-3)
            assert y == pytest.approx(events, abs=0.02)


@pytest.mark.req("R-7")
def test_pictures_of_the_answers_show_the_rates_and_their_limits(tmp_path):
    matrix = pairs_of_ten_seeds(tmp_path)
    first, *_ = answers(matrix, [], {}).items
    rate = matrix.rate("crashes", "2")
    colour = PALETTE[1]  # of clear sky
    ((_, marks),) = marks_of(first.figure.svg, colour, "stroke")
    assert [x for x, _ in marks] == pytest.approx([0.0, rate.rate, 0.0], abs=1e-3)
    ((_, line),) = [c for c in curves_of(first.figure.svg, colour) if len(c[1]) == 2]
    assert line[:, 0] == pytest.approx(rate.interval, abs=2e-3)


def test_the_parts_of_a_stacked_bar_are_as_long_as_their_counts():
    parts = [Series("a", [1.0, 4.0], colour=0), Series("b", [2.0, 0.5], colour=1)]
    svg = stacked_bars(["r", "s"], parts, "crashes per run")
    (frame,) = frames(svg)
    for colour, values, starts in (
        (PALETTE[0], [1.0, 4.0], [0.0, 0.0]),
        (PALETTE[1], [2.0, 0.5], [1.0, 4.0]),
    ):
        boxes = [frame.units(s) for s in shapes(svg, colour) if frame.holds(s)]
        boxes.sort(key=lambda b: -b[:, 1].max())  # rows go down
        assert [np.ptp(b[:, 0]) for b in boxes] == pytest.approx(values, abs=5e-3)
        assert [b[:, 0].min() for b in boxes] == pytest.approx(starts, abs=5e-3)


@pytest.mark.req("A-190", "A-256")
def test_interventions_and_contacts_are_counted_in_tables_of_their_own(tmp_path):
    counts = Metrics(
        fatal_collisions=7, serious_contacts=5, road_departures=0, collisions_vehicle=3, rear_ended=1,
        collisions_static=4, off_road=2, bend_exits=1, wrong_way=0, roll_overs=2, stuck_relocations=6,
        contacts=28, contacts_light=8, contacts_medium=4, contacts_heavy=1, contacts_vulnerable=2,
        contacts_static=9, contacts_repeated=6, distance_km=5.0, duration_s=500.0,
    )  # fmt: skip
    MATRIX.write(tmp_path, [(key("1", "clear-noon", seed), counts) for seed in (1, 2)])
    matrix = load_matrix(tmp_path)
    kinds, contacts = kinds_table(matrix), grades_table(matrix)
    assert [c.text for c in kinds.rows[0][1:]] == ["6", "2", "8", "4", "2", "0", "4", "12"]
    assert kinds.rows[0][0].note == "2 runs, 10 km"
    assert [t for t, _ in contacts.columns][1:5] == [
        "contacts", "below 5 km/h", "5 to 20 km/h", "above 20 km/h"
    ]  # fmt: skip
    assert [c.text for c in contacts.rows[0][1:]] == ["56", "16", "8", "2", "4", "18", "12"]
    whole, light, medium, heavy, _, stands, again = (int(c.text) for c in contacts.rows[0][1:])
    assert whole == light + medium + heavy + stands + again
