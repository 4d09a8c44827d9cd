"""Detections drawn into pictures: radar points, the measured distance, the traffic light."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from skidpad.campaign.driving.loop import Moment
from skidpad.core.arrays import Floats
from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, RadarSpec
from skidpad.core.states import StackReport
from skidpad.recording.run.surfaces import LaidSurface
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import SignalHead
from skidpad.roads.surface_outlines import PatchOutline, outline_patches
from skidpad.sensors.published_sensors import RADAR_ID, twelve_sensors
from skidpad.sensors.raster.view import camera_view
from skidpad.stack.perception.lights import LightScan

CLOSING = -1.0  # m/s, below which a radar point is shown as closing
LEAD_HALF_WIDTH, LEAD_HEIGHT = 1.0, 1.5  # m, of the bracket at the measured distance
BODY = Pose(0.0, 0.0)
LIGHT_AGREES = 2.0  # m between the stop line that a stack reports and that of the light shown
HEAD_WIDE, HEAD_HIGH = 1.2, 2.0  # lamp diameters from a head's middle to the edges of its frame
NEAR = 0.5  # m before a camera, from which on things are drawn
PATCH_REACH = 150.0  # m
PX_MOST = 20_000.0  # beyond the edge of a picture, so that whole numbers of 16 bits hold it
LIGHT_LEAST = 5  # px, half of the smallest frame


class LightMark(NamedTuple):
    """The traffic light that the stack reports."""

    frames: list[tuple[int, int, int, int]]  # about its heads: left, top, right, bottom
    state: str
    label: str


PatchMark = tuple[str, list[tuple[int, int]]]  # kind and corners of what lies on the road


class Marks(NamedTuple):
    """What is drawn into one view, in px."""

    points: list[tuple[int, int, bool]]  # radar: column, row, closing
    lead: tuple[int, int, int, int] | None  # bracket: left, top, right, bottom
    label: str
    light: LightMark | None = None
    patches: Sequence[PatchMark] = ()


RADAR_MOUNT = next(
    s.mount for s in twelve_sensors() if isinstance(s, RadarSpec) and s.id == RADAR_ID
)


def project(camera: CameraSpec, points: Floats, body: Pose = BODY) -> Floats:
    """Returns (n, 3) column, row (px) and depth (m) of points (n, 3) in a camera; depth <= 0: behind.

    body: the pose of the ego in the frame of the points.
    """
    view = camera_view(camera, body)
    p = (points - view.centre) @ view.rotation.T
    depth = np.maximum(p[:, 2], 1e-6)
    u = view.cx + view.focal * p[:, 0] / depth
    v = view.cy + view.focal * p[:, 1] / depth
    return np.stack([u, v, p[:, 2]], axis=1)


class Lying:
    """Outlines of what lies on a run's road, tick by tick."""

    def __init__(self, map: RoadMap, laid: Sequence[LaidSurface]) -> None:
        self.map, self.laid = map, laid
        self.later: Sequence[LaidSurface] = ()  # what events lay while it is driven; grows
        self._outlines: dict[int, Sequence[PatchOutline]] = {}

    def outlines(self, tick: int) -> Sequence[PatchOutline]:
        """Returns the outlines of a tick."""
        there = [one.surface for one in (*self.laid, *self.later) if one.tick <= tick]
        n = len(there)
        if n not in self._outlines:
            self._outlines[n] = outline_patches(self.map, there[-1] if there else ())
        return self._outlines[n]


def patch_marks(camera: CameraSpec, outlines: Sequence[PatchOutline], ego: Pose) -> list[PatchMark]:
    """Returns kind and polygon in px of what lies on the road within PATCH_REACH m, as a camera sees it."""
    view = camera_view(camera, ego)
    found = []
    for outline in outlines:
        if np.hypot(*(outline.corners[:, :2] - (ego.x, ego.y)).T).min() > PATCH_REACH:
            continue
        p = _before_camera((outline.corners - view.centre) @ view.rotation.T)
        if len(p) < 3:
            continue
        u, v = view.cx + view.focal * p[:, 0] / p[:, 2], view.cy + view.focal * p[:, 1] / p[:, 2]
        found.append((outline.kind, [(_px(a), _px(b)) for a, b in zip(u, v, strict=True)]))
    return found


def _before_camera(p: Floats) -> Floats:
    """Returns the part of a polygon (n, 3) in a camera's axes that lies NEAR m or more before it."""
    kept = []
    for a, b in zip(p, np.roll(p, -1, axis=0), strict=True):
        if a[2] >= NEAR:
            kept.append(a)
        if (a[2] >= NEAR) != (b[2] >= NEAR):
            kept.append(a + (b - a) * (NEAR - a[2]) / (b[2] - a[2]))
    return np.array(kept).reshape(-1, 3)


def _px(value: float) -> int:
    """Returns a pixel coordinate as a whole number, cut to +-PX_MOST."""
    return int(min(max(value, -PX_MOST), PX_MOST))


def marks_of(
    camera: CameraSpec, radar: RadarPoints, report: StackReport, light: LightMark | None = None
) -> Marks:
    """Returns radar points in the picture and a bracket at the reported distance, as a camera sees them."""
    shown = project(camera, _radar_points(radar))
    points = [
        (int(u), int(v), bool(rate < CLOSING))
        for (u, v, depth), rate in zip(shown.tolist(), radar.velocity.tolist(), strict=True)
        if depth > 0.5 and 0 <= u < camera.width and 0 <= v < camera.height
    ]
    if report.distance is None:
        return Marks(points, None, "", light)
    x = report.distance + RADAR_MOUNT.x
    box = np.array([[x, LEAD_HALF_WIDTH, LEAD_HEIGHT], [x, -LEAD_HALF_WIDTH, 0.0]])
    (left, top, near), (right, bottom, _) = project(camera, box).tolist()
    if near <= 0.5:
        return Marks(points, None, "", light)
    status = "" if report.status is None else report.status.name.replace("_", " ").lower()
    lead = (int(left), int(top), int(right), int(bottom))
    return Marks(points, lead, f"{report.distance:.1f} m  {status}", light)


def _radar_points(radar: RadarPoints) -> Floats:
    """Returns the radar's points as (n, 3) in the ego's frame, m."""
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


class LightAhead:
    """Finds the heads of the traffic light that a stack reports, by the distance of its stop line."""

    def __init__(self, map: RoadMap) -> None:
        self.map, self.scan = map, LightScan(map)
        self.heads: dict[int, list[SignalHead]] = {}
        for head in map.roadside.heads:
            self.heads.setdefault(head.signal, []).append(head)

    def mark(self, camera: CameraSpec, moment: Moment) -> LightMark | None:
        """Returns the light as a camera sees it; None: none is reported, or it is not in the picture."""
        report, pose = moment.report, moment.truth.states.pose(0)
        if report.light_distance is None:
            return None
        frames = [
            frame
            for head in self._reported_heads(moment, report.light_distance)
            if (frame := _frame(camera, head, pose)) is not None
        ]
        if not frames:
            return None
        state = "unknown" if report.light_state is None else report.light_state.name.lower()
        seen = "" if report.hsv is None else f", camera: {report.hsv.name.lower()}"
        return LightMark(frames, state, f"{state} {report.light_distance:.0f} m{seen}")

    def _reported_heads(self, moment: Moment, distance: float) -> list[SignalHead]:
        """Returns the heads of the next light on the lane; none where its stop line lies elsewhere.

        distance: m to the line as the stack reports it, LIGHT_AGREES m may be between.
        """
        ego = moment.frame.ego
        here = self.map.project(ego.pose.x, ego.pose.y, ego.pose.z)
        lane, s = (-1, 0.0) if here is None else (here.lane, here.s)
        found = self.scan.look(self.map, ego.pose, ego.speed, lane, s, moment.truth.lights)
        if found.signal is None or found.distance is None:
            return []
        agrees = abs(found.distance - distance) <= LIGHT_AGREES
        return self.heads.get(found.signal, []) if agrees else []


def _frame(camera: CameraSpec, head: SignalHead, ego: Pose) -> tuple[int, int, int, int] | None:
    """Returns left, top, right, bottom in px around a light's head; None where it is out of sight."""
    ((u, v, depth),) = project(camera, np.array([[head.x, head.y, head.z]]), ego).tolist()
    if depth <= 0.5 or not (0 <= u < camera.width and 0 <= v < camera.height):
        return None
    scale = camera.focal * head.lamp_diameter / depth  # px
    wide, high = max(HEAD_WIDE * scale, LIGHT_LEAST), max(HEAD_HIGH * scale, LIGHT_LEAST)
    return int(u - wide), int(v - high), int(u + wide), int(v + high)
