"""The hours on which rules are judged: which segments count, what is driven again, what stays."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

import monitor_drives as drives
import monitor_rules
import monitor_variants as variants
from skidpad.campaign.workers.worker import Finished
from skidpad.core.errors import FileError
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind

HOUR = drives.Part("natural", 800, 1.0, "own")
COUNTS = {"tracked": {"ego_tailgated": [1, 0, 1, 1.0, 2.0, 2.0]}}


def row(number, hours=0.25, part="natural", **more):
    return {
        "part": part, "number": number, "hours": hours, "code": monitor_rules.judging_hash(),
        "counts": COUNTS, "map": "town", "way": [[0.0, 0.4], [5.0, 0.0], [9.6, 0.0]], "cpu_drive_s": 20.0,
        "cpu_judge_s": 5.0,
    } | more  # fmt: skip


def test_a_part_is_its_first_segments_that_reach_its_hours():
    rows = [row(n) for n in (5, 3, 2, 1, 0)]
    assert [r["number"] for r in drives.counted_rows(HOUR, rows)] == [0, 1, 2, 3]
    assert drives.is_complete(HOUR, rows)
    assert not drives.is_complete(HOUR, [r for r in rows if r["number"] != 1])


def test_a_segment_that_failed_has_no_hours_and_another_one_counts_for_it():
    rows = [row(0), row(1, 0.0, failed="no end"), row(2), row(3), row(4)]
    assert len(drives.counted_rows(HOUR, rows)) == 5
    told = drives.summary([HOUR], rows)
    assert told["failed"] == 1
    assert told["drives"]["natural"]["hours"] == 1.0
    assert told["cpu_s_per_hour"] == {"driving": 80.0, "judging": 20.0}
    assert told["drives"]["natural"]["rules"]["tracked"]["ego_tailgated"]["tp"] == 4
    assert drives.ways([HOUR], rows) == {"town": 4 * [[[0, 0], [10, 0]]]}
    with pytest.raises(FileError, match="drive first"):
        drives.summary([HOUR], [])


def test_registered_parts_have_the_hours_asked_for_and_seeds_of_their_own():
    parts = drives.registered_parts(5.0)
    assert [p.hours for p in parts] == [2.0, 2.0, 1.0]
    seeds = [spec.seed for p in parts for spec in p.specs()]
    assert len(seeds) == len(set(seeds))
    assert min(seeds) == 80_000_000
    assert {s.course.stratum.value for s in parts[1].specs()} == {"risky"}
    assert {s.weather.name for s in parts[2].specs()} == {"ice"}


@pytest.fixture
def in_process(monkeypatch):
    """Jobs run here, on drives that write their files and are judged at once."""
    began = []

    def drive_one(folder, spec):
        began.append(spec.seed)
        path = folder / spec.cell / f"{spec.name}.mcap"
        path.parent.mkdir(parents=True, exist_ok=True)
        for end in (".mcap", ".json"):
            path.with_suffix(end).touch()
        return SimpleNamespace(
            metrics=SimpleNamespace(distance_m=900.0, collisions=0),
            key=SimpleNamespace(log_hash="abc"),
        )

    def local(workers, warm_up):
        return lambda jobs: (Finished(j, value=j.work(j.argument)) for j in jobs)

    monkeypatch.setattr(drives, "drive_one", drive_one)
    monkeypatch.setattr(drives, "local", local)
    judged = {"hours": 0.25, "counts": COUNTS, "map": "town", "way": []}
    monkeypatch.setattr(monitor_rules, "judge", lambda path, with_reference: judged)
    return began


def test_what_is_driven_leaves_a_row_alone_and_is_not_driven_again(tmp_path, in_process):
    assert drives.drive(tmp_path, [HOUR], 1)
    assert in_process == [80_000_000 + n for n in range(4)]
    assert not [*tmp_path.rglob("*.mcap"), *tmp_path.rglob("*.json")]
    assert drives.drive(tmp_path, [HOUR], 1)
    assert len(in_process) == 4
    file = tmp_path / drives.ROWS
    lines = file.read_text().splitlines()
    old = json.dumps(json.loads(lines[0]) | {"code": "other"})
    file.write_text("\n".join([old, *lines[1:3], lines[3][:50]]))  # other code; cut off
    assert not drives.drive(tmp_path, [HOUR], 1, stop_after=0.0)
    assert len(drives.read_rows(file)) == 2  # what another version judged is published as it is
    assert drives.drive(tmp_path, [HOUR], 1)
    assert in_process[4:] == [80_000_000, 80_000_003]


def test_smoothed_states_are_the_least_squares_of_all_reports():
    """Against the normal equations of both states, whole."""
    dt, v_ego, q = 0.1, 12.0, variants.SIGMA_A**2
    p0 = np.array([[0.3, 0.05], [0.05, 0.4]])
    for behind in (False, True):
        sign = -1.0 if behind else 1.0
        f = np.array([[1.0, sign * dt], [0.0, 1.0]])
        noise = q * np.array([[0.25 * dt**4, 0.5 * sign * dt**3], [0.5 * sign * dt**3, dt * dt]])
        x0, z, r = np.array([10.0, 15.0]), np.array([10.9, 14.0]), np.diag([0.25, 0.49])
        x1 = f @ x0 - [sign * dt * v_ego, 0.0]
        p1 = f @ p0 @ f.T + noise
        gain = p1 @ np.linalg.inv(p1 + r)
        now, p_now = x1 + gain @ (z - x1), p1 - gain @ p1
        back = p0 @ f.T @ np.linalg.inv(p1)
        want, p_want = x0 + back @ (now - x1), p0 + back @ (p_now - p1) @ back.T

        def state(t, x, p):
            return (t, x[0], x[1], (p[0, 0], p[1, 1], p[0, 1]), v_ego)

        gap, v, (a, b, c) = variants.smoothed_state(
            [state(0.0, x0, p0), state(dt, now, p_now)], behind
        )
        assert (gap, v) == pytest.approx(tuple(want))
        assert (a, b, c) == pytest.approx((p_want[0, 0], p_want[1, 1], p_want[0, 1]))


def test_the_map_says_by_how_much_a_channels_vehicles_lie_beside_lanes():
    map = load_map("figure8")
    lane = int(np.argmax(map.lanes.length * (map.lanes.kind == LaneKind.DRIVING)))
    points = [map.at(lane, s).pose for s in (40.0, 50.0, 60.0, 70.0)]
    h = points[1].yaw
    off = 0.8 * np.array([-np.sin(h), np.cos(h)])
    objects = np.array([[p.x + off[0], p.y + off[1], p.yaw, 9.0, 9.0] for p in points])
    frame = SimpleNamespace(
        ego=np.array([points[0].x, points[0].y, h, 9.0, 9.0]), objects=objects,
        classes=np.full(4, -1),
    )  # fmt: skip
    match = variants.MapMatch(map)
    match.update(frame)
    along = float(match.shift @ off) / 0.8
    assert along == pytest.approx(0.8 * 4.0 / 5.0, abs=0.05)  # the prior has the weight of one
    match.update(None)
    assert match.shift is None


def test_an_alarm_lasts_until_its_end():
    held = variants.hold([False, True, False, False, False], [True, True, True, False, True])
    assert held == [False, True, True, False, False]
