"""The tick benchmark adds up: parts are positive and not more than the whole."""

from __future__ import annotations

from pathlib import Path

import pytest

from skidpad.campaign.bench import matrix as bench_matrix
from skidpad.campaign.bench import scenarios as bench_scenarios
from skidpad.campaign.bench import tick as bench
from skidpad.campaign.bench.tick import TickCost, bench_run, tick_cost
from skidpad.campaign.bench.traffic import measure
from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.core.vocabulary import SensorLevel
from skidpad.scenarios.playing.stage import play_ideal
from skidpad.scenarios.scenario import compile_scenario


@pytest.mark.req("A-269")
def test_parts_add_up_to_the_tick() -> None:
    cost = tick_cost(bench_run(2, "clear-noon", SensorLevel.PIXELS), seconds=1.0)
    assert set(cost.parts) == {"world", "sensors", "rendering", "stack", "supervisor", "log"}
    assert all(ms > 0.0 for ms in cost.parts.values())
    assert sum(cost.parts.values()) <= cost.mean
    assert cost.median <= cost.p99
    assert cost.median < 50.0  # CPU ms with twelve sensors; real time with room to spare


def test_rows_cover_both_levels_and_weathers(monkeypatch: pytest.MonkeyPatch) -> None:
    cost = TickCost(2.0, 2.0, 3.0, {})
    monkeypatch.setattr(bench, "warm_cost", lambda *_: cost)
    rows = list(bench.tick_costs())
    assert {r.sensors for r in rows} == {"pixels", "objects", "all images"}
    assert {r.weather for r in rows} == {"clear-noon", "rain-night"}
    assert {r.target for r in rows if r.configuration == 4} == {3.2, 0.35}


def test_the_matrix_is_estimated_for_two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    cost = TickCost(3.0, 3.0, 3.0, {})
    monkeypatch.setattr(bench_matrix, "warm_cost", lambda *_: cost)
    # 30 runs of 10 000 ticks of 3 ms: 900 s on one core.
    assert bench_matrix.estimated_minutes() == pytest.approx(7.5)


def test_traffic_is_measured_until_the_distance_is_driven() -> None:
    asked = TrafficBench(km=3.0, vehicles=20)
    row = measure(asked, "rain-noon")
    assert 3.0 <= row.km < 3.1
    assert (row.contacts, row.static) == (0, 0)
    assert row.interval.low == 0.0
    assert row.interval.high == pytest.approx(
        3.689 / row.km * 100.0, rel=1e-3
    )  # Garwood, none seen
    assert row.mean_speed_kmh == pytest.approx(row.km / row.hours)


def test_files_are_played_and_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench_scenarios, "CHECKS", 2)
    rows = bench_scenarios.measure(seconds=2.0, repeats=1)
    assert [row.unit for row in rows] == ["times real time", "times real time", "s", "s"]
    assert [row.target for row in rows] == [300.0, 300.0, 2.0, 1.0]
    assert all(row.value > 0.0 for row in rows)
    itself, driven, *_ = (row.value for row in rows)
    assert itself > driven, "the backend and the log cost time"


def test_the_measured_files_do_something(tmp_path: Path) -> None:
    small, large = tmp_path / "small.xosc", tmp_path / "large.xosc"
    text = bench_scenarios.two_cars(bench_scenarios.SLOWER, bench_scenarios.ASIDE, seconds=12.0)
    small.write_text(text, encoding="utf-8")
    result = play_ideal(compile_scenario(small), 60.0)
    last = result.of("other")[-1]
    assert last.time == pytest.approx(12.0)
    assert (last.speed, last.y) == pytest.approx((8.0, -5.25), abs=1e-3)
    text = bench_scenarios.two_cars(bench_scenarios.long_line(), seconds=1.0)
    assert 5_000_000 <= len(text) < 5_200_000
    large.write_text(text, encoding="utf-8")
    assert play_ideal(compile_scenario(large), 60.0).of("other")[-1].x == pytest.approx(210.0)


def test_a_target_is_a_bound_from_one_side() -> None:
    slow = bench_scenarios.ScenarioCost("x", 299.0, "times real time", 300.0, most=False)
    long = bench_scenarios.ScenarioCost("x", 2.1, "s", 2.0, most=True)
    assert not slow.is_met
    assert not long.is_met
    assert bench_scenarios.ScenarioCost("x", 1.9, "s", 2.0, most=True).is_met
