"""A traffic light's colour from the front image (A-164 to A-167, A-171).

OpenCV decides on colours and shapes. It is asked only about pixels that can be in a hue range and
about patches that can be large enough: noise in rain at night makes thousands of tiny ones.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.frames import CameraImage, image_rows, pack
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.specs import CameraSpec, SensorSpec
from skidpad.core.vocabulary import LightState

FRONT_CAMERA = "rgb_front"
UPPER_ROWS = 0.60  # share of the image height
# Hue 0 to 180, saturation and value 0 to 255, as in OpenCV.
MIN_SATURATION = 80
MIN_VALUE = 80
RED_HUES = ((0, 10), (170, 180))
YELLOW_HUES = ((20, 35),)
AREAS = (3.0, 1000.0)  # px; the upper limit alone rejects a low sun (D-068)
ASPECTS = (0.3, 2.0)  # width / height of the bounding box

# Necessary for any of the ranges, with a margin of one hue and one saturation step each.
_BRIGHT = np.int32(MIN_VALUE)
_SATURATED = np.int32(158)  # of 512
_REDDISH, _ORANGE, _YELLOW = (np.int32(n) for n in (11, 19, 24))  # of 30, share of the chroma


def rows_needed(height: int) -> int:
    """Returns how many of the upper rows of an image are looked at (A-164)."""
    return round(height * UPPER_ROWS)


class LampCamera:
    """The camera in which lamps are looked for; asks for the rows needed only."""

    def __init__(self, specs: Sequence[SensorSpec]) -> None:
        heights = [s.height for s in specs if isinstance(s, CameraSpec) and s.id == FRONT_CAMERA]
        self.rows = (0, rows_needed(heights[0])) if heights else (0, 0)

    def look(self, images: Mapping[str, CameraImage]) -> LightState | None:
        """Returns RED, YELLOW, or None for neither, also without a camera; green is not looked for."""
        return detect_lamp(image_rows(images, FRONT_CAMERA, self.rows))


def detect_lamp(image: CameraImage | None) -> LightState | None:
    """Returns RED, YELLOW, or None for neither, from a colour image; red before yellow."""
    if image is None or image.rgb is None:
        return None
    rows = rows_needed(image.rgb.shape[0])
    upper = pack(image.rgb[:rows]) if image.packed is None else image.packed[:rows]
    places, colours = colourful(upper)
    if not len(places):
        return None
    hsv = cv2.cvtColor(colours[None], cv2.COLOR_RGB2HSV)
    shape: tuple[int, int] = upper.shape
    if _has_lamp(hsv, places, shape, RED_HUES):
        return LightState.RED
    if _has_lamp(hsv, places, shape, YELLOW_HUES):
        return LightState.YELLOW
    return None


def _has_lamp(
    hsv: Any,
    places: NDArray[np.int32],
    shape: tuple[int, int],
    hues: tuple[tuple[int, int], ...],
) -> bool:
    """Returns whether the pixels within the hues form a patch of a lamp's size and shape.

    hsv (1, n, 3): colours of the pixels with flat indices `places` (n,) in an image of this shape.
    """
    chosen: Any = np.zeros(len(places), dtype=np.uint8)
    for low, high in hues:
        chosen |= cv2.inRange(hsv, (low, MIN_SATURATION, MIN_VALUE), (high, 255, 255))[0]
    mask: Any = np.zeros(shape, dtype=np.uint8)
    if not keep_large(places[chosen != 0], mask):
        return False
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return any(_is_lamp(contour) for contour in contours)


def _is_lamp(contour: Any) -> bool:
    """Returns whether a contour's area in px^2 and aspect ratio are those of a lamp."""
    _, _, width, height = cv2.boundingRect(contour)
    area = cv2.contourArea(contour)
    return AREAS[0] <= area <= AREAS[1] and ASPECTS[0] <= width / height <= ASPECTS[1]


@inner_kernel
def _may_be_lamp(pixel: np.uint32) -> bool:
    """Returns whether a packed pixel can be in one of the hue ranges."""
    word = np.int32(pixel & np.uint32(0xFFFFFF))
    r, g, b = word & 255, (word >> 8) & 255, word >> 16
    value = max(r, g, b)
    chroma = value - min(r, g, b)
    hue = np.int32(30) * (g - b)
    red = (r == value) & ((abs(hue) <= _REDDISH * chroma) | (hue >= _ORANGE * chroma))
    yellow = (g == value) & (np.int32(30) * (r - b) >= _YELLOW * chroma)
    lively = (value >= _BRIGHT) & (np.int32(512) * chroma >= _SATURATED * value)
    return bool(lively & (red | yellow))


@kernel
def _candidates(packed: NDArray[np.uint32], places: NDArray[np.int32]) -> int:
    """Writes the flat indices of all pixels that may belong to a lamp into `places`; returns how many."""
    height, width = packed.shape
    flags = np.empty(width, dtype=np.bool_)
    n = 0
    for y in range(height):
        row = packed[y]
        found = 0
        for x in range(width):
            flag = _may_be_lamp(row[x])
            flags[x] = flag
            found += flag
        if found == 0:
            continue
        for x in range(width):
            if flags[x]:
                places[n] = y * width + x
                n += 1
    return n


def colourful(packed: NDArray[np.uint32]) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
    """Returns flat indices (n,) and colours (n, 3) of all pixels that may be in a hue range (A-165)."""
    places = np.empty(packed.size, dtype=np.int32)
    places = places[: _candidates(packed, places)]
    chosen = packed.ravel()[places]
    return places, np.ascontiguousarray(chosen.view(np.uint8).reshape(-1, 4)[:, :3])


@kernel
def keep_large(places: NDArray[np.int32], mask: NDArray[np.uint8]) -> int:
    """Sets in the cleared `mask` all patches whose contour can have the least area; returns how many.

    Patches of `places` (flat indices) are 8-connected and become 255 in the mask (H, W) (A-166).
    A contour runs through pixel centres, so its area is at most (w - 1)(h - 1) of its box. Patches
    that enclose others are larger than that, so no inner one becomes an outer one.
    """
    height, width = mask.shape
    for i in range(places.size):
        mask[places[i] // width, places[i] % width] = 1
    stack = np.empty(places.size, dtype=np.int32)
    kept = 0
    for i in range(places.size):
        if mask[places[i] // width, places[i] % width] != 1:
            continue
        stack[0] = places[i]
        mask[places[i] // width, places[i] % width] = 2
        size, done = 1, 0
        top, bottom, left, right = height, -1, width, -1
        while done < size:
            y, x = stack[done] // width, stack[done] % width
            done += 1
            top, bottom = min(top, y), max(bottom, y)
            left, right = min(left, x), max(right, x)
            for v in range(max(y - 1, 0), min(y + 2, height)):
                for u in range(max(x - 1, 0), min(x + 2, width)):
                    if mask[v, u] == 1:
                        mask[v, u] = 2
                        stack[size] = v * width + u
                        size += 1
        large = (bottom - top) * (right - left) >= AREAS[0]
        kept += np.int32(large)
        for k in range(size):
            mask[stack[k] // width, stack[k] % width] = 255 if large else 0
    return kept
