"""All twelve sensors of one moment in one picture, with what the stack made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.loop import Moment
from skidpad.core.frames import CameraImage, RadarPoints
from skidpad.core.states import StackReport
from skidpad.core.vocabulary import Supervision
from skidpad.sensors.pictures.encodings import cityscapes_colours

Picture = NDArray[np.uint8]

# id of the sensor: left, top, width, height in the picture, px
LAYOUT = {
    "rgb_front": (0, 0, 800, 600),
    "rgb_mirror_left": (800, 0, 240, 150),
    "rgb_rear": (1040, 0, 320, 150),
    "rgb_mirror_right": (1360, 0, 240, 150),
    "depth_roof": (800, 150, 400, 300),
    "semantic_roof": (1200, 150, 400, 300),
    "depth_bumper": (800, 450, 200, 150),
    "semantic_bumper": (1000, 450, 200, 150),
    "rgb_top": (1200, 450, 150, 150),
}
RADAR_BOX = (1350, 450, 250, 150)
TEXT_BOX = (0, 600, 1600, 120)
SIZE = (720, 1600)  # rows, columns
DEPTH_SHOWN = 80.0  # m, white to black
RADAR_SHOWN = 80.0  # m
INK, DIM, ACCENT = (235, 235, 235), (150, 160, 170), (255, 133, 82)


def twelve_views(moment: Moment, dt: float) -> Picture:
    """Returns a (720, 1600, 3) RGB picture: nine cameras, radar from above, commands, report and events."""
    frame = moment.frame
    picture = np.zeros((*SIZE, 3), dtype=np.uint8)
    for id, (left, top, width, height) in LAYOUT.items():
        if id in frame.images:
            small = cv2.resize(
                colours(frame.images[id]), (width, height), interpolation=cv2.INTER_AREA
            )
            picture[top : top + height, left : left + width] = small
        _write(picture, id, left + 6, top + 16, DIM, 0.42)
    _draw_radar(picture, frame.radar)
    _draw_text(picture, moment, dt)
    return picture


def colours(image: CameraImage) -> Picture:
    """Returns a camera's picture in RGB: colours as they are, classes in theirs, depth white to black."""
    if image.rgb is not None:
        return np.ascontiguousarray(image.rgb)
    if image.labels is not None:
        return np.ascontiguousarray(cityscapes_colours(image.labels))
    grey = 255.0 * (1.0 - np.minimum(image.depth() / DEPTH_SHOWN, 1.0))
    return np.repeat(grey.astype(np.uint8)[..., None], 3, axis=2)


def _draw_radar(picture: Picture, points: RadarPoints) -> None:
    """Draws the radar points from above, closing ones in another colour."""
    left, top, width, height = RADAR_BOX
    x = left + width / 2.0 - points.range * np.sin(points.azimuth) * height / RADAR_SHOWN * 2.0
    y = top + height - points.range * np.cos(points.azimuth) * height / RADAR_SHOWN
    for u, v, rate in zip(x, y, points.velocity, strict=True):
        if left <= u < left + width and top <= v < top + height:
            cv2.circle(picture, (int(u), int(v)), 2, ACCENT if rate < -1.0 else INK, -1)
    _write(picture, "radar: orange closing", left + 6, top + 16, DIM, 0.42)


def _draw_text(picture: Picture, moment: Moment, dt: float) -> None:
    """Draws time, speed, commands, the stack's report and events as lines of text."""
    frame, truth = moment.frame, moment.truth
    left, top, _, _ = TEXT_BOX
    first = f"{frame.tick * dt:7.2f} s   {3.6 * frame.ego.speed:5.1f} km/h"
    if frame.supervision is not Supervision.NONE:
        first += f"   supervisor: {frame.supervision.name.lower().replace('_', ' ')}"
    throttle, brake, steer = truth.commands[0, :3]
    first += f"   throttle {throttle:.2f}  brake {brake:.2f}  steer {steer:+.2f}"
    _write(picture, first, left + 12, top + 30, INK, 0.62)
    _write(
        picture, _describe_report(moment.report, moment.driver.mode), left + 12, top + 62, INK, 0.55
    )
    events = [f"contact with {c.static or truth.table.names[c.actor]}" for c in truth.contacts]
    events += [f"{i.marking} marking crossed" for i in truth.invasions]
    _write(picture, ", ".join(events), left + 12, top + 94, ACCENT, 0.55)


def _describe_report(report: StackReport, mode: str) -> str:
    """Returns what is known of a stack's report as one line; the mode stands for the tier."""
    tier = report.tier.name.lower().replace("_", " ") if report.tier is not None else None
    shown: Mapping[str, Any] = {
        "tier": mode or tier,
        "status": report.status.name.lower().replace("_", " ")
        if report.status is not None
        else None,
        "distance": report.distance,
        "gap": report.time_gap,
        "bumper": report.bumper,
        "roof": report.roof,
        "radar": report.radar_lane,
        "light at": report.light_distance,
        "hsv": report.hsv.name.lower() if report.hsv is not None else None,
    }
    return "   ".join(
        f"{name} {value:.1f}" if isinstance(value, float) else f"{name} {value}"
        for name, value in shown.items()
        if value is not None
    )


def _write(
    picture: Picture, text: str, x: int, y: int, ink: tuple[int, int, int], scale: float
) -> None:
    """Writes a line of text with its left end at (x, y) px."""
    cv2.putText(picture, text, (x, y), cv2.FONT_HERSHEY_SIMPLEX, scale, ink, 1, cv2.LINE_AA)
