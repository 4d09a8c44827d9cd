"""The published suite against its published table."""

import csv
from math import radians
from pathlib import Path

import pytest

from skidpad.core.maths.lefthanded import pose_from_carla
from skidpad.core.specs import CameraSpec, RadarSpec
from skidpad.sensors.published_sensors import CaptureSize, mounts_outside, twelve_sensors

PUBLISHED = [
    # id, width, height, fov, x, y, z, pitch, yaw: as printed, CARLA axes
    ("rgb_front", 800, 600, 90, 0.05, -0.35, 1.3, 0, 0),
    ("depth_roof", 800, 600, 90, 1.5, 0, 2.4, 0, 0),
    ("semantic_roof", 800, 600, 90, 1.5, 0, 2.4, 0, 0),
    ("semantic_bumper", 400, 300, 100, 2.3, 0, 0.4, -20, 0),
    ("depth_bumper", 400, 300, 100, 2.3, 0, 0.4, -20, 0),
    ("rgb_rear", 450, 180, 90, -2.0, 0, 2.4, 0, 180),
    ("rgb_mirror_left", 280, 180, 90, 0.325, -0.8, 1.3, 0, -140),
    ("rgb_mirror_right", 280, 180, 90, 0.325, 0.8, 1.3, 0, 140),
    ("rgb_top", 160, 160, 70, 0, 0, 10.0, -90, 0),
]
TABLE = Path(__file__).resolve().parents[3] / "shared" / "reference" / "adas" / "sensors.csv"


@pytest.mark.req("A-018")
def test_twelve_sensors_in_the_published_order():
    ids = [s.id for s in twelve_sensors()]
    assert ids == [row[0] for row in PUBLISHED] + ["radar_front", "collision", "lane_invasion"]


@pytest.mark.req(
    "A-019", "A-020", "A-021", "A-022", "A-023", "A-024", "A-025", "A-026", "A-027", "A-040"
)
def test_sizes_fields_of_view_and_mountings():
    for spec, row in zip(twelve_sensors(), PUBLISHED, strict=False):
        id, width, height, fov, x, y, z, pitch, yaw = row
        assert (spec.id, spec.width, spec.height, spec.fov_deg) == (id, width, height, fov)
        assert spec.mount == pose_from_carla(x, y, z, 0, pitch, yaw)
    by_id = {s.id: s for s in twelve_sensors()}
    assert by_id["rgb_front"].mount.y > 0  # the driver sits on the left
    assert by_id["rgb_mirror_left"].mount.yaw == pytest.approx(radians(140))
    assert by_id["depth_bumper"].mount.pitch == pytest.approx(radians(20))  # nose down
    assert by_id["depth_roof"].focal == pytest.approx(400.0)
    assert by_id["depth_bumper"].focal == pytest.approx(167.82, abs=0.005)
    assert (by_id["depth_roof"].cx, by_id["depth_bumper"].cx) == (400.0, 200.0)
    assert (by_id["depth_roof"].cy, by_id["depth_bumper"].cy) == (300.0, 150.0)


@pytest.mark.req("A-028")
def test_the_radar_is_the_published_one():
    (radar,) = (s for s in twelve_sensors() if isinstance(s, RadarSpec))
    assert (radar.horizontal_fov_deg, radar.vertical_fov_deg, radar.range) == (30.0, 30.0, 150.0)
    assert radar.mount == pose_from_carla(2.0, 0.0, 1.0)


@pytest.mark.req("A-023", "A-024", "A-027", "A-038")
def test_variants_of_the_suite():
    compat = {s.id: s for s in twelve_sensors(bumper_depth_fov_deg=90.0)}
    assert (compat["depth_bumper"].fov_deg, compat["semantic_bumper"].fov_deg) == (90.0, 100.0)
    large = {s.id: s for s in twelve_sensors(display=CaptureSize.LISTING)}
    assert (large["rgb_rear"].width, large["rgb_top"].height) == (800, 400)
    assert "radar_front" not in [s.id for s in twelve_sensors(with_radar=False)]


def test_the_published_table_agrees():
    if not TABLE.exists():
        pytest.skip("the published tables are not here")
    rows = {row["sensor"]: row for row in csv.DictReader(TABLE.open())}
    for spec in twelve_sensors(display=CaptureSize.LISTING):
        if isinstance(spec, CameraSpec):
            row = rows[spec.id]
            assert spec.width == int(row["listing_width_px"])
            assert spec.fov_deg == float(row["text_hfov_deg"])
            place = [float(row[k] or 0) for k in ("x_m", "y_m", "z_m")]
            turn = [float(row[k] or 0) for k in ("pitch_deg", "yaw_deg")]
            assert spec.mount == pose_from_carla(*place, 0.0, *turn)


@pytest.mark.req("A-039")
def test_mounts_outside_the_body_are_named():
    warnings = mounts_outside(twelve_sensors(), 3.8, 1.97, 1.48)
    assert any("depth_bumper" in w and "0.40 m" in w for w in warnings)
    assert not any("rgb_front" in w for w in warnings)
