"""Our importer against CARLA's own OpenDRIVE reader (decision M-15).

`get_waypoint` finds s on coarse chords (0.5 m off in bends), so it decides lanes and nearness only;
position, heading and width are compared with `get_waypoint_xodr` at our s.
"""

from __future__ import annotations

import re
from math import degrees, hypot
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from skidpad.core.geometry import wrap_angle
from skidpad.core.maths.lefthanded import pose_from_carla
from skidpad.roads.bundled import FOLDER, load_map
from skidpad.roads.queries import LanePoint, RoadMap

carla = pytest.importorskip("carla")

TOWNS = ("Town01", "Town02", "Town04", "Town06", "Town07", "Town10HD")
OURS = tuple(sorted(p.stem for p in FOLDER.glob("*.xodr")))
BANKED = ("motorway",)  # CARLA's places know no superelevation: both read the file without it


@pytest.fixture(params=(*OURS, *TOWNS))
def both(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[RoadMap, Any]:
    if request.param in OURS:
        path = FOLDER / f"{request.param}.xodr"
    else:
        folder: Path = request.getfixturevalue("towns")
        path = folder / f"{request.param}.xodr"
    text = path.read_text()
    if request.param in BANKED:
        path, text = tmp_path / path.name, re.sub("<superelevation [^>]*/>", "", text)
        path.write_text(text)
    return load_map(path), carla.Map(request.param, text)


def random_points(map: RoadMap, n: int) -> list[tuple[float, float, float, int]]:
    rng = np.random.default_rng(20260101)
    samples = map.samples
    chosen = rng.choice(np.flatnonzero(map.arrays.drivable[samples.lane]), n)
    left = rng.uniform(-0.5, 0.5, n) * samples.width[chosen]
    along = rng.uniform(-0.5, 0.5, n)
    c, s = np.cos(samples.heading[chosen]), np.sin(samples.heading[chosen])
    x = samples.x[chosen] + along * c - left * s
    y = samples.y[chosen] + along * s + left * c
    return list(
        zip(
            x.tolist(),
            y.tolist(),
            samples.z[chosen].tolist(),
            samples.lane[chosen].tolist(),
            strict=True,
        )
    )


def location(x: float, y: float, z: float) -> Any:
    return carla.Location(x, pose_from_carla(0.0, y, 0.0).y, z)


def driving_next(waypoint: Any, distance: float) -> set[tuple[int, int]]:
    return {
        (w.road_id, w.lane_id)
        for w in waypoint.next(distance)
        if w.lane_type == carla.LaneType.Driving
    }


def pose(waypoint: Any) -> tuple[float, float, float, float]:
    at, turn = waypoint.transform.location, waypoint.transform.rotation
    p = pose_from_carla(at.x, at.y, at.z, yaw=turn.yaw)
    return p.x, p.y, p.z, p.yaw


def own_tangent(map: RoadMap, waypoint: Any, yaw: float) -> float:
    """Direction from where CARLA says the lane is a little before to a little after."""
    step = 0.02
    ends = [waypoint.previous(step), waypoint.next(step)]
    if not all(ends):
        return yaw
    (x0, y0, _, _), (x1, y1, _, _) = pose(ends[0][0]), pose(ends[1][0])
    return float(np.arctan2(y1 - y0, x1 - x0))


@pytest.mark.req("A-076")
def test_projection_agrees_with_carla(both: tuple[RoadMap, Any]) -> None:
    map, theirs = both
    for x, y, z, _ in random_points(map, 1500):
        ours = map.project(x, y, z)
        assert ours is not None
        nearest = theirs.get_waypoint(location(x, y, z))
        nx, ny, nz, _ = pose(nearest)
        own = hypot(ours.x - x, ours.y - y, ours.z - z)
        other = hypot(nx - x, ny - y, nz - z)
        # CARLA stops at chords: ours is never farther, and farther from an edge the lane is the same.
        assert own <= other + 0.02
        if (ours.road, ours.lane_id) != (nearest.road_id, nearest.lane_id):
            again = theirs.get_waypoint_xodr(ours.road, ours.lane_id, map.s_road(ours))
            if again is not None and other > own + 0.1:
                ax, ay, az, _ = pose(again)
                assert hypot(ax - x, ay - y, az - z) < other
        check_place(map, theirs, ours)


def check_place(map: RoadMap, theirs: Any, ours: LanePoint) -> None:
    same = theirs.get_waypoint_xodr(ours.road, ours.lane_id, map.s_road(ours))
    if same is None:  # CARLA knows no place at the very end of a road
        return
    x, y, z, yaw = pose(same)
    assert hypot(ours.x - x, ours.y - y, ours.z - z) <= 0.02
    # CARLA adds angles where a lane widens in a bend; then its own positions decide.
    turn = min(
        abs(wrap_angle(ours.heading - angle)) for angle in (yaw, own_tangent(map, same, yaw))
    )
    assert degrees(turn) <= 0.2
    assert abs(ours.width - same.lane_width) <= 0.02
    assert (int(map.lanes.junction[ours.lane]) >= 0) == same.is_junction


@pytest.mark.req("A-142", "A-148")
def test_the_way_on_agrees_with_carla(both: tuple[RoadMap, Any]) -> None:
    map, theirs = both
    compared = 0
    for x, y, z, _ in random_points(map, 300):
        ours = map.project(x, y, z)
        assert ours is not None
        same = theirs.get_waypoint_xodr(ours.road, ours.lane_id, map.s_road(ours))
        if same is None:
            continue
        # CARLA counts metres of the reference line, which bends make longer or shorter than lanes.
        reach = range(6, 21)
        ours_near = {(p.road, p.lane_id) for d in reach for p in map.all_ahead(ours, float(d))}
        theirs_near = {key for d in reach for key in driving_next(same, float(d))}
        assert driving_next(same, 12.0) <= ours_near
        assert {(p.road, p.lane_id) for p in map.all_ahead(ours, 12.0)} <= theirs_near
        compared += len(ours_near)
        for mine, his in (
            (map.left(ours), same.get_left_lane()),
            (map.right(ours), same.get_right_lane()),
        ):
            if mine is None:
                assert (
                    his is None
                    or his.lane_type != carla.LaneType.Driving
                    or his.lane_id * ours.lane_id < 0
                )
            else:
                assert his is not None
                assert (mine.road, mine.lane_id) == (his.road_id, his.lane_id)
    assert compared > 200
