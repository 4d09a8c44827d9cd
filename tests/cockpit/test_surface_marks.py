"""Patches of road in the cockpit's pictures: where a camera sees them, and what colour they get."""

import numpy as np
import pytest

from skidpad.cockpit.marks import PX_MOST, Lying, patch_marks
from skidpad.cockpit.pictures import SURFACES, draw
from skidpad.cockpit.screen import Screen
from skidpad.cockpit.studio import FOLLOW, TOP
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.geometry import Pose
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.roads.bundled import load_map
from skidpad.roads.surface_outlines import PatchOutline

EGO = Pose(100.0, 50.0, 0.0, 0.0, 0.0, 0.3)


def square(ahead, left=0.0, side=2.0, kind="ice"):
    """A patch with its middle there, seen from the ego."""
    corners = [EGO.moved(ahead + a, left + b) for a, b in
               ((-side, -side), (-side, side), (side, side), (side, -side))]  # fmt: skip
    return PatchOutline(kind, "", np.array([(p.x, p.y, p.z) for p in corners]))


def test_a_patch_ahead_lies_before_the_follow_camera_and_grows_when_near():
    (far,), (near,) = (patch_marks(FOLLOW, [square(d)], EGO) for d in (40.0, 10.0))
    for kind, corners in (far, near):
        assert kind == "ice"
        columns = [u for u, _ in corners]
        assert (min(columns) + max(columns)) / 2 == pytest.approx(FOLLOW.width / 2, abs=3)
    spread = [np.ptp([u for u, _ in corners]) for _, corners in (far, near)]
    assert spread[1] > 2 * spread[0]


def test_a_patch_to_the_left_is_left_and_one_behind_the_camera_is_not_drawn():
    (_, corners), = patch_marks(FOLLOW, [square(20.0, left=5.0)], EGO)  # fmt: skip
    assert max(u for u, _ in corners) < FOLLOW.width / 2
    assert patch_marks(FOLLOW, [square(-30.0)], EGO) == []
    assert patch_marks(FOLLOW, [square(400.0)], EGO) == []


def test_a_patch_that_reaches_behind_the_camera_is_cut_there():
    (_, corners), = patch_marks(FOLLOW, [square(0.0, side=40.0)], EGO)  # fmt: skip
    assert len(corners) >= 3
    assert max(abs(v) for corner in corners for v in corner) <= PX_MOST


def test_the_top_view_shows_it_to_scale():
    (_, corners), = patch_marks(TOP, [square(4.0, side=2.0)], EGO)  # fmt: skip
    wide = np.ptp([u for u, _ in corners])
    assert wide == pytest.approx(4.0 * TOP.focal / 26.0, abs=2)


def test_a_patch_is_a_coat_of_its_colour():
    picture = np.zeros((60, 60, 3), np.uint8)
    draw(picture, [], None, "", None, [("water", [[10, 10], [50, 10], [50, 50], [10, 50]])])
    assert picture[5, 5].tolist() == [0, 0, 0]
    inside = picture[30, 30].astype(float)
    assert inside / inside.max() == pytest.approx(np.array(SURFACES["water"]) / 200.0, abs=0.03)


def test_what_events_lay_is_outlined_from_their_tick_on():
    road = load_map("straight")
    place = road.at(0, 300.0)
    puddle = SurfacePatch(water_mm=2.0, circle=(place.x, place.y, 4.0))
    ice = SurfacePatch(ice_mm=2.0, circle=(place.x + 20.0, place.y, 4.0))
    laid = (LaidSurface(0, (puddle,)), LaidSurface(4, (puddle, ice)), LaidSurface(10, ()))
    lying = Lying(road, laid)
    kinds = [[outline.kind for outline in lying.outlines(tick)] for tick in (0, 3, 4, 9, 10, 2)]
    assert kinds == [["water"], ["water"], ["water", "ice"], ["water", "ice"], [], ["water"]]


def test_a_live_drive_draws_what_an_event_lays_from_its_tick_on():
    road = load_map("straight")
    screen = Screen(None, None, road, None)
    laid = []
    screen.follow_surface(laid)
    assert len(screen.lying.outlines(5)) == 0
    place = road.at(0, 300.0)
    laid.append(LaidSurface(6, (SurfacePatch(water_mm=2.0, circle=(place.x, place.y, 4.0)),)))
    assert [len(screen.lying.outlines(tick)) for tick in (5, 6, 7)] == [0, 1, 1]
