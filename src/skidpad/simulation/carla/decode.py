"""CARLA's sensor bytes to our units and axes; no wheel needed."""

from __future__ import annotations

from math import inf
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Bytes, Floats32
from skidpad.core.frames import LidarPoints, RadarPoints
from skidpad.core.kernels.jit import kernel
from skidpad.core.maths.lefthanded import angles_to_carla, vectors_to_carla
from skidpad.core.specs import CameraSpec
from skidpad.core.vocabulary import SemanticClass

SKY = int(SemanticClass.SKY)


@kernel
def instance_rows(bgra: Bytes, rows: NDArray[np.uint16], out: NDArray[np.uint16]) -> None:
    """Writes the row + 1 of each pixel's actor into out (H, W), 0 for the map.

    bgra (H, W, 4): actor ids in green (low byte) and blue.
    rows: (65536,) row + 1 by the lower 16 bits of an actor id.
    """
    for y in range(out.shape[0]):
        for x in range(out.shape[1]):
            out[y, x] = rows[np.int64(bgra[y, x, 1]) + 256 * np.int64(bgra[y, x, 0])]


def packed_rgb(bgra: Bytes, out: NDArray[np.uint32]) -> None:
    """Writes (H, W, 4) blue, green, red, alpha as (H, W) packed red, green, blue, alpha into `out`."""
    cv2.cvtColor(bgra, cv2.COLOR_BGRA2RGBA, dst=out.view(np.uint8).reshape(*out.shape, 4))


@kernel
def _hide_beyond(
    sight: float,
    focal: float,
    cx: float,
    cy: float,
    inverse: Floats32,
    pixels: NDArray[Any],
    hidden: int,
) -> None:
    """Sets pixels whose ray is longer than `sight` m to `hidden`; they may be `inverse` itself.

    inverse: (H, W) inverse depth in 1/m, of the same view.
    """
    for y in range(pixels.shape[0]):
        v = (y + 0.5 - cy) / focal
        for x in range(pixels.shape[1]):
            u = (x + 0.5 - cx) / focal
            near = inverse[y, x] * sight
            if near * near < u * u + v * v + 1.0:
                pixels[y, x] = hidden


def limit_sight(
    camera: CameraSpec, sight: float, inverse: Floats32, labels: Bytes | None = None
) -> None:
    """Hides what the weather hides: classes become SKY in `labels`, else inverse depths 0 (decision M-1)."""
    pixels, hidden = (inverse, 0) if labels is None else (labels, SKY)
    _hide_beyond(sight, camera.focal, camera.cx, camera.cy, inverse, pixels, hidden)


def radar_points(raw: bytes | memoryview, limit: float = inf) -> RadarPoints:
    """Returns the radar's points within `limit` m, in our axes.

    raw: velocity, azimuth, altitude, depth of each (float32).
    """
    points = np.frombuffer(raw, dtype="<f4").reshape(-1, 4)
    points = points[points[:, 3] <= limit].astype(np.float32)
    azimuth = angles_to_carla(points[:, 1]).astype(np.float32)
    return RadarPoints(points[:, 3].copy(), azimuth, points[:, 2].copy(), points[:, 0].copy())


SEMANTIC_POINT = np.dtype(
    [("place", "<f4", 3), ("cosine", "<f4"), ("actor", "<u4"), ("tag", "<u4")]
)


def lidar_points(
    raw: bytes | memoryview, rows: NDArray[np.uint16], extinction: float
) -> LidarPoints:
    """Returns the points of a semantic lidar; its class and actor come instead of an intensity.

    rows: row + 1 by the lower bits of an actor id. extinction: of light in the air, 1/m.
    """
    points = np.frombuffer(raw, dtype=SEMANTIC_POINT)
    places = vectors_to_carla(*points["place"].astype(np.float64).T)
    distance = np.linalg.norm(places, axis=1)
    return LidarPoints(
        places.astype(np.float32),
        np.exp(-extinction * distance).astype(np.float32),
        points["cosine"].copy(),
        points["tag"].astype(np.uint8),
        rows[points["actor"] % len(rows)],
    )
