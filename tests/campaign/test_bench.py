"""The tick benchmark adds up: parts are positive and not more than the whole."""

from __future__ import annotations

import pytest

from skidpad.campaign import bench, bench_matrix
from skidpad.campaign.bench import TickCost, bench_run, tick_cost
from skidpad.campaign.bench_traffic import measure
from skidpad.campaign.traffic_asked import TrafficBench
from skidpad.core.vocabulary import SensorLevel


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
