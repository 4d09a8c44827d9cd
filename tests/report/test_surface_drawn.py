"""Patches of a surface in replays: where they lie, which are near, and none without a surface."""

from pathlib import Path

import numpy as np
import pytest

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.errors import FileError
from skidpad.recording.run.surfaces import (
    LaidSurface,
    read_laid_surfaces,
    read_run_surface,
    write_laid_surfaces,
)
from skidpad.report.elements.replay import UNIT, replay, replay_run
from skidpad.roads.bundled import load_map
from skidpad.roads.surface_outlines import outline_patches
from support import makelog

ROAD = load_map("straight")
LANE = int(np.flatnonzero((ROAD.lanes.road == 1) & (ROAD.lanes.lane_id == -2))[0])
PLACE = ROAD.at(LANE, 300.0)
PUDDLE = SurfacePatch(name="puddle", water_mm=2.0, circle=(PLACE.x + 20.0, PLACE.y, 4.0))
ICE = SurfacePatch(ice_mm=3.0, road=1, lane=-2, s=(280.0, 330.0), side="right")
FAR = SurfacePatch(friction=0.4, polygon=((9e3, 0.0), (9e3, 9.0), (9.1e3, 9.0)))


def area(corners):
    x, y = np.asarray(corners)[:, :2].T
    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def drive():
    rows = [{"x": PLACE.x, "y": PLACE.y, "z": PLACE.z, "yaw": PLACE.heading}]
    return makelog.drive(20, lambda _k: rows)


def test_outlines_are_where_the_patches_are():
    circle, half, oil = outline_patches(ROAD, [PUDDLE, ICE, FAR])
    assert [o.kind for o in (circle, half, oil)] == ["water", "ice", "friction"]
    assert area(circle.corners) == pytest.approx(np.pi * 16.0, rel=0.01)
    assert circle.corners[:, 2] == pytest.approx(PLACE.z, abs=0.1)
    assert area(half.corners) == pytest.approx(50.0 * PLACE.width / 2.0, rel=0.05)
    at = [ROAD.project(float(x), float(y), float(z)) for x, y, z in half.corners]
    assert {p.lane_id for p in at} <= {-2, -3}
    assert max(p.offset for p in at if p.lane_id == -2) < 0.01


def test_a_road_without_a_lane_is_drawn_lane_by_lane():
    found = outline_patches(ROAD, [SurfacePatch(snow_mm=20.0, road=1, s=(100.0, 200.0))])
    on_road = (ROAD.lanes.road == 1) & (ROAD.arrays.drivable == 1)
    assert len(found) == int(on_road.sum()) >= 2
    assert {o.kind for o in found} == {"snow"}


@pytest.mark.parametrize("cut", [lambda log, s: replay(log, ROAD, 5, laid=s),
                                 lambda log, s: replay_run(log, ROAD, laid=s)])  # fmt: skip
def test_a_replay_holds_the_patches_near_the_way(cut):
    log = drive()
    assert "patches" not in cut(log, ())
    shown = cut(log, [LaidSurface(0, (PUDDLE, ICE, FAR))])["patches"]
    assert [kind for kind, _ in shown] == ["water", "ice"]
    corners = np.array(shown[0][1]).reshape(-1, 2) * UNIT
    assert corners.mean(axis=0) == pytest.approx((20.0, 0.0), abs=0.1)


def test_the_page_draws_every_kind():
    script = (Path("src/skidpad/report/assets/replay.js")).read_text()
    for kind in ("water", "ice", "snow", "friction"):
        assert f"{kind}:" in script


def test_a_folder_says_its_surface_and_one_without_says_none(tmp_path):
    assert read_run_surface(tmp_path) == ()
    (tmp_path / "config.yaml").write_text("version: 2\nsurface:\n- {ice_mm: 3.0, road: 1}\n")
    assert read_run_surface(tmp_path) == (SurfacePatch(ice_mm=3.0, road=1),)
    cold = "- {ice_mm: 3.0, road: 1, air_below_c: 1.0}\nweather: {air_temperature_c: %s}\n"
    for air_c, there in ((0.5, 1), (1.5, 0)):
        (tmp_path / "config.yaml").write_text(f"version: 2\nsurface:\n{cold % air_c}")
        assert len(read_run_surface(tmp_path)) == there
    (tmp_path / "config.yaml").write_text("version: 2\n")
    assert read_run_surface(tmp_path) == ()


@pytest.mark.parametrize("cut", [lambda log, laid: replay(log, ROAD, 5, laid=laid),
                                 lambda log, laid: replay_run(log, ROAD, None, laid)])  # fmt: skip
def test_what_events_lay_is_drawn_while_it_lies_there(cut):
    later = (LaidSurface(4, (PUDDLE, ICE)), LaidSurface(10, (ICE,)))
    laid = (LaidSurface(0, (PUDDLE,)), *later)
    shown = cut(drive(), laid)["patches"]
    dt = drive().header.dt
    times = [round(4 * dt, 3), round(10 * dt, 3)]
    assert [(kind, *when) for kind, _, *when in shown] == [
        ("water", 0.0, times[0]),
        ("water", *times),
        ("ice", *times),
        ("ice", times[1]),
    ]


def test_laid_surfaces_are_stored_and_read(tmp_path):
    write_laid_surfaces(tmp_path, ())
    assert read_laid_surfaces(tmp_path) == ()
    laid = (LaidSurface(4, (PUDDLE, ICE)), LaidSurface(10, ()))
    write_laid_surfaces(tmp_path, laid)
    assert read_laid_surfaces(tmp_path) == laid
    (tmp_path / "surfaces.json").write_text('[{"tick": "x"}]')
    with pytest.raises(FileError, match=r"surfaces.json is damaged: .*tick"):
        read_laid_surfaces(tmp_path)
