"""Settings of our own stack: the places where the sources contradict themselves (decision M-14)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from skidpad.core.settings.setting import SettingsPart, setting_field


class RoofCorridor(str, Enum):
    """D-015: width of the roof camera's corridor."""

    DEPTH_DEPENDENT = "depth_dependent"
    FLAT_WITHOUT_LCA = "flat_without_lca"


class RadarCloseCheck(str, Enum):
    """D-025: what a radar target nearer than 22 m needs."""

    BUMPER = "bumper"
    NOTHING = "nothing"


class RadarCandidates(str, Enum):
    """D-029: which radar points are matched with the map."""

    ALL = "all"
    NEAREST = "nearest"


class RadarCorridor(str, Enum):
    """A-084: how the radar tells the ego's lane."""

    LANE_MATCH = "lane_match"
    PARABOLA = "parabola"


class Targets(str, Enum):
    """D-011: what the cameras look for ahead."""

    ROAD_USERS = "road_users"  # and whatever else lies in the lane
    VEHICLES = "vehicles"  # car, truck and bus, as published


class CruiseLaw(str, Enum):
    """A-107, A-135: what holds the cruise speed."""

    STEADY = "steady"  # smooth pedals
    PUBLISHED = "published"  # the speed PID, whose derivative alternates full throttle and brake


class Unconfirmed(str, Enum):
    """D-044: tier 1 or 3 is entered but the detection is not confirmed yet."""

    FALL_THROUGH = "fall_through"
    CONSUME = "consume"


class LightBraking(str, Enum):
    """D-047: braking law at a red light without a lead."""

    SPEED_PID = "speed_pid"
    PROPORTIONAL = "proportional"


class CapScope(str, Enum):
    """D-051, D-053: where limiter and resume cap act."""

    GLOBAL = "global"
    CRUISE = "cruise"


class Lookahead(str, Enum):
    """D-054: look-ahead of lane centring."""

    DYNAMIC = "dynamic"
    FIXED = "fixed"


class BranchChoice(str, Enum):
    """D-058: which way lane centring takes."""

    HIGHWAY = "highway"
    FIRST_BRANCH = "first_branch"


class Follower(str, Enum):
    """What actuates the following of a lead (D-039)."""

    ZONES = "zones"
    DISTANCE_PID = "distance_pid"


class ResumeEnd(str, Enum):
    """A-177: what ends the resume cap."""

    TIME = "time"
    FIRST_CURVE = "first_curve"


@dataclass(frozen=True, slots=True, kw_only=True)
class StackSettings(SettingsPart):
    """What our own stack does; the defaults are the profile `recommended`."""

    roof_corridor: RoofCorridor = setting_field(
        RoofCorridor.DEPTH_DEPENDENT, "D-015", "width of the roof corridor"
    )
    bumper_alone: bool = setting_field(
        True, "D-017", "bumper reading counts at 15 to 30 m when the roof sees nothing"
    )
    detection_gate: float = setting_field(
        60.0, "D-020", "farthest fused distance that is a detection, m", low=1.0, high=80.0
    )
    safety_persist: bool = setting_field(
        False, "D-023", "hold a lost near lead for up to 5 s while following"
    )
    radar_close_check: RadarCloseCheck = setting_field(
        RadarCloseCheck.BUMPER, "D-025", "what a radar target below 22 m needs"
    )
    radar_candidates: RadarCandidates = setting_field(
        RadarCandidates.ALL, "D-029", "radar points that are matched with the map"
    )
    rejected_stays_active: bool = setting_field(
        False, "D-035", "a radar target off the lane still reports RADAR_ACTIVE"
    )
    aeb_without_acc: bool = setting_field(False, "D-038", "configuration 0 has emergency braking")
    targets: Targets = setting_field(
        Targets.ROAD_USERS, "D-011, R-5", "what the cameras look for ahead"
    )
    cruise: CruiseLaw = setting_field(CruiseLaw.STEADY, "A-135, R-5", "what holds the cruise speed")
    unconfirmed: Unconfirmed = setting_field(
        Unconfirmed.FALL_THROUGH, "D-044", "tiers 1 and 3 before confirmation"
    )
    light_braking: LightBraking = setting_field(
        LightBraking.SPEED_PID, "D-047", "braking law before a stop line"
    )
    cap_scope: CapScope = setting_field(
        CapScope.GLOBAL, "D-051, D-053", "where limiter and resume cap act"
    )
    lookahead: Lookahead = setting_field(Lookahead.DYNAMIC, "D-054", "look-ahead of the LCA")
    route: BranchChoice = setting_field(
        BranchChoice.HIGHWAY, "D-058", "highway isolation, straightest path"
    )
    # Options that the sources name but do not use; off unless asked for.
    radar: bool = setting_field(True, "A-038", "the radar takes part in detection")
    radar_corridor: RadarCorridor = setting_field(
        RadarCorridor.LANE_MATCH, "A-084", "how the radar tells the ego's lane"
    )
    consistency_guard: float | None = setting_field(
        None, "A-059", "tiers that differ by more, in m: the nearer counts", low=0.0, high=80.0
    )
    rate_filter: bool = setting_field(False, "A-062", "distance changes by <= 240 m/s")
    follower: Follower = setting_field(Follower.ZONES, "A-108", "what actuates following")
    hsv_required: bool = setting_field(False, "A-168", "the camera must confirm a red light")
    resume_end: ResumeEnd = setting_field(ResumeEnd.TIME, "A-177", "what ends the resume cap")
    lazy_lookahead: float = setting_field(
        8.0, "A-151", "look-ahead of the lazy driver, m", low=1.0, high=100.0
    )
    lazy_dead_band: float = setting_field(
        0.04, "A-151", "steer that the lazy driver ignores", low=0.0, high=1.0
    )
    lazy_gain: float = setting_field(
        0.45, "A-151", "share of steer the lazy driver applies", low=0.0, high=2.0
    )
    steer_smoothing: bool = setting_field(False, "A-152", "low-pass and rate limit on steer")
