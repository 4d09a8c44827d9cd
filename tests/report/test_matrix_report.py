import re
from dataclasses import fields

import polars as pl
import pytest

from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.matrix import MATRIX, Metrics
from skidpad.recording.files import write_parquet
from skidpad.recording.fingerprint import reach_text
from skidpad.report.elements.tables import number
from skidpad.report.matrix.data import (
    WEATHERS,
    config_title,
    load_matrix,
    rate_by_seed,
    weather_title,
)
from skidpad.report.matrix.headline import headline_numbers, headline_tables
from skidpad.report.matrix.page import build_page, write_report
from skidpad.report.matrix.tables import per_weather
from support.matrix_drawn import RATES, key, write_drawn_campaign
from support.report_page import read_page

NONE_OF_9 = f"in at most {100 * (1 - 0.05 ** (1 / 9)):.0f} % of seeds"


@pytest.fixture(scope="module")
def html(tmp_path_factory):
    """The page of a campaign of three seeds."""
    folder = tmp_path_factory.mktemp("three")
    write_drawn_campaign(folder)
    return read_page(write_report(folder))


@pytest.mark.req("A-258", "A-259")
def test_the_report_has_every_section_and_no_link_to_the_network(html):
    for title in (
        "Crashes and interventions",
        "Findings of the sources, judged",
        "All metrics",
        "Definitions",
    ):
        assert f">{title}</h2>" in html
    assert html.count("<svg") >= 6
    assert "published 6" in html  # configuration 0, clear sunrise
    assert not re.search(r'(?:src|href)="(?:https?:)?//', html)
    assert len(html) < 15e6
    assert "Per run of 500 s" in html


@pytest.mark.req("X-7")
def test_the_report_admits_which_rule_was_settled_after_results(html):
    page = " ".join(html.split())
    assert "One rule is not blind: that a margin comes before significance" in page
    assert "settled after results of the friction campaign had been seen" in page


def test_counts_in_the_matrix_are_those_of_the_results(tmp_path):
    rows = write_drawn_campaign(tmp_path)
    matrix = load_matrix(tmp_path)
    for config in RATES:
        for weather in WEATHERS:
            counts = [
                m.fatal_collisions for k, m in rows if (k.config, k.weather) == (config, weather)
            ]
            assert matrix.rate("fatal_collisions", config, weather).events == sum(counts)


def test_equal_drives_are_named_and_count_once(tmp_path):
    rows = [
        (key("1", weather, 1, log_hash="same"), Metrics(fatal_collisions=2, distance_km=7.0))
        for weather in ("clear-noon", "rain-noon")
    ]
    MATRIX.write(tmp_path, rows)
    matrix = load_matrix(tmp_path)
    assert matrix.same_weather == [("1", ["clear-noon", "rain-noon"])]
    assert matrix.rate("fatal_collisions", "1").events == 2


@pytest.mark.req("X-2")
@pytest.mark.parametrize("places", [[], ["x"], ["x", "y"]])
def test_the_page_says_with_what_its_hash_may_be_compared(tmp_path, monkeypatch, places):
    MATRIX.write(tmp_path, [(key("1", "clear-noon", 1), Metrics(distance_km=7.0))])
    monkeypatch.setattr(CampaignFolder, "fingerprints", places)
    (section,) = (s for s in build_page(load_matrix(tmp_path)).sections if "versions" in s.title)
    assert reach_text(places) in section.blocks[0].text


def test_runs_that_did_not_finish_are_said_and_left_out(tmp_path):
    rows = [
        (key("1", "clear-noon", 1), Metrics(fatal_collisions=2, distance_km=7.0, duration_s=500)),
        (key("1", "clear-noon", 2, outcome="crashed"), Metrics()),
    ]
    MATRIX.write(tmp_path, rows)
    matrix = load_matrix(tmp_path)
    assert matrix.rate("fatal_collisions", "1", "clear-noon").runs == 1
    page = build_page(matrix)
    assert any(
        "1 of 2 runs did not finish" in getattr(b, "text", "") for b in page.sections[0].blocks
    )


def test_metrics_are_named_in_words_with_their_units(html):
    for name in (
        "mean speed, km/h",
        "time with a TTC below 1.5 s, s",
        "interventions",
        "variance of the distance error, m²",
    ):
        assert f">{name}<" in html


@pytest.mark.req("R-7")
def test_runs_of_one_seed_are_one_unit_of_a_rate_over_all_weathers():
    def runs(weathers):
        counts = (9, 4, 14, 9, 8, 10, 11, 7)
        rows = [(s, n) for s, n in enumerate(counts) for _ in range(weathers)]
        return pl.DataFrame(rows, schema=["seed", "hits"], orient="row")

    one, six = (rate_by_seed(runs(k), "hits") for k in (1, 6))
    assert (one.rate, one.runs) == (six.rate, six.runs) == (9.0, 8)
    widths = [r.interval.high - r.interval.low for r in (one, six)]
    assert widths[0] <= widths[1], "six copies of a drive tell no more than one"


@pytest.mark.req("A-256")
def test_every_metric_has_its_mean_in_a_table_per_configuration_with_all_weathers(tmp_path):
    rows = write_drawn_campaign(tmp_path)
    matrix = load_matrix(tmp_path)
    tables = per_weather(matrix)
    assert len(tables) == len(matrix.configs)
    for config, table in zip(matrix.configs, tables, strict=True):
        assert [title for title, _ in table.columns] == [
            "metric", *map(weather_title, matrix.weathers)
        ]  # fmt: skip
        once = [f for f in fields(Metrics) if f.name != "interventions"]  # also published otherwise
        for metric, row in zip(once, table.rows, strict=True):
            for weather, cell in zip(matrix.weathers, row[1:], strict=True):
                values = [
                    getattr(m, metric.name)
                    for k, m in rows
                    if (k.config, k.weather) == (config, weather)
                ]
                known = [v for v in values if v is not None]
                if known:
                    assert cell.sort == pytest.approx(sum(known) / len(known)), metric.name
                else:
                    assert cell.text == "none"


@pytest.mark.req("R-6", "R-7")
def test_crashes_departures_and_the_time_to_the_first_lead_the_page(tmp_path):
    rows = write_drawn_campaign(tmp_path, seeds=7)
    matrix = load_matrix(tmp_path)
    hits = sum(m.crashes_vehicle for k, m in rows if k.config != "0")
    numbers = headline_numbers(matrix).items
    assert [n.label for n in numbers[:2]] == ["crashes with vehicles", "departures"]
    assert numbers[0].value == str(hits), "the baseline stands in no total"
    assert numbers[0].note == f"{100 * hits / (4 * 6 * 7 * 7.0):.1f} per 100 km"
    assert (
        numbers[2].note
        == "the car was put back, after light contacts, too; 61 soon after another one"
    )
    head, per_100_km = headline_tables(matrix)
    assert head.columns[0][0] == "configuration"
    _, one, *_, safest = head.rows
    assert safest[1].text == "0.00"
    assert safest[4].text == "> 500"  # no run of configuration 4 had one: censored at its end
    assert [row[0].text for row in per_100_km.rows] == [
        config_title(c) for c in matrix.comparison_configs
    ]
    assert per_100_km.rows[0][1].sort == pytest.approx(6 * 7 * 7.0)  # km: weathers, seeds, km each
    assert per_100_km.rows[0][2].sort == pytest.approx(one[1].sort / 7.0 * 100.0)


def test_a_cell_of_the_headline_tells_one_number_with_its_bound(tmp_path):
    write_drawn_campaign(tmp_path, seeds=9)
    matrix = load_matrix(tmp_path)
    per_run, per_100_km = headline_tables(matrix)
    assert not per_run.folded
    assert per_100_km.folded, "the rest stands one click away, under its caption"
    for here, there in zip((1, 2, 3, 5), (2, 3, 4, 5), strict=True):  # the same quantity
        for own, other in zip(per_run.rows[1:], per_100_km.rows, strict=True):
            for cell, spec in ((own[here], ""), (other[there], ".1f")):
                told = [number(x, spec) for x in cell.limits or ()]
                assert cell.note == (" to ".join(told) or NONE_OF_9)
            assert other[there].sort == pytest.approx(own[here].sort / 7.0 * 100.0)  # 7 km a run
            scaled = [x / 7.0 * 100.0 for x in own[here].limits or ()]
            assert list(other[there].limits or ()) == pytest.approx(scaled)


def test_a_campaign_of_an_older_version_can_still_be_shown(tmp_path):
    write_drawn_campaign(tmp_path)
    path = tmp_path / "results.parquet"
    new = ["crashes_vehicle", "road_departures", "off_road", "fatal_first", "first_fatal_s"]
    old = pl.read_parquet(path).drop(*new, "off_lanes_pct")
    write_parquet(path, old)
    matrix = load_matrix(tmp_path)
    assert matrix.results["crashes_vehicle"].sum() == old["collisions_vehicle"].sum()
    assert matrix.results["off_road"].null_count() == len(old)
    assert "What happened, by configuration" in write_report(tmp_path).read_text()
