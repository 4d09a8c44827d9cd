"""Tables and figures of the friction page, by value: what is put in is read back."""

import re
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest

from skidpad.evidence.grip.study import METRICS, ORIGINAL, REDUCED, CellSeries, Distance, Pair
from skidpad.evidence.statistics import Interval
from skidpad.report.elements.figures import PALETTE
from skidpad.report.grip import figures
from skidpad.report.grip.data import scenario_title
from skidpad.report.grip.figures import across_weathers, both_modes, trajectories
from skidpad.report.grip.tables import completion_tables, distance_tables
from skidpad.report.grip.weathers import weather_blocks
from skidpad.report.published import Source, published_rows
from support.svg_values import curves_of, texts

N = 20


def side(failed, score=80.0, hashes=None):
    """Runs of N seeds, the first of which had an accident."""
    return pl.DataFrame(
        {
            "seed": range(N),
            "completion": [k >= failed for k in range(N)],
            "triggered": [True] * N,
            "score": [score + k % 2 for k in range(N)],
            "log_hash": hashes or [f"{failed}-{k}" for k in range(N)],
        }
    )


def pair(weather, before, after, scenario="ghost_cut_in", cutin="fixed", same=False):
    hashes = [f"same-{k}" for k in range(N)] if same else None
    return Pair(
        scenario, cutin, weather, side(before, hashes=hashes), side(after, 60.0, hashes=hashes)
    )


def campaign(pairs, **more):
    found = {(p.scenario, p.weather): p for p in pairs}
    scenarios = list(dict.fromkeys(p.scenario for p in pairs))
    return SimpleNamespace(
        pairs=found,
        scenarios=scenarios,
        titles=[(s, scenario_title(s)) for s in scenarios],
        of=lambda scenario: [p for p in pairs if p.scenario == scenario],
        **more,
    )


@pytest.mark.req("B-147")
def test_completion_is_marked_red_where_less_grip_is_worse_and_green_where_it_is_better():
    rows = completion_tables(
        campaign([pair("icy_100", 2, 14), pair("rain_20", 12, 1), pair("rain_40", 3, 4)])
    )[0].rows
    worse, better, like = rows
    assert [[c.text for c in row[:3]] for row in rows] == [
        ["icy_100", "90.0", "30.0"], ["rain_20", "40.0", "95.0"], ["rain_40", "85.0", "80.0"]
    ]  # fmt: skip
    assert (worse[1].kind, worse[2].kind, worse[7].kind) == ("", "bad", "bad")
    assert (better[1].kind, better[2].kind) == ("", "good")
    assert {c.kind for c in like[1:3]} == {""}
    assert worse[3].text == "p < 0.001"  # twelve pairs lost, none gained: 2 / 2^12
    assert like[3].text == "p = 1"
    assert (worse[6].text, worse[7].text) == ("80.50", "60.50")
    # 18 of 20, exactly: Clopper and Pearson (1934)
    assert worse[1].note.split("\n")[0] == "68 to 99, n = 20"


@pytest.mark.req("B-147")
def test_the_published_completion_stands_below_ours_and_contradictions_are_marked():
    rows = published_rows(Source.COMPLETION, "scenario", "preset", "friction_mode")
    doubted = next(k for k, r in rows.items() if r["consistency_flag_derived"] != "ok")
    scenario, weather, friction = doubted
    table = completion_tables(campaign([pair(weather, 2, 14, scenario)]))[0]
    cell = table.rows[0][1 if friction == ORIGINAL else 2]
    assert f"published {rows[doubted]['completion_rate_pct']:g} ?" in cell.note
    assert cell.published == rows[doubted]["completion_rate_pct"]


@pytest.mark.req("B-148")
def test_distances_stand_with_their_floor_and_the_published_value_and_baselines_say_so():
    found = {
        m: Distance(m, value, Interval(value - 0.5, value + 0.5), floor)
        for m, value, floor in zip(
            METRICS, (9.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0), [2.5] * 7, strict=True
        )
    }
    none = {m: Distance(m, 0.0, Interval(0.0, 0.0), 2.5) for m in METRICS}
    pairs = [pair("rain_0", 2, 2, same=True), pair("icy_100", 2, 14)]
    distances = {("ghost_cut_in", "rain_0"): none, ("ghost_cut_in", "icy_100"): found}
    baseline, icy = distance_tables(campaign(pairs, distances=distances))[0].rows
    assert (baseline[0].note, icy[0].note) == ("baseline: the same drives", "")
    assert [c.text for c in baseline[1:]] == ["0"] * 7
    assert [c.text for c in icy[1:]] == ["9", "2", "3", "4", "5", "6", "7"]
    assert [c.kind for c in icy[1:3]] == ["", "muted"], "2 lies below what chance alone gives"
    rows = published_rows(Source.WARPING, "scenario", "preset", "metric")
    theirs = rows["ghost_cut_in", "icy_100", METRICS[0]]["dtw_distance"]
    assert icy[1].note.split("\n") == ["8.5 to 9.5", "floor 2.5", f"published {theirs:g}"]


def series(speed, runs=6, ticks=80):
    t = np.arange(ticks) * 0.05
    names = ("x", "y", "v", "cvip", "steer", "brake", "throttle", "npc_x", "npc_y")
    values = {name: np.tile(speed * t, (runs, 1)) for name in names}
    values["steer"] = np.tile(0.1 * np.sin(t), (runs, 1))
    return CellSeries(values)


def drawn(svg, colour):
    """Lines of a colour in a chart."""
    return len(re.findall(rf'style="fill: none; stroke: {colour}', svg))


@pytest.mark.req("B-140", "B-141")
def test_each_shown_cell_has_distance_speed_steering_and_the_density_of_steering():
    pairs = [pair("icy_100", 2, 14), pair("rain_20", 2, 3)]
    speeds = {ORIGINAL: 10.0, REDUCED: 8.0}
    found = both_modes(campaign(pairs, series=lambda _, friction: series(speeds[friction])))
    assert len(found) == 1, "of these only icy_100 is one that the source shows"
    assert found[0].caption.startswith("Ghost cut-in, icy_100: medians over runs still driving")
    words = {t for t, *_ in texts(found[0].svg)}
    assert {"distance, m", "speed, m/s", "steering, left negative", "density"} <= words
    assert {ORIGINAL, REDUCED} <= words
    for colour in PALETTE[:2]:  # a line in each of four panels and one in the legend
        assert drawn(found[0].svg, colour) == 5
        bands = re.findall(rf"fill: {colour}; fill-opacity: 0.15", found[0].svg)
        assert len(bands) == 3, "of the three series"


@pytest.mark.req("B-141")
def test_weathers_of_a_scenario_are_compared_in_each_friction():
    pairs = [pair(f"icy_{k}", 2, 3) for k in (30, 100)]
    (figure,) = across_weathers(campaign(pairs, series=lambda *_: series(10.0)))
    words = [t for t, *_ in texts(figure.svg)]
    assert {"reduced friction", "original friction", "icy_30", "icy_100"} <= set(words)
    assert drawn(figure.svg, PALETTE[0]) == 3  # both charts and the legend


@pytest.mark.req("B-124", "B-146")
def test_ways_are_drawn_for_both_frictions_and_for_the_three_variants():
    cells = [pair("icy_30", 2, 3)]
    variants = {name: pair("rain_0", 2, 2, cutin=name) for name in ("original", "unfixed", "fixed")}
    ways = trajectories(campaign(cells, variants=variants, series=lambda *_: series(10.0, runs=4)))
    modes, three = ways
    assert modes.caption == "Ghost cut-in, icy_30: ways of ego and ghost. 4 runs each."
    assert {"original friction", "reduced friction"} <= {t for t, *_ in texts(modes.svg)}
    assert three.caption.startswith("Ghost cut-in: ways in the three variants")
    words = [t for t, *_ in texts(three.svg)]
    assert [w for w in words if w in variants] == ["original", "unfixed", "fixed"]
    for colour in PALETTE[:2]:  # four runs of ego and ghost in three panels, and the legend
        assert drawn(three.svg, colour) == 4 * 3 + 1


def ratios(model, **by_weather):
    rows = [
        {"weather": weather, "friction": friction, "ratio": ratio, "model": model}
        for weather, ratio in by_weather.items()
        for friction, ratio in ((ORIGINAL, 1.0), (REDUCED, ratio), (REDUCED, ratio))
    ]
    return SimpleNamespace(plain=pl.DataFrame(rows), values=lambda column: model)


@pytest.mark.req("B-031", "A-258")
def test_weathers_stand_with_their_parameters_and_the_published_ratio():
    (table,) = weather_blocks(ratios("statistical", icy_30=0.31502, rain_20=0.635775, snow=0.4))
    heads = [title for title, _ in table.columns]
    assert heads[:4] == ["weather", "cloudiness, %", "precipitation, %", "deposits, %"]
    assert [[c.text for c in row] for row in table.rows] == [
        ["rain_20", "20", "20", "20", "20", "5", "20", "0", "0.636"],
        ["icy_30", "20", "0", "0", "30", "0", "10", "30", "0.315"],
    ]
    assert [row[-1].published for row in table.rows] == [0.63, 0.31]
    assert "Both are of the statistical model" in table.note
    (other,) = weather_blocks(ratios("physical", rain_20=0.8))
    assert "Ours are of the model physical" in other.note
    assert weather_blocks(ratios("statistical", snow=0.4)) == []


@pytest.mark.req("B-140", "B-141")
def test_every_panel_of_a_cell_has_the_medians_of_its_own_quantity():
    """Runs whose quantities grow by 1 to 7 per second, so that no two panels can be exchanged."""
    slopes = dict(
        zip(("x", "y", "v", "cvip", "steer", "brake", "throttle"), range(1, 8), strict=True)
    )

    def cell(scale):
        t = np.arange(80) * 0.05
        values = {name: np.tile(scale * k * t, (6, 1)) for name, k in slopes.items()}
        return CellSeries(values | {"npc_x": values["x"], "npc_y": values["y"]})

    scales = {ORIGINAL: 1.0, REDUCED: 0.5}
    pairs = campaign([pair("icy_100", 2, 14)], series=lambda _, friction: cell(scales[friction]))
    (figure,) = both_modes(pairs)
    for colour, scale in zip(PALETTE, (1.0, 0.5), strict=False):
        lines = {k: p for k, p in curves_of(figure.svg, colour) if len(p) > 10}
        for k, quantity in enumerate(("cvip", "v", "steer")):
            assert lines[k][-1] == pytest.approx([3.95, scale * slopes[quantity] * 3.95], rel=2e-3)


@pytest.mark.req("B-141")
def test_distances_across_weathers_are_those_of_each_weather_and_friction():
    pairs = [pair(f"icy_{k}", 2, 3) for k in (30, 100)]
    speed = {("icy_30", REDUCED): 4.0, ("icy_100", REDUCED): 8.0,
             ("icy_30", ORIGINAL): 10.0, ("icy_100", ORIGINAL): 12.0}  # fmt: skip
    (figure,) = across_weathers(
        campaign(pairs, series=lambda p, friction: series(speed[p.weather, friction]))
    )
    for colour, weather in zip(PALETTE, ("icy_30", "icy_100"), strict=False):
        ends = {k: p[-1] for k, p in curves_of(figure.svg, colour)}
        for k, friction in enumerate((REDUCED, ORIGINAL)):
            assert ends[k] == pytest.approx([3.95, 3.95 * speed[weather, friction]], rel=2e-3)


@pytest.mark.req("B-146")
def test_ways_lie_where_ego_and_ghost_drove():
    values = series(10.0, runs=4).values | {"x": np.tile(np.linspace(0, -3.5, 80), (4, 1))}
    values["npc_x"] = np.tile(np.linspace(-3.5, 0.0, 80), (4, 1))
    cell = CellSeries(values)
    (modes, *_) = trajectories(
        campaign([pair("icy_30", 2, 3)], variants={}, series=lambda *_: cell)
    )
    for colour, first, last in ((PALETTE[1], 0.0, -3.5), (PALETTE[0], -3.5, 0.0)):
        drawn_ways = [p for _, p in curves_of(modes.svg, colour) if len(p) > 10]
        assert len(drawn_ways) == 8, "four runs in each of two panels"
        for way in drawn_ways:
            assert way[0][1] == pytest.approx(first, abs=0.02)
            assert way[-1][1] == pytest.approx(last, abs=0.02)
        lower = [way for way in drawn_ways if not np.isnan(way).any()]
        assert len(lower) == 4, "the panels share the axis below the last of them"
        assert [way[-1][0] for way in lower] == pytest.approx([39.5] * 4, abs=0.05)


def lateral_ends(svg, colour):
    """By panel, where the ways of a colour end across the road."""
    ends = {}
    for panel, way in curves_of(svg, colour):
        if len(way) > 10:
            ends.setdefault(panel, set()).add(round(float(way[-1][1]), 1))
    return [ends[panel] for panel in sorted(ends)]


@pytest.mark.req("B-124", "B-146")
def test_each_panel_has_the_ways_of_its_own_friction_and_variant():
    """Egos that end 1 to 5 m left, so that no two panels can be exchanged."""
    offsets = {
        ("icy_30", ORIGINAL): 1.0, ("icy_30", REDUCED): 2.0,
        ("original", ORIGINAL): 3.0, ("unfixed", ORIGINAL): 4.0, ("fixed", ORIGINAL): 5.0,
    }  # fmt: skip

    def ways_of(of, friction):
        name = of.weather if of.weather == "icy_30" else of.cutin
        left = -np.tile(np.linspace(0.0, offsets[name, friction], 80), (2, 1))
        return CellSeries(series(10.0, runs=2).values | {"x": left})

    variants = {name: pair("rain_0", 2, 2, cutin=name) for name in ("fixed", "original", "unfixed")}
    cells = campaign([pair("icy_30", 2, 3)], variants=variants, series=ways_of)
    modes, three = trajectories(cells)
    assert lateral_ends(modes.svg, PALETTE[1]) == [{-1.0}, {-2.0}]
    assert lateral_ends(three.svg, PALETTE[1]) == [{-3.0}, {-4.0}, {-5.0}]


@pytest.mark.req("B-005", "B-140")
def test_the_density_is_that_of_steering_and_bands_hold_eight_runs_of_ten(monkeypatch):
    """Ten runs whose speeds are 0 to 9 m/s; steering is spread evenly to the left, or to both sides."""
    drawn_charts = []
    monkeypatch.setattr(figures, "curves", lambda charts, **_: drawn_charts.extend(charts) or "")
    lowest = {ORIGINAL: 0.0, REDUCED: -0.4}

    def cell(friction):
        values = {name: np.full((10, 400), 50.0) for name in (*METRICS, "npc_x", "npc_y")}
        values["v"] = np.tile(np.arange(10.0)[:, None], (1, 400))
        values["steer"] = np.tile(np.linspace(lowest[friction], 0.4, 400), (10, 1))
        return CellSeries(values)

    both_modes(campaign([pair("icy_100", 2, 14)], series=lambda _, friction: cell(friction)))
    _, speed, _, density = drawn_charts
    assert (density.log, [c.name for c in density.curves]) == (True, [ORIGINAL, REDUCED])
    for curve, left, right in zip(density.curves, (1e-3, 1.25), (2.5, 1.25), strict=True):
        assert np.interp((-0.2, 0.2), curve.x, curve.y) == pytest.approx((left, right), rel=0.05)
    low, high = speed.curves[0].band
    assert (low[0], speed.curves[0].y[0], high[0]) == pytest.approx((0.9, 4.5, 8.1))


@pytest.mark.req("B-147")
def test_no_limit_of_a_score_goes_beyond_100():
    one = pair("icy_30", 0, 0)
    runs = one.reduced.with_columns(score=pl.when(pl.col("seed") > 0).then(100.0).otherwise(60.0))
    table = completion_tables(
        campaign([Pair(one.scenario, one.cutin, one.weather, one.original, runs)])
    )[0]
    low, high = table.rows[0][-1].limits
    assert high == 100.0, "a skew mean of 98 has limits of its own beyond that"
    assert low < 98.0
