"""From a packet to what a browser shows, and to a picture of a film: marks are drawn here, once."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from skidpad.cockpit.feed import Array, Packet
from skidpad.sensors.pictures.encodings import cityscapes_colours

Picture = NDArray[np.uint8]  # (H, W, 3) blue, green, red, as OpenCV wants it
QUALITY = 80  # of JPEG
LIGHTS = {"red": (60, 60, 255), "yellow": (60, 220, 255), "green": (110, 220, 60)}  # the same order
LIGHT_OFF = (200, 200, 200)
SURFACES = {  # blue, green, red
    "water": (200, 130, 40),
    "ice": (235, 215, 150),
    "snow": (245, 245, 245),
    "friction": (170, 80, 150),
}
COAT = 0.3  # of a patch's colour over the road
CLOSING, STEADY, LEAD = (82, 133, 255), (235, 235, 235), (127, 206, 79)  # blue, green, red


def colours(array: Array) -> Picture:
    """Returns the image of a view as blue, green and red bytes."""
    if array.dtype == np.uint32:
        rgba = array.view(np.uint8).reshape(*array.shape, 4)
        return np.asarray(cv2.cvtColor(rgba, cv2.COLOR_RGBA2BGR), dtype=np.uint8)
    return np.asarray(cv2.cvtColor(array, cv2.COLOR_GRAY2BGR), dtype=np.uint8)


def views_of(packet: Packet, told: Mapping[str, Any]) -> dict[str, Picture]:
    """Returns all views of a packet in colours, with the marks drawn into them."""
    marks = told.get("marks", {})
    found = {}
    for name, array in packet.views.items():
        if "semantic" in (name, told.get("main") if name == "beside" else None):
            picture = np.ascontiguousarray(cityscapes_colours(array.astype(np.uint8))[..., ::-1])
        else:
            picture = colours(array)
        if name in marks:
            draw(picture, *marks[name])
        found[name] = picture
    return found


def draw(
    picture: Picture,
    points: list[list[int]],
    lead: list[int] | None,
    label: str,
    light: list[Any] | None,
    patches: Sequence[tuple[str, list[list[int]]]] = (),
) -> None:
    """Draws patches of road, the light, radar points and the bracket at the reported distance, in place.

    Coordinates are px; lead: left, top, right, bottom.
    """
    draw_patches(picture, patches)
    if light is not None:
        draw_light(picture, *light)
    for u, v, closing in points:
        cv2.circle(picture, (u, v), 3, CLOSING if closing else STEADY, -1, cv2.LINE_AA)
    if lead is None:
        return
    left, top, right, bottom = lead
    arm = max(4, (right - left) // 4)
    for x, turn in ((left, 1), (right, -1)):
        for y, down in ((top, 1), (bottom, -1)):
            cv2.line(picture, (x, y), (x + turn * arm, y), LEAD, 2, cv2.LINE_AA)
            cv2.line(picture, (x, y), (x, y + down * arm), LEAD, 2, cv2.LINE_AA)
    at = (left, max(top - 8, 14))
    cv2.putText(picture, label, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, LEAD, 1, cv2.LINE_AA)


def draw_patches(picture: Picture, patches: Sequence[tuple[str, list[list[int]]]]) -> None:
    """Draws what lies on the road as a thin coat of colour within a line, in place."""
    for kind, corners in patches:
        area = np.array(corners, dtype=np.int32)
        coat = picture.copy()
        cv2.fillPoly(coat, [area], SURFACES[kind])
        cv2.addWeighted(coat, COAT, picture, 1.0 - COAT, 0.0, dst=picture)
        cv2.polylines(picture, [area], True, SURFACES[kind], 1, cv2.LINE_AA)


def draw_light(picture: Picture, frames: list[list[int]], state: str, label: str) -> None:
    """Draws a frame about every head of the light, and what is known of it, in place."""
    ink = LIGHTS.get(state, LIGHT_OFF)
    for left, top, right, bottom in frames:
        cv2.rectangle(picture, (left, top), (right, bottom), ink, 2, cv2.LINE_AA)
    left, top, *_ = frames[0]
    at = (left, max(top - 8, 14))
    cv2.putText(picture, label, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, ink, 1, cv2.LINE_AA)


class Encoder:
    """Encodes packets as messages, each packet once, however many tabs look."""

    def __init__(self) -> None:
        self._number, self._message = 0, b""

    def message(self, packet: Packet) -> bytes:
        """Returns a packet's message: length of the head, the head (JSON), then pictures (JPEG)."""
        if packet.number == self._number:
            return self._message
        told = msgspec.json.decode(packet.told)
        pictures = [
            (name, cv2.imencode(".jpg", view, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes())
            for name, view in views_of(packet, told).items()
        ]
        told["number"] = packet.number
        told["views"] = [[name, len(data)] for name, data in pictures]
        del told["marks"]
        head = msgspec.json.encode(told)
        parts = [struct.pack("<I", len(head)), head, *(data for _, data in pictures)]
        self._number, self._message = packet.number, b"".join(parts)
        return self._message
