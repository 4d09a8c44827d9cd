"""A traffic light's colour from the front image (A-164 to A-167, A-171)."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.vocabulary import LightState

UPPER_ROWS = 0.60  # share of the image height
# Hue 0 to 180, saturation and value 0 to 255, as in OpenCV.
MIN_SATURATION = 80
MIN_VALUE = 80
RED_HUES = ((0, 10), (170, 180))
YELLOW_HUES = ((20, 35),)
AREAS = (3.0, 1000.0)  # px; the upper limit alone rejects a low sun (D-068)
ASPECTS = (0.3, 2.0)  # width / height of the bounding box


def detect_lamp(rgb: NDArray[np.uint8] | None) -> LightState | None:
    """RED, YELLOW, or None for neither, from an (H, W, 3) red-green-blue image."""
    if rgb is None:
        return None
    upper = rgb[: round(rgb.shape[0] * UPPER_ROWS)]
    hsv = cv2.cvtColor(np.ascontiguousarray(upper), cv2.COLOR_RGB2HSV)
    if _has_lamp(hsv, RED_HUES):
        return LightState.RED
    if _has_lamp(hsv, YELLOW_HUES):
        return LightState.YELLOW
    return None


def _has_lamp(hsv: Any, hues: tuple[tuple[int, int], ...]) -> bool:
    mask: Any = np.zeros(hsv.shape[:2], dtype=np.uint8)
    for low, high in hues:
        mask |= cv2.inRange(hsv, (low, MIN_SATURATION, MIN_VALUE), (high, 255, 255))
    if not mask.any():
        return False
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
    return any(_is_lamp(contour) for contour in contours)


def _is_lamp(contour: Any) -> bool:
    _, _, width, height = cv2.boundingRect(contour)
    area = cv2.contourArea(contour)
    return AREAS[0] <= area <= AREAS[1] and ASPECTS[0] <= width / height <= ASPECTS[1]
