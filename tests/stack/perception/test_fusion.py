"""Both camera tiers joined, filtered, and asked to verify."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.errors import ConfigError
from skidpad.core.frames import CameraImage
from skidpad.core.settings.stack import StackSettings
from skidpad.core.specs import CameraSpec
from skidpad.stack.configurations import functions_of
from skidpad.stack.perception.front import Cameras
from skidpad.stack.perception.fusion import CameraPair, camera_pair, roof_corridor
from support.stack_parts import MedianFilter, RateFilter, confirm, fuse, read_pair
from support.stackfakes import (
    ROOF_DEPTH,
    ROOF_SEMANTIC,
    SPECS,
    Car,
    frame,
)

approx = pytest.approx
CAMERAS = Cameras(SPECS, functions_of(2), StackSettings())
BUMPER, ROOF = CAMERAS.bumper, CAMERAS.roof


@pytest.mark.req("A-055", "A-056", "A-057", "A-058")
@pytest.mark.parametrize(
    ("bumper", "roof", "fused", "listed"),
    [
        (4.0, 60.0, 4.0, 4.0),
        (15.0, 60.0, 15.0, 15.0),
        (16.0, 26.0, 17.0, 17.0),
        (20.0, 30.0, 25.0, 25.0),
        (20.0, 79.0, 49.5, 49.5),  # what the consistency guard is for
        (24.0, 34.0, 33.0, 33.0),
        (25.0, 34.0, 34.0, 34.0),
        (28.0, 34.0, 34.0, 34.0),
        (None, 34.0, 34.0, 34.0),
        (None, None, None, None),
        (15.1, None, 15.1, None),
        (29.9, None, 29.9, None),
        (14.9, None, 14.9, 14.9),
        (30.1, None, None, None),
    ],
)
def test_fused_distance(bumper, roof, fused, listed):
    assert fuse(bumper, roof) == (None if fused is None else approx(fused))
    found = fuse(bumper, roof, bumper_alone=False)
    assert found == (None if listed is None else approx(listed))


@given(st.floats(0.2, 29.9), st.floats(10.1, 79.9))
def test_fused_distance_lies_between_the_tiers_and_never_jumps(bumper, roof):
    fused = fuse(bumper, roof)
    assert min(bumper, roof) - 1e-9 <= fused <= max(bumper, roof) + 1e-9
    step = abs(fuse(min(bumper + 1e-6, 29.9), roof) - fused)
    assert step < 1e-6 * (2.0 + abs(roof - bumper))


@pytest.mark.req("A-059")
def test_guard_takes_the_nearer_of_two_that_disagree():
    assert fuse(20.0, 79.0, guard=10.0) == 20.0
    assert fuse(20.0, 16.0, guard=3.0) == 16.0
    assert fuse(20.0, 26.0, guard=10.0) == fuse(20.0, 26.0) == 23.0


@pytest.mark.req("A-061")
def test_median_of_five_samples():
    m = MedianFilter()
    assert [m.update(d) for d in (30.0, 29.0, 28.0)] == [None, None, 30.0]
    assert [m.update(d) for d in (27.0, 80.0, 26.0)] == [29.0, 29.0, 28.0]
    assert [m.update(20.0) for _ in range(5)][-1] == 20.0
    assert [m.update(None) for _ in range(3)] == [20.0, 20.0, None]
    m.reset()
    assert m.update(20.0) is None


@pytest.mark.req("A-062")
def test_rate_filter_starts_at_100_m_and_moves_12_m_per_tick():
    f = RateFilter(0.05)
    smoothed = []
    answers = []
    for _ in range(9):
        answers.append(f.update(20.0))
        smoothed.append(f.smoothed)
    assert smoothed == approx([88.0, 76.0, 64.0, 52.0, 40.0, 28.0, 20.0, 20.0, 20.0])
    # the median over 0.17 s, which is three ticks, lags one tick behind
    assert answers[0] is None
    assert answers[1:] == approx([88.0, 76.0, 64.0, 52.0, 40.0, 28.0, 20.0, 20.0])
    assert f.update(None) == approx(20.0)
    assert f.smoothed == approx(32.0)


@pytest.mark.req("A-037")
def test_no_image_yet_is_no_target():
    empty = frame()
    for images in (
        {},
        {"depth_roof": CameraImage(), "semantic_roof": CameraImage()},
        {"depth_roof": CameraImage()},
    ):
        assert read_pair(ROOF, replace(empty, segments={}, images=images)) is None
    one_is_late = frame(cars=[Car(20.0)], level="pixels")
    images = {k: v for k, v in one_is_late.images.items() if k != "semantic_bumper"}
    assert read_pair(BUMPER, replace(one_is_late, images=images)) is None
    assert read_pair(BUMPER, one_is_late) == approx(20.0, rel=1e-6)


def test_cameras_of_a_pair_must_fit():
    small = replace(ROOF_SEMANTIC, width=400)
    with pytest.raises(ConfigError, match=r"depth_roof and semantic_roof.*800x600 and 400x600"):
        CameraPair(ROOF_DEPTH, small, roof_corridor(ROOF_SEMANTIC))
    cameras = [spec for spec in SPECS if isinstance(spec, CameraSpec)]
    with pytest.raises(ConfigError, match=r"semantic camera 'semantic_roof'; the vehicle has: dep"):
        camera_pair(cameras[:1], "depth_roof", "semantic_roof")


@pytest.mark.req("A-065")
@pytest.mark.parametrize("level", ["pixels", "objects"])
@pytest.mark.parametrize(
    ("cars", "reported", "answer"),
    [
        ([Car(3.0)], 3.5, (True, "bumper")),
        ([Car(3.0)], 4.9, (True, "bumper")),
        ([Car(3.0)], 5.1, (False, "none")),  # more than 2 m off
        ([Car(3.0)], 1.05, (True, "bumper")),
        ([Car(3.0)], 0.9, (False, "none")),
        ([Car(3.0, left=4.0)], 3.0, (False, "none")),  # beside the corridor
        ([], 3.0, (False, "none")),
    ],
)
def test_verification_asks_for_vehicle_pixels_near_the_distance(level, cars, reported, answer):
    found = confirm(CAMERAS, frame(cars=cars, level=level), reported)
    assert found == answer


@pytest.mark.req("A-065")
def test_roof_verifies_without_its_minimum_depth_when_the_bumper_is_blind():
    seen = frame(cars=[Car(4.0)], level="pixels")
    roof_only = {k: v for k, v in seen.images.items() if "roof" in k}
    blind = replace(seen, images=roof_only)
    assert confirm(CAMERAS, blind, 4.0) == (True, "roof")
    assert read_pair(ROOF, blind) is None  # as a tier it starts at 10 m


@pytest.mark.req("A-055", "A-057")
@pytest.mark.parametrize("gap", [3.0, 8.0, 12.0, 14.0, 26.0, 29.0, 45.0, 70.0, 79.0])
@pytest.mark.parametrize("left", [-0.8, 0.0, 0.8])
def test_segments_read_as_the_pixels_that_they_stand_for(gap, left):
    cars = [Car(gap, left), Car(gap + 20.0, -left, label=15)]
    for pair in (BUMPER, ROOF):
        pixels = read_pair(pair, frame(cars=cars, level="pixels"))
        segments = read_pair(pair, frame(cars=cars))
        assert (pixels is None) is (segments is None)
        if pixels is not None:
            assert segments == approx(pixels, rel=1e-5)


@pytest.mark.req("A-047", "A-053")
@pytest.mark.parametrize(("pair", "nearest"), [(BUMPER, 6.0), (ROOF, 30.0)])
def test_a_tier_reads_the_tenth_percentile(pair, nearest):
    """A wall of vehicle pixels whose depth grows with the row."""
    keep = pair.keep
    shape = (300, 400) if pair is BUMPER else (600, 800)
    labels, depth = np.zeros(shape, np.uint8), np.zeros(shape, np.float32)
    rows = range(keep.row_first, keep.row_end)
    middle = shape[1] // 2
    for row in rows:
        depth[row, middle] = nearest + 0.05 * (row - keep.row_first)
        labels[row, middle] = 14
    inverse = np.divide(1.0, depth, out=np.zeros_like(depth), where=depth > 0.0)
    images = {
        pair.depth_id: CameraImage(inverse_depth=inverse),
        pair.semantic_id: CameraImage(labels=labels),
    }
    found = read_pair(pair, replace(frame(), segments={}, images=images))
    expected = np.percentile([depth[row, middle] for row in rows], 10)
    assert found == approx(expected, rel=1e-5)


@pytest.mark.req("A-062")
def test_rate_filter_lasts_0_17_s():
    f = RateFilter(0.001)
    assert len(f.history) == 170
