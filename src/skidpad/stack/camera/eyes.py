"""The three forward cameras of the camera driver, and its images as the network takes them."""

from __future__ import annotations

from collections.abc import Mapping
from math import radians

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import StackError
from skidpad.core.frames import CameraImage
from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality

HEIGHT_ABOVE_ROAD, AHEAD = 1.4, 0.5  # m: behind the windscreen
TILT_DEG = 5.0  # down: less sky
SIDE_DEG = 50.0  # outwards
MIDDLE = (128, 64)  # px, width and height
SIDE = (64, 32)
MIDDLE_FOV_DEG, SIDE_FOV_DEG = 50.0, 60.0
LEFT_ID, CENTRE_ID, RIGHT_ID = "camera/left", "camera/centre", "camera/right"


def _camera(id: str, size: tuple[int, int], fov_deg: float, yaw_deg: float) -> CameraSpec:
    """Returns the spec of an RGB camera at the common mount, turned by `yaw_deg`."""
    mount = Pose(AHEAD, 0.0, HEIGHT_ABOVE_ROAD, 0.0, radians(TILT_DEG), radians(yaw_deg))
    return CameraSpec(id, Modality.RGB, *size, fov_deg, mount)


CAMERAS = (
    _camera(CENTRE_ID, MIDDLE, MIDDLE_FOV_DEG, 0.0),
    _camera(LEFT_ID, SIDE, SIDE_FOV_DEG, SIDE_DEG),
    _camera(RIGHT_ID, SIDE, SIDE_FOV_DEG, -SIDE_DEG),
)


def images_of(readings: Mapping[str, CameraImage]) -> tuple[NDArray[np.uint8], ...]:
    """Returns (H, W, 3) bytes of centre, left and right; StackError where an image is missing."""
    found = []
    for camera in CAMERAS:
        image = readings[camera.id].rgb if camera.id in readings else None
        if image is None:
            raise StackError("the camera driver sees images: run with --sensors pixels")
        found.append(image)
    return tuple(found)
