"""Everything that looks ahead, joined: fusion, radar, persistence, verification."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from skidpad.core.frames import SensorFrame
from skidpad.core.run import Function
from skidpad.core.settings.stack import (
    RadarCandidates,
    RadarCorridor,
    RoofCorridor,
    StackSettings,
    Targets,
)
from skidpad.core.specs import SensorSpec
from skidpad.core.vocabulary import DetectionStatus
from skidpad.roads.queries import RoadMap
from skidpad.stack.configurations import Functions
from skidpad.stack.perception.corridor import ROAD_USERS, VEHICLES
from skidpad.stack.perception.fusion import (
    CameraPair,
    MedianFilter,
    RateFilter,
    Verification,
    bumper_corridor,
    camera_pair,
    fuse,
    roof_corridor,
)
from skidpad.stack.perception.lane_view import LaneView
from skidpad.stack.perception.persistence import Persistence
from skidpad.stack.perception.radar import (
    HALF_WIDTH,
    NO_RADAR,
    PARABOLA_HALF_WIDTH,
    AnyPoint,
    LaneMatch,
    Radar,
    RadarReading,
)

ROOF = ("depth_roof", "semantic_roof")
BUMPER = ("depth_bumper", "semantic_bumper")


class Sight(NamedTuple):
    """What lies ahead in one tick; distances in m, None: no target."""

    status: DetectionStatus
    distance: float | None  # the measured distance that counts
    confirmed: bool  # by vision, for long enough
    bumper: float | None
    roof: float | None
    fused: float | None  # before the median
    radar: RadarReading


class Front:
    """The forward perception of one vehicle."""

    def __init__(
        self,
        specs: Sequence[SensorSpec],
        map: RoadMap,
        functions: Functions,
        settings: StackSettings,
        dt: float,
    ) -> None:
        self.settings = settings
        bumper_depth, bumper_semantic = camera_pair(specs, *BUMPER)
        self.roof_depth, self.roof_semantic = camera_pair(specs, *ROOF)
        self.wanted = VEHICLES if settings.targets is Targets.VEHICLES else ROAD_USERS
        self.bumper = CameraPair(
            bumper_depth, bumper_semantic, bumper_corridor(bumper_semantic, self.wanted)
        )
        self.median = MedianFilter()
        self.rate = RateFilter(dt) if settings.rate_filter else None
        self.radar = _radar(map, settings) if settings.radar else None
        self.persistence = Persistence(
            dt,
            settings.detection_gate,
            settings.radar_close_check,
            settings.safety_persist,
            settings.rejected_stays_active,
        )
        self.switch(functions)

    def switch(self, functions: Functions) -> None:
        """Sets what perception evaluates for these driving functions: following, and the roof's corridor."""
        self.follows = Function.ACC in functions
        narrow = self.settings.roof_corridor is RoofCorridor.FLAT_WITHOUT_LCA
        flat = narrow and Function.LCA not in functions
        self.roof = CameraPair(
            self.roof_depth,
            self.roof_semantic,
            roof_corridor(self.roof_semantic, flat, self.wanted),
        )
        self.verification = Verification(self.bumper, self.roof)

    def reset(self) -> None:
        """Resets all filters, as after a relocation of the ego."""
        self.median.reset()
        self.persistence.reset()
        for part in (self.rate, self.radar):
            if part is not None:
                part.reset()

    def look(self, frame: SensorFrame, v: float, view: LaneView) -> Sight:
        """Returns what this frame shows; v in m/s. Call it once per tick: filters and memory move on."""
        s = self.settings
        bumper = self.bumper.read(frame, view.yaw_error, view.kappa)
        roof = self.roof.read(frame, view.yaw_error, view.kappa)
        fused = fuse(bumper, roof, s.bumper_alone, s.consistency_guard)
        steady = fused if self.rate is None else self.rate.update(fused)
        radar = NO_RADAR
        if self.radar is not None:
            tracking = self.persistence.is_confirmed
            radar = self.radar.update(frame.radar, frame.ego.pose, v, view, tracking)
        detection = self.persistence.update(self.median.update(steady), bumper, radar)
        return Sight(
            detection.status,
            detection.distance,
            self.persistence.is_confirmed,
            bumper,
            roof,
            fused,
            radar,
        )

    def conclude(self, sight: Sight, stopping: bool) -> None:
        """Passes the outcome of the tick on to the memory of detections.

        stopping: a light asks for a stop.
        """
        self.persistence.conclude(sight.distance is not None, self.follows, stopping)

    def verify(self, frame: SensorFrame, distance: float, view: LaneView) -> tuple[bool, str]:
        """Returns whether wanted pixels near `distance` m bear the target out, and by which camera pair."""
        return self.verification.confirm(frame, distance, view.yaw_error, view.kappa)


def _radar(map: RoadMap, settings: StackSettings) -> Radar:
    """Returns the radar evaluation for the corridor and the candidates that the settings choose."""
    nearest_only = settings.radar_candidates is RadarCandidates.NEAREST
    if settings.radar_corridor is RadarCorridor.PARABOLA:
        return Radar(AnyPoint(), PARABOLA_HALF_WIDTH, nearest_only)
    return Radar(LaneMatch(map), HALF_WIDTH, nearest_only)
