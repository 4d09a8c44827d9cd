"""The distance ahead from two camera pairs: bumper for near, roof for far (A-040 to A-065)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import inf, isnan, nan, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.errors import ConfigError
from skidpad.core.frames import CameraImage, SensorFrame, image_rows
from skidpad.core.kernels.jit import kernel
from skidpad.core.settings.stack import StackSettings
from skidpad.core.specs import CameraSpec, Modality, SensorSpec
from skidpad.stack.memory import Record
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
    """A depth and a semantic camera with one view, whose images are read through a corridor."""

    UNSAVED = ("scratch",)

    def __init__(self, depth: CameraSpec, semantic: CameraSpec, keep: Corridor) -> None:
        if (depth.width, depth.height) != (semantic.width, semantic.height):
            raise ConfigError(
                f"cameras {depth.id} and {semantic.id} must have one size, got "
                f"{depth.width}x{depth.height} and {semantic.width}x{semantic.height} px"
            )
        self.depth_id, self.semantic_id, self.keep = depth.id, semantic.id, keep
        self.scratch = np.empty(depth.width * (keep.row_end - keep.row_first), dtype=np.float32)

    def read(self, frame: SensorFrame, yaw_error: float, kappa: float) -> float:
        """Returns the distance of the 10th percentile in m; NaN: no target, or no image yet (A-037).

        yaw_error: rad to the lane, left positive; kappa: half the lane's curvature.
        """
        return self.read_between(self.keep.near, self.keep.far, frame, yaw_error, kappa)

    def read_between(
        self, near: float, far: float, frame: SensorFrame, yaw_error: float, kappa: float
    ) -> float:
        """Returns what `read` does, between other depths in m."""
        images = self._pair(frame.images)
        if images is None:
            return nan
        keep = self.keep._replace(near=near, far=far)
        return float(
            corridor.read_pixels(*images, keep, PERCENTILE, sin(yaw_error), kappa, self.scratch)
        )

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


class FusionRules(NamedTuple):
    """How both tiers are joined and filtered."""

    bumper_alone: bool  # the bumper counts below 30 m when the roof sees nothing (D-017)
    guard: float  # m, tiers that differ by more: the nearer counts; inf: off
    limits_rate: bool
    rate_step: float  # m per tick


def fusion_rules(settings: StackSettings, dt: float) -> FusionRules:
    """Returns how tiers are joined by these settings; dt: s, one tick."""
    guard = settings.consistency_guard
    return FusionRules(
        bumper_alone=settings.bumper_alone,
        guard=inf if guard is None else guard,
        limits_rate=settings.rate_filter,
        rate_step=RATE_LIMIT * dt,
    )


def far_samples(n: int) -> Floats:
    """Returns the samples of a filter that has seen nothing."""
    return np.full(n, NOTHING)


def rate_samples(dt: float) -> Floats:
    """Returns the samples of the rate filter's window (A-062); dt: s, one tick."""
    return far_samples(max(1, ticks_within(RATE_WINDOW, dt)))


@kernel
def fuse(rules: FusionRules, bumper: float, roof: float) -> float:
    """Returns one distance in m from both tiers, NaN: no target (eq. 9, A-055 to A-059)."""
    if isnan(bumper) or bumper <= BLEND_FROM:
        return roof if isnan(bumper) else bumper
    if isnan(roof):
        return bumper if rules.bumper_alone and bumper < BUMPER_ALONE_BELOW else nan
    if abs(bumper - roof) > rules.guard:
        return min(bumper, roof)
    w = (bumper - BLEND_FROM) / BLEND_OVER
    return (1.0 - w) * bumper + w * roof if w < 1.0 else roof


@kernel
def push(samples: Floats, distance: float) -> None:
    """Puts one more sample at the end, and drops the first; none counts as far away (A-061)."""
    for k in range(samples.size - 1):
        samples[k] = samples[k + 1]
    samples[-1] = NOTHING if isnan(distance) else distance


@kernel
def find_rank(samples: Floats, rank: int) -> float:
    """Returns the sample of this rank, 0 for the smallest."""
    for k in range(samples.size):
        below = same = 0
        for other in samples:
            below += other < samples[k]
            same += other == samples[k]
        if below <= rank < below + same:
            return float(samples[k])
    return nan


@kernel
def median(samples: Floats) -> float:
    """Returns the middle sample, the mean of two where their number is even; NaN: none is near."""
    n = samples.size
    middle = find_rank(samples, n // 2)
    if n % 2 == 0:
        middle = (find_rank(samples, n // 2 - 1) + middle) / 2
    return middle if middle < NOTHING else nan


@kernel
def limit_rate(m: Record, rules: FusionRules, history: Floats, distance: float) -> float:
    """Returns the distance whose changes are limited, and then the median over a window (A-062)."""
    change = (NOTHING if isnan(distance) else distance) - m.smoothed
    m.smoothed += min(max(change, -rules.rate_step), rules.rate_step)
    push(history, m.smoothed)
    return median(history)


@kernel
def verified_depths(distance: float) -> tuple[float, float]:
    """Returns the depths in m between which a pixel bears a target out (A-065)."""
    return max(distance - VERIFY_TOLERANCE, BUMPER_DEPTHS[0]), distance + VERIFY_TOLERANCE
