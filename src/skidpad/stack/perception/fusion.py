"""The distance ahead from two camera pairs: bumper for near, roof for far (A-040 to A-065)."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence
from math import isnan, sin
from statistics import median

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import ConfigError
from skidpad.core.frames import CameraImage, SensorFrame, image_rows
from skidpad.core.kernels.jit import hold
from skidpad.core.specs import CameraSpec, Modality, SensorSpec
from skidpad.stack.perception import corridor
from skidpad.stack.perception.corridor import VEHICLES, Corridor, Labels
from skidpad.stack.timing import ticks_within

PERCENTILE = 0.10  # of the kept depths

BUMPER_ROWS = (0.15, 0.95)  # share of the image height
BUMPER_MIN_VEHICLE = 100  # px
BUMPER_HALF_WIDTH = 1.8  # m
BUMPER_DEPTHS = (0.1, 30.0)  # m
BUMPER_MIN_KEPT = 50  # px

ROOF_ROWS = (0.25, 0.75)  # share of the image height
ROOF_MIN_VEHICLE = 30  # px
ROOF_HALF_WIDTH = 1.6  # m at the camera
ROOF_WIDENING = 0.8 / 50.0  # m per m
ROOF_HALF_WIDTH_MAX = 2.6  # m
ROOF_DEPTHS = (10.0, 80.0)  # m
ROOF_MIN_KEPT = 20  # px

BLEND_FROM = 15.0  # m of bumper reading
BLEND_OVER = 10.0  # m
BUMPER_ALONE_BELOW = 30.0  # m

MEDIAN_SAMPLES = 5
NOTHING = 100.0  # m, stands for "no target" inside the filters, never outside
RATE_LIMIT = 240.0  # m/s
RATE_WINDOW = 0.17  # s

VERIFY_TOLERANCE = 2.0  # m between a pixel and the reported distance


def _rows(height: int, share: tuple[float, float]) -> tuple[int, int]:
    """Returns the pixel rows that belong to two shares 0..1 of the image height."""
    return round(height * share[0]), round(height * share[1])


def bumper_corridor(camera: CameraSpec, wanted: Labels = VEHICLES) -> Corridor:
    """Returns what the bumper tier keeps; `camera` is the semantic one: depth is read at its pixels."""
    first, end = _rows(camera.height, BUMPER_ROWS)
    near, far = BUMPER_DEPTHS
    return Corridor(
        camera.focal, camera.cx, first, end, BUMPER_HALF_WIDTH, 0.0, BUMPER_HALF_WIDTH,
        near, far, BUMPER_MIN_VEHICLE, BUMPER_MIN_KEPT, wanted,
    )  # fmt: skip


def roof_corridor(camera: CameraSpec, flat: bool = False, wanted: Labels = VEHICLES) -> Corridor:
    """Returns what the roof tier keeps; flat: 1.6 m at every depth (A-051)."""
    first, end = _rows(camera.height, ROOF_ROWS)
    near, far = ROOF_DEPTHS
    widening = 0.0 if flat else ROOF_WIDENING
    return Corridor(
        camera.focal, camera.cx, first, end, ROOF_HALF_WIDTH, widening, ROOF_HALF_WIDTH_MAX,
        near, far, ROOF_MIN_VEHICLE, ROOF_MIN_KEPT, wanted,
    )  # fmt: skip


class CameraPair:
    """A depth and a semantic camera with one view, read through a corridor."""

    UNSAVED = ("scratch",)

    def __init__(self, depth: CameraSpec, semantic: CameraSpec, keep: Corridor) -> None:
        if (depth.width, depth.height) != (semantic.width, semantic.height):
            raise ConfigError(
                f"cameras {depth.id} and {semantic.id} must have one size, got "
                f"{depth.width}x{depth.height} and {semantic.width}x{semantic.height} px"
            )
        self.depth_id, self.semantic_id, self.keep = depth.id, semantic.id, keep
        self._held = hold(keep)
        self.scratch = np.empty(depth.width * (keep.row_end - keep.row_first), dtype=np.float32)

    def read(self, frame: SensorFrame, yaw_error: float, kappa: float) -> float | None:
        """Returns the distance of the 10th percentile in m; None: no target, or no image yet (A-037).

        yaw_error: rad to the lane, left positive; kappa: half the lane's curvature.
        """
        return self.read_between(self.keep.near, self.keep.far, frame, yaw_error, kappa)

    def read_between(
        self, near: float, far: float, frame: SensorFrame, yaw_error: float, kappa: float
    ) -> float | None:
        """Returns what `read` does, between other depths in m."""
        segments = frame.segments.get(self.depth_id)
        if segments is not None:
            if not len(segments.u):
                return None
            distance = corridor.read_held_segments(
                *segments, self._held, near, far, PERCENTILE, sin(yaw_error), kappa
            )
        else:
            images = self._pair(frame.images)
            if images is None:
                return None
            keep = self.keep._replace(near=near, far=far)
            distance = corridor.read_pixels(
                *images, keep, PERCENTILE, sin(yaw_error), kappa, self.scratch
            )
        return None if isnan(distance) else distance

    def _pair(
        self, images: Mapping[str, CameraImage]
    ) -> tuple[NDArray[np.float32], NDArray[np.uint8]] | None:
        """Returns inverse depth and labels of the read rows; None where either image is missing."""
        rows = self.keep.row_first, self.keep.row_end
        depth = image_rows(images, self.depth_id, rows)
        semantic = image_rows(images, self.semantic_id, rows)
        if depth is None or semantic is None:
            return None
        if depth.inverse_depth is None or semantic.labels is None:
            return None
        return depth.inverse_depth, semantic.labels


def camera_pair(
    specs: Sequence[SensorSpec], depth_id: str, semantic_id: str
) -> tuple[CameraSpec, CameraSpec]:
    """Returns the specs of a depth and a semantic camera by sensor id; ConfigError without such a pair."""
    cameras = {spec.id: spec for spec in specs if isinstance(spec, CameraSpec)}
    for name, modality in ((depth_id, Modality.DEPTH), (semantic_id, Modality.SEMANTIC)):
        if name not in cameras or cameras[name].modality is not modality:
            raise ConfigError(
                f"the stack needs a {modality.value} camera {name!r}; the vehicle has: "
                + ", ".join(spec.id for spec in specs)
            )
    return cameras[depth_id], cameras[semantic_id]


def fuse(
    bumper: float | None,
    roof: float | None,
    bumper_alone: bool = True,
    guard: float | None = None,
) -> float | None:
    """Returns one distance in m from both tiers, None: no target (eq. 9, A-055 to A-059).

    bumper_alone: below 30 m the bumper reading counts when the roof sees nothing (D-017).
    guard: where both see a target but differ by more than this, the nearer counts.
    """
    if bumper is None or bumper <= BLEND_FROM:
        return roof if bumper is None else bumper
    if roof is None:
        return bumper if bumper_alone and bumper < BUMPER_ALONE_BELOW else None
    if guard is not None and abs(bumper - roof) > guard:
        return min(bumper, roof)
    w = (bumper - BLEND_FROM) / BLEND_OVER
    return (1.0 - w) * bumper + w * roof if w < 1.0 else roof


class MedianFilter:
    """Median of the last five samples, absent ones counting as far away (A-061)."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Resets the samples to no target."""
        self.samples = deque([NOTHING] * MEDIAN_SAMPLES, maxlen=MEDIAN_SAMPLES)

    def update(self, distance: float | None) -> float | None:
        """Returns the filtered distance after one more sample; None, in and out: no target."""
        self.samples.append(NOTHING if distance is None else distance)
        middle = sorted(self.samples)[MEDIAN_SAMPLES // 2]
        return middle if middle < NOTHING else None


class RateFilter:
    """Limits how fast the distance changes, then takes the median over a window (A-062)."""

    def __init__(self, dt: float) -> None:
        self.step = RATE_LIMIT * dt
        self.length = max(1, ticks_within(RATE_WINDOW, dt))
        self.reset()

    def reset(self) -> None:
        """Resets the smoothed distance and its history to no target."""
        self.smoothed = NOTHING
        self.history = deque([NOTHING] * self.length, maxlen=self.length)

    def update(self, distance: float | None) -> float | None:
        """Returns the filtered distance after one more sample; None, in and out: no target."""
        change = (NOTHING if distance is None else distance) - self.smoothed
        self.smoothed += min(max(change, -self.step), self.step)
        self.history.append(self.smoothed)
        middle = median(self.history)
        return middle if middle < NOTHING else None


class Verification:
    """Are there wanted pixels in the ego's corridor near the reported distance? (A-065)"""

    def __init__(self, bumper: CameraPair, roof: CameraPair) -> None:
        self.pairs = (("bumper", bumper), ("roof", roof))

    def confirm(
        self, frame: SensorFrame, distance: float, yaw_error: float, kappa: float
    ) -> tuple[bool, str]:
        """Returns whether the pixels confirm a target at `distance` m, and by which pair, else "none".

        The bumper is asked first, the roof without its minimum depth (D-009).
        """
        for name, pair in self.pairs:
            near = max(distance - VERIFY_TOLERANCE, BUMPER_DEPTHS[0])
            far = distance + VERIFY_TOLERANCE
            if pair.read_between(near, far, frame, yaw_error, kappa) is not None:
                return True, name
        return False, "none"
