"""Which radar points may be the lead, and which of them drive in the ego's lane."""

from __future__ import annotations

from functools import partial
from math import cos, radians, sin

import numpy as np
import pytest

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import DetectionStatus
from skidpad.roads.bundled import load_map
from skidpad.stack.adas import AdasStack
from skidpad.stack.memory import new_memory
from skidpad.stack.perception.lane_view import NOWHERE as STRAIGHT
from skidpad.stack.perception.radar import (
    HALF_WIDTH,
    MOUNT,
    PARABOLA_HALF_WIDTH,
    RadarRules,
    velocity_limit,
)
from support.stack_parts import NO_RADAR, Lanes, find_in_lane, place_of, read_radar
from support.stackfakes import LANE_WIDTH, SPECS, ArcMap, Car, ego_at, frame, radar_points

approx = pytest.approx
MAP = ArcMap()
NOWHERE = np.zeros(len(MAP.lanes.road), np.bool_)


def prefilter(
    *points, v=20.0, view=STRAIGHT, tracking=False, half_width=HALF_WIDTH, known_before=None
):
    """Nearest point that passes, with its number of companions; no lane check."""
    rules = RadarRules(True, half_width, by_map=False, nearest_only=False)
    at = place_of(Pose(0.0, 0.0), v, view)
    return read_radar(rules, radar_points(*points), at, MAP, NOWHERE, tracking, known_before)


def passes(*point, **options):
    return prefilter(point, **options).pre is not None


@pytest.mark.req("A-068")
def test_keeps_4_m_about_the_path():
    for r in (10.0, 40.0, 70.0):
        for side in (1.0, -1.0):
            at = side * np.arcsin(3.95 / r)
            assert passes(r, at, 0.0, -5.0)
            assert not passes(r, side * np.arcsin(4.05 / r), 0.0, -5.0)


@pytest.mark.req("A-068", "A-067")
def test_path_follows_yaw_error_and_curvature():
    """A car in the lane of a bend, seen by an ego turned against it, in closed form."""
    for curvature, yaw in ((1 / 200, 0.05), (-1 / 200, 0.05), (1 / 300, -0.1)):
        map = ArcMap(curvature)
        ego = Pose(0.0, 0.0, yaw=yaw)
        view = Lanes(map).view(ego)
        x, y, _ = map._point(50.0, 0.0)
        r, azimuth = float(np.hypot(x, y)), float(np.arctan2(y, x)) - yaw
        assert passes(r, azimuth, 0.0, -5.0, view=view)
        assert passes(r, azimuth + 0.06, 0.0, -5.0, view=view)
        assert not passes(r, azimuth + 0.1, 0.0, -5.0, view=view)
        assert not passes(r, azimuth - 0.1, 0.0, -5.0, view=view)


@pytest.mark.req("A-069")
@pytest.mark.parametrize(
    ("r", "kept"), [(0.095, False), (0.105, True), (79.9, True), (80.0, False), (85.0, False)]
)
def test_keeps_0_1_to_80_m(r, kept):
    assert passes(r, 0.0, 0.0, -5.0) is kept


@pytest.mark.req("A-054", "A-070")
@pytest.mark.parametrize(
    ("altitude", "kept"),
    [
        *((-0.051, False), (-0.049, True), (0.079, True), (0.081, False)),
        (-0.05, False),  # the limit itself; 0.08 in single precision lies below 0.08
    ],
)
def test_keeps_altitudes_in_radians(altitude, kept):
    assert passes(30.0, 0.0, altitude, -5.0) is kept


@pytest.mark.req("A-071", "A-074")
def test_velocity_limit_is_that_of_standing_objects():
    assert AdasStack(SPECS, ArcMap(), {}).memory["velocity_limit"] == -15.6
    assert [velocity_limit(v) for v in (0.0, 20.0, 35.0)] == approx([0.5, -19.5, -34.5])
    v = 150 / 3.6  # the floor also rejects slow vehicles here (D-033)
    assert velocity_limit(v) == -35.0
    assert not passes(60.0, 0.0, 0.0, -35.1, v=v)
    assert passes(60.0, 0.0, 0.0, -34.9, v=v)


@pytest.mark.req("A-072")
@pytest.mark.parametrize(
    ("r", "velocity", "tracking", "kept"),
    [
        (19.9, -30.0, False, True),
        (20.1, -30.0, False, False),
        (20.1, -19.6, False, False),
        (20.1, -19.4, False, True),
        (39.9, -30.0, True, True),
        (40.1, -30.0, True, False),
        (79.0, -19.4, False, True),
    ],
)
def test_standing_objects_stay_only_when_near(r, velocity, tracking, kept):
    assert passes(r, 0.0, 0.0, velocity, v=20.0, tracking=tracking) is kept


@pytest.mark.req("A-073")
def test_tracking_begins_the_tick_after_vision_confirmed():
    """A standing car at 35 m: only a radar that tracks keeps it."""
    stack = AdasStack(SPECS, ArcMap(), {"configuration": 2})
    seen = []
    for k in range(7):
        stack.tick(frame(k, [Car(35.0)], ego_at(v=20.0), radar=[(33.0, 0.0, 0.0, -20.0)]))
        seen.append((stack.report.status is DetectionStatus.FUSION_DETECT, stack.report.radar_pre))
    assert [confirmed for confirmed, _ in seen] == [False] * 3 + [True] * 4
    assert [r is not None for _, r in seen] == [False] * 4 + [True] * 3


@pytest.mark.req("A-066", "A-075")
def test_each_measurement_stands_alone():
    far, near, side = (50.0, 0.0, 0.0, -4.0), (30.0, 0.01, 0.0, -6.0), (30.0, 0.5, 0.0, 0.0)

    measure = partial(prefilter, known_before=(new_memory(), np.empty(400, np.int64)))
    two = measure(far, side, near)
    assert (two.pre, two.lane, two.velocity, two.points) == (30.0, 30.0, -6.0, 2)
    assert measure() == NO_RADAR
    assert measure(side) == NO_RADAR
    assert measure(far).pre == 50.0
    many = [(20.0 + 0.1 * i, 0.0, 0.0, -1.0) for i in range(400)]
    assert measure(*many[::-1]).points == 400
    assert measure(*many[::-1]).pre == 20.0


def lane_match(map, pose, r, azimuth=0.0):
    tracker = Lanes(map)
    points, here = radar_points((r, azimuth, 0.0, 0.0)), place_of(pose, 0.0, tracker.view(pose))
    return find_in_lane(map, tracker.on_highway, points, 1, here) == 0


@pytest.mark.req("A-076")
def test_lane_is_that_of_the_point_on_the_map():
    map = ArcMap(curvature=1 / 250)
    for x, y, yaw in ((0.0, 0.0, 0.0), (0.0, 0.5, 0.03)):
        pose = Pose(x, y, yaw=yaw)
        for r in (20.0, 60.0):
            for lanes in (0, 1):
                px, py, _ = map._point(r, lanes * LANE_WIDTH)
                # as the radar sees it, MOUNT ahead of the ego's origin
                dx = px - x - MOUNT * np.cos(yaw)
                dy = py - y - MOUNT * np.sin(yaw)
                seen = np.hypot(dx, dy), np.arctan2(dy, dx) - yaw
                assert lane_match(map, pose, *seen) is (lanes == 0)


@pytest.mark.req("A-076")
def test_mount_is_2_m_ahead_of_the_origin():
    """Read off where the point crosses from one road into the next that nobody reaches."""
    map = ArcMap(piece=100.0, leads_on=False)
    assert lane_match(map, Pose(50.0, 0.0), 47.9)
    assert not lane_match(map, Pose(50.0, 0.0), 48.1)


@pytest.mark.req("A-077")
def test_places_off_the_highway_count_as_the_lane_on_their_left():
    """Lane 0 is a slip road with an id of its own; its left neighbour is on the highway."""
    map = ArcMap()
    map.lanes = map.lanes._replace(
        road=np.where(np.arange(24) % 3 == 0, map.lanes.road + 50, map.lanes.road)
    )
    map.off_highway = frozenset(range(51, 59))
    left = np.arcsin(LANE_WIDTH / 40.0)
    for y in (0.0, LANE_WIDTH):
        assert lane_match(map, Pose(0.0, y), 40.0), "both on one lane"
    assert lane_match(map, Pose(0.0, 0.0), 40.0, left), "target on the highway, ego beside it"
    assert lane_match(map, Pose(0.0, LANE_WIDTH), 40.0, -left), "and the other way round"
    assert not lane_match(map, Pose(0.0, 0.0), 40.0, np.arcsin(2 * LANE_WIDTH / 40.0))
    map.lanes = map.lanes._replace(left=np.full(24, -1, np.int32))
    assert not lane_match(map, Pose(0.0, 0.0), 40.0, left), "no lane on the left: it stays"


@pytest.mark.req("A-078")
@pytest.mark.parametrize(
    ("piece", "x", "r", "same"),
    [
        (90.0, 0.0, 35.0, True),  # target and ego on one road
        (36.0, 0.0, 35.0, True),  # target on the next road, on which the look ahead ends too
        (25.0, 19.5, 20.0, True),  # target at 41.5 m, look ahead ends at 49.5 m: both on road 2
        (25.0, 20.5, 20.0, False),  # it ends at 50.5 m, on road 3: missed, as written
        (8.0, 0.0, 20.0, False),
    ],
)
def test_lane_reached_after_range_plus_10_m_is_the_same(piece, x, r, same):
    assert lane_match(ArcMap(piece=piece), Pose(x, 0.0), r) is same


@pytest.mark.req("A-083")
def test_off_the_map_is_not_in_the_lane():
    map = ArcMap()
    assert not lane_match(map, Pose(0.0, 500.0), 30.0)
    assert not lane_match(map, Pose(0.0, 0.0), 60.0, radians(80.0))
    assert lane_match(map, Pose(0.0, 0.0), 60.0)


LEFT = float(np.arcsin(LANE_WIDTH / 30.0))


@pytest.mark.req("A-082")
def test_all_points_are_matched_and_the_nearest_in_the_lane_counts():
    map, points = ArcMap(), radar_points((30.0, LEFT, 0.0, -3.0), (50.0, 0.0, 0.0, -5.0))
    tracker = Lanes(map)
    here = place_of(Pose(0.0, 0.0), 20.0, tracker.view(Pose(0.0, 0.0)))
    both = RadarRules(True, HALF_WIDTH, by_map=True, nearest_only=False)
    reading = read_radar(both, points, here, map, tracker.on_highway)
    assert (reading.pre, reading.lane, reading.velocity) == approx((30.0, 50.0, -5.0))
    reading = read_radar(both._replace(nearest_only=True), points, here, map, tracker.on_highway)
    assert (reading.pre, reading.lane, reading.velocity) == (30.0, None, -3.0)


def status_of(settings, radar, cars=()):
    stack = AdasStack(SPECS, ArcMap(), {"configuration": 2, "set": settings})
    for k in range(6):
        stack.tick(frame(k, cars, ego_at(v=20.0), radar=radar))
    return stack.report


@pytest.mark.req("A-079")
def test_vision_is_not_asked_for_its_lane():
    beside = [(30.0, LEFT, 0.0, -3.0)]
    seen = status_of({}, beside, [Car(30.0)])
    assert (seen.status, seen.distance) == (DetectionStatus.FUSION_DETECT, approx(30.0))
    assert seen.radar_lane is None


@pytest.mark.req("A-081")
def test_a_point_off_the_lane_is_no_target():
    beside = [(30.0, LEFT, 0.0, -3.0)]
    clear = status_of({}, beside)
    assert (clear.status, clear.detected) == (DetectionStatus.NO_TARGET, False)
    assert (clear.distance, clear.time_gap) == (None, None)
    listed = status_of({"rejected_stays_active": True}, beside)
    assert (listed.status, listed.detected) == (DetectionStatus.RADAR_ACTIVE, False)
    assert listed.time_gap is None


@pytest.mark.req("A-084")
def test_compatibility_corridor_is_1_6_m_and_asks_no_map():
    inside, outside = np.arcsin(1.55 / 30.0), np.arcsin(1.65 / 30.0)
    assert passes(30.0, inside, 0.0, -3.0, half_width=PARABOLA_HALF_WIDTH)
    assert not passes(30.0, outside, 0.0, -3.0, half_width=PARABOLA_HALF_WIDTH)
    parabola = status_of({"radar_corridor": "parabola"}, [(30.0, float(inside), 0.0, -3.0)])
    assert parabola.status is DetectionStatus.RADAR_ACTIVE
    # 3.5 m is a lane to the left, but 1.9 m beside the path is the same lane
    wide = float(np.arcsin(1.7 / 30.0))
    assert status_of({"radar_corridor": "parabola"}, [(30.0, wide, 0.0, -3.0)]).radar_pre is None
    assert status_of({}, [(30.0, wide, 0.0, -3.0)]).radar_lane == approx(30.0)


@pytest.mark.req("A-038")
def test_suite_without_radar_drives_by_cameras_alone():
    ahead = [(30.0, 0.0, 0.0, -3.0)]
    assert status_of({}, ahead).status is DetectionStatus.RADAR_ACTIVE
    reduced = status_of({"radar": False}, ahead)
    assert (reduced.status, reduced.radar_pre) == (DetectionStatus.NO_TARGET, None)
    assert status_of({"radar": False}, ahead, [Car(30.0)]).distance == approx(30.0)
    without = AdasStack(SPECS[:4], ArcMap(), {"set": {"radar": False}})
    assert without.tick(frame()).brake >= 0.0


@pytest.mark.req("A-080")
def test_both_filter_levels_are_reported_whatever_the_functions():
    beside = [(30.0, LEFT, 0.0, -3.0)]
    for configuration in range(5):
        stack = AdasStack(SPECS, ArcMap(), {"configuration": configuration})
        stack.tick(frame(0, (), ego_at(v=20.0), radar=beside))
        assert (stack.report.radar_pre, stack.report.radar_lane) == (30.0, None)
        assert stack.report.radar_points == 1


def test_azimuth_is_left_positive():
    view = STRAIGHT._replace(yaw_error=0.1)
    assert 40.0 * sin(0.1) < 4.0 < 40.0 * sin(0.2)
    assert passes(40.0, -0.1, 0.0, -5.0, view=view)
    assert not passes(40.0, 0.1, 0.0, -5.0, view=view)


@pytest.mark.req("A-068")
def test_the_stack_keeps_4_m_about_the_path():
    for left, kept in ((3.9, True), (4.1, False)):
        report = status_of({}, [(40.0, float(np.arcsin(left / 40.0)), 0.0, -3.0)])
        assert (report.radar_pre is not None) is kept


def is_in_lane(map, pose, view, on_highway, r, azimuth):
    """A-076 to A-078 point by point, by the questions that the map answers."""

    def onto_highway(point):
        for _ in range(8):
            left = map.left(point)
            if on_highway[point.lane] or left is None:
                break
            point = left
        return point

    bearing = pose.yaw + azimuth
    target = map.project(
        pose.x + MOUNT * cos(pose.yaw) + r * cos(bearing),
        pose.y + MOUNT * sin(pose.yaw) + r * sin(bearing),
        pose.z,
    )
    if target is None or view.lane < 0:
        return False
    target, ego = onto_highway(target), onto_highway(map.at(view.lane, view.s))
    place = (target.road, target.lane_id)
    reached = [ego, *map.all_ahead(ego, r + 10.0)]
    return place in {(p.road, p.lane_id) for p in reached}


@pytest.mark.req("A-076", "A-077", "A-078", "A-083")
@pytest.mark.parametrize("name", ["figure8", "town"])
def test_kernel_finds_the_point_that_the_map_s_own_answers_name(name):
    """Places all over the map, beside the highway, before forks and at ends of roads."""
    map, rng, found = load_map(name), np.random.default_rng(7), []
    tracker = Lanes(map)
    for _ in range(250):
        lane = int(rng.integers(len(map.lanes.road)))
        at = map.at(lane, float(rng.uniform(0.0, map.lanes.length[lane])))
        pose = Pose(at.x, at.y, at.z, yaw=at.heading + rng.normal(scale=0.05))
        view = tracker.view(pose)
        points = radar_points(
            *((r, rng.normal(scale=0.1), 0.0, 0.0) for r in rng.uniform(5.0, 80.0, 4))
        )
        seen = zip(points.range.tolist(), points.azimuth.tolist(), strict=True)
        inside = [
            k for k, at in enumerate(seen) if is_in_lane(map, pose, view, tracker.on_highway, *at)
        ]
        here = place_of(pose, 0.0, view)
        found.append(find_in_lane(map, tracker.on_highway, points, 4, here))
        assert found[-1] == (inside[0] if inside else -1)
    assert {-1, 0, 1} <= set(found)
