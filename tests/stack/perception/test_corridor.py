"""What a camera tier keeps, against closed geometry and against plain numpy."""

from __future__ import annotations

from math import cos, radians, sin, tan

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import SemanticClass
from skidpad.stack.perception.corridor import (
    ROAD_USERS,
    Corridor,
    half_width,
    in_corridor,
    insert,
    lateral_offset,
    percentile,
    reachable_columns,
    read_pixels,
    weighted_percentile,
)
from skidpad.stack.perception.fusion import bumper_corridor, roof_corridor
from support.stack_parts import Lanes
from support.stackfakes import BUMPER_SEMANTIC, ROOF_SEMANTIC, ArcMap, Car, draw

approx = pytest.approx
CAR = int(SemanticClass.CAR)
SCRATCH = np.empty(800 * 600, np.float32)


def bumper() -> Corridor:
    return bumper_corridor(BUMPER_SEMANTIC)


def roof(flat: bool = False) -> Corridor:
    return roof_corridor(ROOF_SEMANTIC, flat)


def read(inverse, labels, c, yaw_error=0.0, kappa=0.0):
    distance = read_pixels(inverse, labels, c, 0.10, sin(yaw_error), kappa, SCRATCH)
    return None if np.isnan(distance) else distance


def strip(camera, pixels, depth, row, cars=CAR):
    """`pixels` vehicle pixels about the principal column, in rows from `row` on, at one depth."""
    inverse = np.zeros((camera.height, camera.width), np.float32)
    labels = np.zeros(inverse.shape, np.uint8)
    first = camera.width // 2 - 5
    for k in range(pixels):
        inverse[row + k // 10, first + k % 10] = 1.0 / depth
        labels[row + k // 10, first + k % 10] = cars
    return inverse, labels


@pytest.mark.req("A-041")
def test_offset_is_the_pinhole_projection_inverted():
    for left, z in ((1.5, 12.0), (-0.7, 40.0), (0.0, 5.0)):
        for camera, c in ((BUMPER_SEMANTIC, bumper()), (ROOF_SEMANTIC, roof())):
            half = tan(radians(camera.fov_deg) / 2)
            u = camera.width / 2 * (1.0 - left / z / half)
            assert lateral_offset(z, u, c, 0.0, 0.0) == approx(left, abs=1e-9)


@pytest.mark.req("A-042", "A-043")
@pytest.mark.parametrize("curvature", [0.0, 1 / 300, -1 / 500])
@pytest.mark.parametrize("yaw_error", [0.0, 0.04, -0.06])
@pytest.mark.parametrize("offset", [0.0, 1.2, -1.2])
def test_corrected_offset_is_the_offset_from_the_lane(curvature, yaw_error, offset):
    """A point beside a lane in closed form, seen by an ego turned against the lane."""
    map, c = ArcMap(curvature), roof()
    view = Lanes(map).view(Pose(0.0, 0.0, yaw=yaw_error))
    for s in (15.0, 30.0):
        x, y, heading = map._point(s, offset)
        z, left = (
            x * cos(yaw_error) + y * sin(yaw_error),
            y * cos(yaw_error) - x * sin(yaw_error),
        )
        u = c.cx - c.focal * left / z
        found = lateral_offset(z, u, c, sin(view.yaw_error), view.kappa)
        assert found == approx(offset, abs=0.04 * s / 15.0)
        assert heading == approx(curvature * s)


@pytest.mark.req("A-043")
@pytest.mark.parametrize("first_branch", [False, True])
def test_curvature_is_read_at_one_point_30_m_ahead(first_branch):
    class Bend(ArcMap):
        """The curvature of a place is its s in km, so it tells where it was read."""

        def _baked(self):
            baked = super()._baked()
            baked.samples = baked.samples._replace(curvature=1e-3 * baked.samples.s)
            return baked

    lanes = Lanes(Bend(), first_branch)
    for x in (100.0, 170.0):
        view = lanes.view(Pose(x, 0.3, yaw=0.02))
        assert view.curvature == approx(1e-3 * (x + 30.0))
        assert view.kappa == approx(1e-3 * (x + 30.0) / 2)
        assert view.yaw_error == approx(0.02)


@pytest.mark.req("A-050")
def test_roof_half_width_as_printed():
    assert [half_width(z, roof()) for z in (10.0, 50.0, 62.5, 80.0)] == approx(
        [1.76, 2.40, 2.6, 2.6]
    )


@pytest.mark.req("A-051")
def test_flat_roof_corridor_is_1_6_m_everywhere():
    assert [half_width(z, roof(flat=True)) for z in (10.0, 50.0, 80.0)] == [1.6] * 3


@pytest.mark.req("A-054")
def test_every_limit_is_strict():
    c = Corridor(100.0, 100.0, 0, 200, 2.0, 0.0, 2.0, 10.0, 80.0, 1, 1)
    assert in_corridor(20.0, 90.01, c, 0.0, 0.0)
    assert not in_corridor(20.0, 90.0, c, 0.0, 0.0)  # exactly 2 m left
    assert not in_corridor(20.0, 110.0, c, 0.0, 0.0)
    for depth in (10.0, 80.0):
        assert not in_corridor(depth, 100.0, c, 0.0, 0.0)
    for depth in (10.001, 79.999):
        assert in_corridor(depth, 100.0, c, 0.0, 0.0)


@pytest.mark.req("A-044", "A-045", "A-046", "A-048", "A-049", "A-052")
def test_limits_of_both_tiers_as_printed():
    b, r = bumper(), roof()
    assert (b.row_first, b.row_end) == (45, 285)  # 15 % to 95 % of 300
    assert (r.row_first, r.row_end) == (150, 450)  # 25 % to 75 % of 600
    assert (b.min_vehicle, b.min_kept, r.min_vehicle, r.min_kept) == (100, 50, 30, 20)
    assert (b.near, b.far, r.near, r.far) == (0.1, 30.0, 10.0, 80.0)
    assert half_width(5.0, b) == half_width(30.0, b) == 1.8


@pytest.mark.req("A-044", "A-048")
@pytest.mark.parametrize(
    ("camera", "c", "depth"), [(BUMPER_SEMANTIC, bumper(), 12.0), (ROOF_SEMANTIC, roof(), 30.0)]
)
def test_only_the_band_of_rows_counts(camera, c, depth):
    for row, seen in (
        (c.row_first - 20, False),
        (c.row_first, True),
        (c.row_end - 20, True),
        (c.row_end, False),
    ):
        if row + 20 <= camera.height:
            distance = read(*strip(camera, 200, depth, row), c)
            assert (distance is not None) is seen, row


@pytest.mark.req("A-045", "A-046", "A-049", "A-052")
@pytest.mark.parametrize(
    ("camera", "c", "depth", "vehicle", "kept"),
    [(BUMPER_SEMANTIC, bumper(), 12.0, 100, 50), (ROOF_SEMANTIC, roof(), 30.0, 30, 20)],
)
def test_fewer_pixels_than_printed_are_no_target(camera, c, depth, vehicle, kept):
    row = c.row_first + 30
    assert read(*strip(camera, vehicle, depth, row), c) == approx(depth, rel=1e-6)
    assert read(*strip(camera, vehicle - 1, depth, row), c) is None
    # Enough vehicle pixels, of which some lie far beside the corridor.
    for inside, seen in ((kept, True), (kept - 1, False)):
        inverse, labels = strip(camera, inside, depth, row)
        inverse[row : row + 20, :40] = 1.0 / depth
        labels[row : row + 20, :40] = CAR
        assert (read(inverse, labels, c) is not None) is seen


@pytest.mark.req("A-044", "A-048")
def test_vehicles_beside_the_corridor_count_as_vehicle_pixels():
    """All columns are counted, also those that no corridor pixel can have."""
    c = roof()
    inverse, labels = strip(ROOF_SEMANTIC, 25, 30.0, 200)
    assert read(inverse, labels, c) is None
    labels[210, :5] = CAR
    assert read(inverse, labels, c) == approx(30.0, rel=1e-6)


@pytest.mark.req("A-036", "A-034")
@pytest.mark.parametrize("label", list(SemanticClass))
def test_cars_trucks_and_buses_are_vehicles(label):
    image = strip(ROOF_SEMANTIC, 100, 30.0, 250, cars=int(label))
    vehicles = {SemanticClass.CAR, SemanticClass.TRUCK, SemanticClass.BUS}
    assert (read(*image, roof()) is not None) is (label in vehicles)


@pytest.mark.req("A-034")
@pytest.mark.parametrize("label", list(SemanticClass))
def test_road_users_are_everything_that_moves_or_lies_on_the_road(label):
    users = range(SemanticClass.PEDESTRIAN, SemanticClass.DYNAMIC + 1)
    for camera, c in (
        (ROOF_SEMANTIC, roof_corridor(ROOF_SEMANTIC, wanted=ROAD_USERS)),
        (BUMPER_SEMANTIC, bumper_corridor(BUMPER_SEMANTIC, ROAD_USERS)),
    ):
        image = strip(camera, 150, 20.0, c.row_first + 30, cars=int(label))
        assert (read(*image, c) is not None) is (label in users)


@pytest.mark.req("A-047", "A-053")
@given(st.lists(st.floats(0.25, 79.0, width=32), min_size=1, max_size=60), st.integers(1, 4))
def test_percentile_interpolates_as_numpy_does(values, times):
    expected = np.percentile(np.repeat(values, times), 10)
    array = np.repeat(np.array(values, np.float32), times)
    assert percentile(array.copy(), len(array), 0.10) == approx(expected, rel=1e-5)
    rows = np.empty((len(values), 2))
    for n, value in enumerate(values):
        insert(rows, n, value, float(times))
    position = 0.10 * (times * len(values) - 1)
    assert weighted_percentile(rows, len(rows), position) == approx(expected, rel=1e-5)


def tier_by_numpy(inverse, labels, c, yaw_error, kappa):
    """The tier as printed, without any shortcut."""
    rows = slice(c.row_first, c.row_end)
    vehicle = np.isin(labels[rows], (14, 15, 16))
    if np.count_nonzero(vehicle) < c.min_vehicle:
        return None
    with np.errstate(divide="ignore"):
        z = 1.0 / inverse[rows].astype(float)[vehicle]
    u = np.broadcast_to(np.arange(labels.shape[1], dtype=float), labels[rows].shape)[vehicle]
    z, u = z[np.isfinite(z)], u[np.isfinite(z)]
    d = (c.cx - u) * z / c.focal + z * np.sin(yaw_error) - kappa * z**2
    width = np.minimum(c.half_width + c.widening * z, c.half_width_max)
    z = z[(np.abs(d) < width) & (z > c.near) & (z < c.far)]
    return float(np.percentile(z, 10)) if len(z) >= c.min_kept else None


@pytest.mark.req("A-044", "A-046", "A-047", "A-048", "A-052", "A-053")
@given(
    st.lists(st.tuples(st.floats(3.0, 90.0), st.floats(-6.0, 6.0)), max_size=4),
    st.floats(-0.3, 0.3),
    st.floats(-0.01, 0.01),
    st.booleans(),
)
def test_both_tiers_equal_the_printed_rule_in_numpy(places, yaw_error, kappa, near):
    camera, c = (BUMPER_SEMANTIC, bumper()) if near else (ROOF_SEMANTIC, roof())
    image = draw([Car(depth, left) for depth, left in places], camera)
    expected = tier_by_numpy(image.inverse_depth, image.labels, c, yaw_error, kappa)
    found = read(image.inverse_depth, image.labels, c, yaw_error, kappa)
    assert found == (expected if expected is None else approx(expected, rel=1e-5))


@given(
    st.floats(-0.5, 0.5), st.floats(-0.02, 0.02), st.floats(0.11, 79.9), st.integers(0, 799)
)  # fmt: skip
def test_columns_left_out_hold_nothing(yaw_error, kappa, z, u):
    c = roof()
    first, end = reachable_columns(c, sin(yaw_error), kappa, 800)
    if in_corridor(z, float(u), c, sin(yaw_error), kappa):
        assert first <= u < end
