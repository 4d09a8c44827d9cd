"""The metrics on the bundled map: batches against single questions, leads, bridges, whole drives."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.states import StackReport
from skidpad.core.vocabulary import DetectionStatus
from skidpad.evidence.drive.lanematch import DRIVEN, LaneIndex
from skidpad.evidence.drive.metrics import run_metrics
from skidpad.evidence.drive.prepared import prepare
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import LanePoint, RoadMap
from support.makelog import drive


@pytest.fixture(scope="module")
def figure8() -> RoadMap:
    return load_map("figure8")


def on(place: LanePoint, v: float = 0.0) -> dict[str, float]:
    c, s = np.cos(place.heading), np.sin(place.heading)
    return {
        "x": place.x,
        "y": place.y,
        "z": place.z,
        "yaw": place.heading,
        "vx": v * c,
        "vy": v * s,
    }


def start(road_map: RoadMap) -> LanePoint:
    assert road_map.ego_start is not None
    return road_map.place(road_map.ego_start)


def test_batches_agree_with_single_projections(figure8: RoadMap) -> None:
    rng = np.random.default_rng(8)
    a = figure8.samples
    rows = np.flatnonzero(np.isin(figure8.lanes.kind[a.lane], DRIVEN))
    rows = rng.choice(rows, 400)
    x, y = a.x[rows] + rng.normal(0, 1.5, 400), a.y[rows] + rng.normal(0, 1.5, 400)
    found = LaneIndex(a, figure8.lanes).match(x, y, a.z[rows])
    agree = 0
    for k in range(400):
        place = figure8.project(x[k], y[k], a.z[rows[k]])
        assert place is not None
        if found.lane[k] == place.lane:
            agree += 1
            assert found.s[k] == pytest.approx(place.s, abs=0.3)
            assert found.offset[k] == pytest.approx(place.offset, abs=0.05)
        else:  # on an edge, or where lanes lie on each other
            assert abs(found.offset[k]) == pytest.approx(abs(place.offset), abs=0.1)
    assert agree > 360


def test_a_lead_is_found_all_the_way_round(figure8: RoadMap) -> None:
    places = [start(figure8)]
    while len(places) < 290:
        following = figure8.ahead(places[-1], 10.0)
        assert following is not None
        places.append(following)
    log = drive(280, lambda k: [on(places[k], 20.0), on(places[k + 4], 15.0)])
    lead = prepare(log, figure8).lead
    assert np.all(lead.actor == 1)
    assert lead.gap == pytest.approx(40.0 - 4.0, abs=0.8)  # ends of lanes of unlike length
    assert lead.v_closing == pytest.approx(5.0, abs=0.1)
    assert np.all(lead.overlap)


@pytest.mark.req("A-236")
def test_cars_above_each_other_are_no_leads(figure8: RoadMap) -> None:
    a = figure8.samples
    on_lane = np.isin(figure8.lanes.kind[a.lane], DRIVEN)
    rows = np.flatnonzero(on_lane & (a.z > a.z.min() + 6.0))
    low = np.flatnonzero(on_lane)
    pairs = []
    for i in rows:
        apart = np.hypot(a.x[low] - a.x[i], a.y[low] - a.y[i])
        under = low[(apart < 2.0) & (a.z[low] < a.z[i] - 5.0)]
        pairs += [(i, j) for j in under[:1]]
    assert pairs, "figure8 crosses itself"

    def car(i: int) -> dict[str, float]:
        return {"x": a.x[i], "y": a.y[i], "z": a.z[i], "yaw": a.heading[i], "vx": 20.0}

    log = drive(len(pairs), lambda k: [car(pairs[k][0]), car(pairs[k][1])])
    assert np.all(prepare(log, figure8).lead.actor == -1)
    log = drive(len(pairs), lambda k: [car(pairs[k][1]), car(pairs[k][0])])
    assert np.all(prepare(log, figure8).lead.actor == -1)


@pytest.mark.req("A-032", "A-245")
def test_a_lap_in_the_lane_centre(figure8: RoadMap) -> None:
    places = [start(figure8)]
    for _ in range(299):
        following = figure8.ahead(places[-1], 1.0)
        assert following is not None
        places.append(following)
    seen = StackReport(status=DetectionStatus.NO_TARGET, detected=False)
    log = drive(300, lambda k: [on(places[k], 20.0)], report=lambda _k: seen)
    m = run_metrics(log, figure8)
    assert m.lateral_max_m == pytest.approx(0.0, abs=0.02)
    assert m.mean_speed_kmh == pytest.approx(72.0)
    assert m.distance_km == pytest.approx(0.3)
    assert (m.samples, m.fp, m.tn, m.fatal_collisions) == (300, 0, 300, 0)
