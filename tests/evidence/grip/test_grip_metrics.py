"""Metrics of the friction campaign on logs made by hand."""

from __future__ import annotations

import numpy as np
import pytest
from shapely.affinity import rotate, translate
from shapely.geometry import box

from skidpad.core.states import ContactEvent
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.grip.scores import (
    TOUCH,
    grip_metrics,
    grip_series,
    longest,
    npc_contact_row,
    penalties,
    route_share,
)
from skidpad.evidence.grip.study import METRICS, CellSeries, delays, distances
from skidpad.recording.campaign.grip import COLUMNS
from support.makelog import DT, drive


def going(x=0.0, y=0.0, v=10.0, yaw=0.0, vy=0.0):
    return {"x": x, "y": y, "vx": v, "vy": vy, "yaw": yaw}


def metrics(log, outcome=Outcome.COMPLETED, **more):
    return grip_metrics(
        log, outcome, **({"triggered": True, "route_length": 100.0, "ratio": 1.0} | more)
    )


@pytest.mark.req("B-100", "B-101", "B-102", "B-103")
def test_the_series_are_those_of_the_study():
    log = drive(5, lambda k: [going(10.0 * k, 1.0, 8.0), going(10.0 * k + 3.0, 5.0)])
    series = grip_series(log)
    assert series.shape == (5, 9)
    named = dict(zip(COLUMNS, series[2], strict=True))
    assert named["x"] == 1.0  # lateral
    assert named["y"] == 20.0  # along
    assert named["v"] == 8.0
    assert named["cvip"] == pytest.approx(5.0)  # centre to centre
    assert named["steer"] == pytest.approx(-0.3)  # left is negative as published
    assert named["brake"] == 1.0  # pressed or not
    assert named["throttle"] == pytest.approx(0.1)


@pytest.mark.req("B-093")
def test_with_two_vehicles_the_nearer_counts_at_each_tick():
    log = drive(2, lambda k: [going(0.0), going(10.0 + 20.0 * k), going(20.0)])
    assert grip_series(log)[:, 3].tolist() == pytest.approx([10.0, 20.0])


@pytest.mark.req("B-005", "B-104", "B-105", "B-106")
def test_score_is_route_times_a_penalty_for_each_infraction():
    hit = ContactEvent(9, 1, "", 100.0, 5.0, 0.0, 0.0)
    log = drive(10, lambda k: [going(5.0 * k), going(60.0)], contacts=[hit])
    m = metrics(log, Outcome.COLLISION)
    assert m.completion is False
    assert m.route_completion == pytest.approx(45.0)
    assert m.score == pytest.approx(45.0 * penalties()["collision_vehicle"])
    assert m.impact_kmh == pytest.approx(18.0)
    whole = metrics(drive(10, lambda k: [going(5.0 * k), going(60.0)]))
    assert (whole.completion, whole.route_completion, whole.score) == (True, 100.0, 100.0)


@pytest.mark.req("B-106")
def test_a_share_of_the_way_off_all_lanes_multiplies_by_what_remains():
    log = drive(11, lambda k: [going(2.0 * k), going(60.0)])
    off = np.arange(11) > 7  # the last three of ten steps
    m = metrics(log, off_road=off)
    assert (m.score, m.off_lanes_pct) == (pytest.approx(70.0), pytest.approx(30.0))
    hit = ContactEvent(9, -1, "wall", 100.0, 5.0, 0.0, 0.0)
    crashed = drive(11, lambda k: [going(2.0 * k), going(60.0)], contacts=[hit])
    with_both = metrics(crashed, Outcome.COLLISION, route_length=40.0, off_road=off)
    assert with_both.score == pytest.approx(50.0 * 0.65 * 0.7)


@pytest.mark.req("B-104", "B-106")
def test_whoever_leaves_the_road_has_not_completed_even_without_a_contact():
    log = drive(11, lambda k: [going(2.0 * k), going(60.0)])
    assert metrics(log, off_road=np.zeros(11, dtype=bool)).completion is True
    assert metrics(log, off_road=np.arange(11) == 5).completion is False
    assert metrics(log).completion is True


def test_a_failed_agent_has_driven_nothing_and_a_crash_no_more_than_the_route():
    assert route_share(Outcome.AGENT_ERROR, 50.0, 100.0) == 0.0
    assert route_share(Outcome.COLLISION, 150.0, 100.0) == 100.0
    assert route_share(Outcome.COLLISION, 150.0, None) is None


@pytest.mark.req("B-149")
def test_the_least_distance_is_that_of_centres():
    log = drive(5, lambda k: [going(0.0), going(20.0 - 3.0 * k)])
    assert metrics(log).min_cvip_m == pytest.approx(8.0)
    assert metrics(drive(3, lambda k: [going()])).min_cvip_m is None


@pytest.mark.req("B-145")
@pytest.mark.parametrize(
    ("slip_deg", "v", "lost"), [(5.0, 10.0, False), (25.0, 10.0, True), (25.0, 1.0, False)]
)
def test_control_is_lost_when_a_vehicle_slides_fast_enough_for_long(slip_deg, v, lost):
    slip = np.radians(slip_deg)
    moving = going(30.0, v=v * np.cos(slip), vy=v * np.sin(slip))
    m = metrics(drive(20, lambda k: [going(), moving]))
    assert m.loss_of_control_npc is lost
    assert m.loss_of_control_ego is False
    assert m.max_slip_npc_deg == pytest.approx(slip_deg if v > 3.0 else 0.0, abs=0.01)


@pytest.mark.req("B-145")
def test_a_spin_counts_even_when_it_moves_backwards():
    m = metrics(drive(20, lambda k: [going(), going(30.0, v=-10.0, yaw=3.0)]))
    assert m.loss_of_control_npc


@pytest.mark.req("B-145")
def test_what_follows_a_contact_is_no_loss_of_control():
    hit = ContactEvent(5, 1, "", 100.0, 5.0, 0.0, 0.0)
    slide = going(30.0, v=7.0, vy=7.0)
    log = drive(30, lambda k: [going(), slide if k > 5 else going(30.0)], contacts=[hit])
    assert not metrics(log, Outcome.COLLISION).loss_of_control_npc


def test_who_is_not_there_touches_nobody():
    log = drive(3, lambda k: [going(100.0), going(), going(1.0)])
    assert npc_contact_row(log) == 0
    log.present[:2, 2] = False
    assert npc_contact_row(log) == 2


@pytest.mark.parametrize("seed", range(30))
def test_touching_boxes_are_those_that_shapely_finds_close(seed):
    rng = np.random.default_rng(seed)
    pose = rng.uniform(-4.0, 4.0, (2, 2))
    yaw = rng.uniform(-3.0, 3.0, 2)
    rows = [going(100.0), *(going(*pose[i], yaw=yaw[i]) for i in range(2))]
    bodies = [
        translate(rotate(box(-2, -1, 2, 1), np.degrees(yaw[i]), origin=(0, 0)), *pose[i])
        for i in range(2)
    ]
    gap = bodies[0].distance(bodies[1])
    found = npc_contact_row(drive(1, lambda k: rows)) is not None
    if gap == 0.0:
        assert found
    elif gap > np.sqrt(2.0) * TOUCH:
        assert not found


def test_longest_run_of_true():
    assert longest(np.array([1, 1, 0, 1, 1, 1, 0], dtype=bool)) == 3
    assert longest(np.zeros(4, dtype=bool)) == 0


def cell(speed, n=6):
    """n runs with this speed over time, and noise."""
    rng = np.random.default_rng(1)
    runs = np.array([speed + 0.01 * rng.standard_normal(len(speed)) for _ in range(n)])
    return CellSeries(dict.fromkeys((*METRICS, "npc_x", "npc_y"), runs))


def braking(begin, t):
    return np.clip(20.0 - 5.0 * (t - begin), 0.0, 20.0)


@pytest.mark.req("B-142")
@pytest.mark.parametrize("late", [-1.0, 0.0, 0.6, 3.0])
def test_a_delay_is_found_where_one_series_is_the_other_shifted(late):
    t = np.arange(0.0, 25.0, DT)
    found = delays(cell(braking(8.0, t)), cell(braking(8.0 + late, t)))
    assert found == pytest.approx(np.full(6, late), abs=0.11)


@pytest.mark.req("B-142")
def test_a_series_of_another_shape_has_no_delay():
    t = np.arange(0.0, 25.0, DT)
    a, b = cell(20.0 + 0.0 * t), cell(20.0 - 10.0 * (np.sin(3.0 * t) > 0.0))
    assert np.isnan(delays(a, b)).all()


@pytest.mark.req("B-005", "B-107", "B-108", "B-148")
def test_distances_of_equal_cells_are_zero_and_of_others_above_their_floor():
    t = np.arange(0.0, 15.0, DT)
    a, b = cell(braking(5.0, t)), cell(0.5 * braking(5.0, t))
    assert all(d.value == 0.0 for d in distances(a, a, identical=True))
    found = next(iter(distances(a, b, identical=False)))
    assert found.floor is not None
    assert found.interval is not None
    assert found.floor < 0.1 * found.value
    # resamples run at 5 Hz, which shifts them by about a percent (decision G-4)
    assert 0.95 * found.interval.low < found.value < 1.05 * found.interval.high
