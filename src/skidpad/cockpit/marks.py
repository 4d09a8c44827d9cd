"""Detections drawn into pictures: radar points and the measured distance, where they are seen."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, RadarSpec
from skidpad.core.states import StackReport
from skidpad.sensors.twelve import RADAR_ID, twelve_sensors
from skidpad.sensors.view import camera_view

Floats = NDArray[np.float64]
CLOSING = -1.0  # m/s, below which a radar point is shown as closing
LEAD_HALF_WIDTH, LEAD_HEIGHT = 1.0, 1.5  # m, of the bracket at the measured distance
BODY = Pose(0.0, 0.0)


class Marks(NamedTuple):
    """What is drawn into one view, in px."""

    points: list[tuple[int, int, bool]]  # radar: column, row, closing
    lead: tuple[int, int, int, int] | None  # bracket: left, top, right, bottom
    label: str


RADAR_MOUNT = next(
    s.mount for s in twelve_sensors() if isinstance(s, RadarSpec) and s.id == RADAR_ID
)


def project(camera: CameraSpec, points: Floats) -> Floats:
    """(n, 3) column, row and depth of points (n, 3) in the ego's frame; depth <= 0: behind."""
    view = camera_view(camera, BODY)
    p = (points - view.centre) @ view.rotation.T
    depth = np.maximum(p[:, 2], 1e-6)
    u = view.cx + view.focal * p[:, 0] / depth
    v = view.cy + view.focal * p[:, 1] / depth
    return np.stack([u, v, p[:, 2]], axis=1)


def marks_of(camera: CameraSpec, radar: RadarPoints, report: StackReport) -> Marks:
    """What the ego's sensors said, as seen by a camera."""
    shown = project(camera, _radar_points(radar))
    points = [
        (int(u), int(v), bool(rate < CLOSING))
        for (u, v, depth), rate in zip(shown.tolist(), radar.velocity.tolist(), strict=True)
        if depth > 0.5 and 0 <= u < camera.width and 0 <= v < camera.height
    ]
    if report.distance is None:
        return Marks(points, None, "")
    x = report.distance + RADAR_MOUNT.x
    box = np.array([[x, LEAD_HALF_WIDTH, LEAD_HEIGHT], [x, -LEAD_HALF_WIDTH, 0.0]])
    (left, top, near), (right, bottom, _) = project(camera, box).tolist()
    if near <= 0.5:
        return Marks(points, None, "")
    status = "" if report.status is None else report.status.name.replace("_", " ").lower()
    lead = (int(left), int(top), int(right), int(bottom))
    return Marks(points, lead, f"{report.distance:.1f} m  {status}")


def _radar_points(radar: RadarPoints) -> Floats:
    """(n, 3) in the ego's frame."""
    flat = radar.range * np.cos(radar.altitude)
    along = np.stack(
        [
            flat * np.cos(radar.azimuth),
            flat * np.sin(radar.azimuth),
            radar.range * np.sin(radar.altitude),
        ],
        axis=1,
    ).astype(np.float64)
    turned: Floats = along @ RADAR_MOUNT.rotation().T + (
        RADAR_MOUNT.x,
        RADAR_MOUNT.y,
        RADAR_MOUNT.z,
    )
    return turned
