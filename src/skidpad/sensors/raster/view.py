"""A pin-hole view of the world, as the kernels take it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec

NEAR = 0.05  # m, planar; nothing nearer is drawn or hit


class View(NamedTuple):
    """Camera axes: x right, y down, z forward along the optical axis."""

    width: int  # px
    height: int  # px, end of the rows that are drawn
    focal: float  # px
    cx: float  # px
    cy: float  # px
    rotation: NDArray[np.float64]  # (3, 3) world to camera: rows are the camera's axes
    centre: NDArray[np.float64]  # (3,) world, m
    top: int = 0  # px, first row that is drawn; `height` ends the last one


def world_to_camera(pose: Pose) -> NDArray[np.float64]:
    """Returns (3, 3) world to camera axes (right, down, forward) for one that looks along the pose's x."""
    forward, left, up = pose.rotation().T
    return np.ascontiguousarray(np.stack([-left, -up, forward]))


def camera_view(spec: CameraSpec, pose_world_body: Pose) -> View:
    """Returns the view of a mounted camera while its carrier stands at the pose."""
    pose = pose_world_body @ spec.mount
    return View(
        spec.width,
        spec.height,
        spec.focal,
        spec.cx,
        spec.cy,
        world_to_camera(pose),
        np.array([pose.x, pose.y, pose.z]),
    )
