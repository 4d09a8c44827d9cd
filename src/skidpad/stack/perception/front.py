"""Everything that looks ahead, joined: fusion, radar, persistence, verification."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.frames import RadarPoints, Segments, SensorFrame
from skidpad.core.kernels.jit import kernel
from skidpad.core.run import Function
from skidpad.core.settings.stack import RoofCorridor, StackSettings, Targets
from skidpad.core.specs import SensorSpec
from skidpad.roads.kernels import LaneArrays
from skidpad.stack.configurations import Functions
from skidpad.stack.memory import Record
from skidpad.stack.perception.corridor import ROAD_USERS, VEHICLES, Corridor, read_segments
from skidpad.stack.perception.fusion import (
    PERCENTILE,
    CameraPair,
    FusionRules,
    bumper_corridor,
    camera_pair,
    fuse,
    limit_rate,
    median,
    push,
    roof_corridor,
    verified_depths,
)
from skidpad.stack.perception.lane_view import Place
from skidpad.stack.perception.persistence import DetectionRules, detect, is_confirmed
from skidpad.stack.perception.radar import RadarRules, read_radar

ROOF = ("depth_roof", "semantic_roof")
BUMPER = ("depth_bumper", "semantic_bumper")
VERIFIED_BY = ("", "bumper", "roof", "none")  # not asked, or which pair bears the target out
BY_BUMPER, BY_ROOF, BY_NONE = 1, 2, 3
ROOM = 512  # radar points and runs of pixels; more need a larger room


class Cameras:
    """Both camera pairs of one vehicle."""

    def __init__(
        self, specs: Sequence[SensorSpec], functions: Functions, settings: StackSettings
    ) -> None:
        self.settings = settings
        self.wanted = VEHICLES if settings.targets is Targets.VEHICLES else ROAD_USERS
        bumper = camera_pair(specs, *BUMPER)
        self.bumper = CameraPair(*bumper, bumper_corridor(bumper[1], self.wanted))
        self._roof = camera_pair(specs, *ROOF)
        self.switch(functions)

    def switch(self, functions: Functions) -> None:
        """Sets the roof's corridor for these driving functions (D-015)."""
        narrow = self.settings.roof_corridor is RoofCorridor.FLAT_WITHOUT_LCA
        flat = narrow and Function.LCA not in functions
        self.roof = CameraPair(*self._roof, roof_corridor(self._roof[1], flat, self.wanted))

    def read(self, frame: SensorFrame, yaw_error: float, kappa: float) -> tuple[float, float]:
        """Returns what bumper and roof see in images, in m; NaN: no target."""
        return (
            self.bumper.read(frame, yaw_error, kappa),
            self.roof.read(frame, yaw_error, kappa),
        )

    def verify(self, frame: SensorFrame, distance: float, yaw_error: float, kappa: float) -> int:
        """Returns which pair's images bear out a target at `distance` m (A-065).

        The bumper is asked first, the roof without its minimum depth (D-009).
        """
        near, far = verified_depths(distance)
        for by, pair in ((BY_BUMPER, self.bumper), (BY_ROOF, self.roof)):
            if pair.read_between(near, far, frame, yaw_error, kappa) > 0.0:
                return by
        return BY_NONE


@kernel
def verify_runs(
    bumper: Segments,
    roof: Segments,
    keep: tuple[Corridor, Corridor],
    distance: float,
    turn: float,
    kappa: float,
    room: Floats,
) -> int:
    """Returns what `Cameras.verify` does, by runs of pixels; keep: corridors of bumper and roof.

    turn: sine of the yaw error.
    """
    near, far = verified_depths(distance)
    if read_segments(bumper, keep[0], near, far, PERCENTILE, turn, kappa, room) > 0.0:
        return BY_BUMPER
    if read_segments(roof, keep[1], near, far, PERCENTILE, turn, kappa, room) > 0.0:
        return BY_ROOF
    return BY_NONE


@kernel
def look_ahead(
    m: Record,
    fusion: FusionRules,
    detection: DetectionRules,
    radar: RadarRules,
    samples: Floats,
    history: Floats,
    kept: NDArray[np.int64],
    bumper: float,
    roof: float,
    points: RadarPoints,
    place: Place,
    a: LaneArrays,
    on_highway: NDArray[np.bool_],
    ways: Floats,
) -> None:
    """Notes what this tick shows ahead; call it once per tick, as filters and memory move on.

    bumper, roof: m; samples, history, kept, ways: as `AdasStack` has them.
    """
    fused = fuse(fusion, bumper, roof)
    tracking = is_confirmed(m, detection)
    reading = read_radar(m, radar, points, kept, tracking, place, a, on_highway, ways)
    push(samples, limit_rate(m, fusion, history, fused) if fusion.limits_rate else fused)
    found = detect(m, detection, median(samples), bumper, reading)
    m.status, m.distance = found.status, found.distance
    m.bumper, m.roof, m.fused = bumper, roof, fused
    m.radar_pre, m.radar_lane, m.radar_velocity = reading.pre, reading.lane, reading.velocity
    m.radar_points = reading.points
