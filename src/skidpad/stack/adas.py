"""The published driver: dual-range vision, radar, seven tiers, lane centring (A-010)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

from skidpad.core.errors import require_choice, require_range
from skidpad.core.frames import SensorFrame
from skidpad.core.geometry import kmh_from_mps
from skidpad.core.run import Function
from skidpad.core.settings.parts import load_profile
from skidpad.core.settings.stack import BranchChoice, CapScope, ResumeEnd, StackSettings
from skidpad.core.setup import DT
from skidpad.core.specs import SensorSpec
from skidpad.core.states import StackReport, VehicleCommand
from skidpad.core.vocabulary import DetectionStatus, LightState, Supervision, Tier
from skidpad.roads.queries import RoadMap
from skidpad.stack.configurations import (
    CRUISE_RANGE,
    V_CRUISE_KMH,
    V_LIMITER_KMH,
    Functions,
    functions_of,
    parse_functions,
)
from skidpad.stack.control.bends import BendSpeed, slow_for_bend
from skidpad.stack.control.steering import NoSmoothing, Smoothing, steering_of
from skidpad.stack.control.text import mode_text
from skidpad.stack.control.tiers import (
    Hierarchy,
    Lead,
    Request,
    Situation,
    needs_verification,
    time_gap,
)
from skidpad.stack.functions import AddedFunctions
from skidpad.stack.perception.front import Front, Sight
from skidpad.stack.perception.hsv import LampCamera
from skidpad.stack.perception.lane_view import (
    FirstBranchRoute,
    HighwayRoute,
    LaneTracker,
    LaneView,
)
from skidpad.stack.perception.lights import NO_LIGHT, LightReading, LightScan, StopLock
from skidpad.stack.timing import ticks_to_reach

STOPPED_BELOW_KMH = 5.0  # km/h
RESUME_DURATION = 15.0  # s
RESUME_KMH = 80.0  # km/h
CURVE = 1.0 / 500.0  # 1/m, sharper is a curve (A-177; ours, the source gives no figure)
HELD = VehicleCommand(brake=1.0)  # while the supervisor drives; it overrides this anyway
KEYS = ("configuration", "functions", "profile", "set", "cruise_kmh", "limiter_kmh", "dt")


@dataclass(frozen=True, slots=True, kw_only=True)
class AdasConfig:
    """What this stack drives with; speeds in km/h as at a cruise control's lever."""

    functions: Functions
    added: tuple[str, ...] = ()  # functions of packages
    settings: StackSettings
    cruise_kmh: float = V_CRUISE_KMH
    limiter_kmh: float = V_LIMITER_KMH
    dt: float = DT

    def __post_init__(self) -> None:
        require_range("cruise_kmh", self.cruise_kmh, *CRUISE_RANGE)
        require_range("limiter_kmh", self.limiter_kmh, *CRUISE_RANGE)
        require_range("dt", self.dt, 1e-3, 1.0)

    @classmethod
    def from_mapping(cls, plain: Mapping[str, Any]) -> AdasConfig:
        """Returns a configuration from plain data; every key is optional, see KEYS.

        `functions` (names) takes the place of `configuration` (0 to 4, default 4); `set` holds
        single settings on top of `profile`. ConfigError for an unknown key or name, or a number out of range.
        """
        for key in plain:
            require_choice("stack option", key, KEYS)
        settings = load_profile(plain.get("profile", "recommended"), plain.get("set")).stack
        added: tuple[str, ...] = ()
        if "functions" in plain:
            functions, added = parse_functions(",".join(plain["functions"]))
        else:
            functions = functions_of(plain.get("configuration", 4))
        if settings.aeb_without_acc and not functions & {Function.ACC}:
            functions |= {Function.AEB}
        numbers = {k: float(plain[k]) for k in ("cruise_kmh", "limiter_kmh", "dt") if k in plain}
        return cls(functions=functions, added=added, settings=settings, **numbers)


class AdasStack:
    """One vehicle's driver. Deterministic: its commands depend on the frames alone."""

    report: StackReport

    def __init__(
        self, specs: Sequence[SensorSpec], map: RoadMap, settings: Mapping[str, Any]
    ) -> None:
        self.config = AdasConfig.from_mapping(settings)
        options = self.config.settings
        route = HighwayRoute() if options.route is BranchChoice.HIGHWAY else FirstBranchRoute()
        self.tracker = LaneTracker(map, route)
        self.front = Front(specs, map, self.config.functions, options, self.config.dt)
        self.scan = LightScan(map)
        self.lamps = LampCamera(specs)
        self.lock = StopLock(self.config.dt, options.hsv_required)
        self.resume = ResumeProtocol(self.config.dt, options.resume_end)
        self.smoothing: Smoothing | NoSmoothing = (
            Smoothing(self.config.dt) if options.steer_smoothing else NoSmoothing()
        )
        self.added = AddedFunctions(self.config.added, map, self.config.dt)
        self.supervision = Supervision.NONE
        self.verified_by = ""
        self.v_told = inf
        self.report = StackReport()
        self.switch(self.config.functions)

    @property
    def mode(self) -> str:
        """The mode of the last tick as text for people (A-139), with those of added functions."""
        own = mode_text(self.report, Function.LCA in self.functions, self.verified_by)
        return own + self.added.mode

    def sensors(self) -> tuple[SensorSpec, ...]:
        """Returns the sensors that added functions ask for; the stack itself needs the common ones."""
        return self.added.sensors()

    def switch(self, functions: Functions) -> None:
        """Turns functions on and off while driving (A-011); tiers and controllers start afresh.

        functions: all that are on from now on. Added functions of packages are not touched.
        """
        c = self.config
        self.functions, self.assists = functions, Function.TLA in functions
        self.hierarchy = Hierarchy(functions, c.settings, c.dt)
        self.steering = steering_of(functions, c.settings)
        self.caps = SpeedCaps(functions, c.cruise_kmh, c.limiter_kmh, c.settings.cap_scope)
        self.bends = BendSpeed(c.dt) if Function.BEND in functions else None
        self.front.switch(functions)

    def limit_speed(self, v: float) -> None:
        """Cruises no faster than v m/s until told otherwise: whatever governs this stack says so."""
        self.v_told = v

    def relocated(self) -> None:
        """Forgets what was seen and summed before, as the ego now stands elsewhere (A-109)."""
        self.front.reset()
        self.hierarchy.reset()
        self.lock.reset()
        self.smoothing.reset()
        self.added.reset()
        if self.bends is not None:
            self.bends.reset()

    def tick(self, frame: SensorFrame) -> VehicleCommand:
        """Senses, decides and returns the command of one tick (A-010).

        HELD, and no decision, while a supervisor drives. `report` is renewed either way.
        """
        self._follow_supervision(frame.supervision)
        v = frame.ego.speed
        view = self.tracker.update(frame.ego.pose)
        sight = self.front.look(frame, v, view)
        light, hsv = self._light(frame, v, view)
        stop = self.lock.update(light, v, frame.lights, hsv) if self.assists else None
        stop_distance = stop.distance if stop is not None else None
        lane_curvature = view.ego.curvature if view.ego is not None else 0.0
        self.resume.update(stop is not None, kmh_from_mps(v), lane_curvature)
        v_bends = self._speed_for_bends(frame, v, view)
        situation, sight = self._situation(frame, v, v_bends, view, sight, stop_distance)
        supervised = frame.supervision is not Supervision.NONE
        request = Request(Tier.NONE)
        if not supervised:
            request = slow_for_bend(self.hierarchy.decide(situation), v, v_bends)
        self.front.conclude(sight, stop is not None)
        self.report = self._report(view, sight, situation, request.tier, light, hsv)
        if supervised:
            return HELD
        command = VehicleCommand(request.throttle, request.brake, self._steer(frame, v, view),
                                 request.handbrake)  # fmt: skip
        return self.added.update(frame, command)

    def _follow_supervision(self, phase: Supervision) -> None:
        """Notes which supervisor drives; forgets the old place where a warm-up begins (A-185)."""
        if phase is Supervision.WARM_UP and self.supervision is not Supervision.WARM_UP:
            self.relocated()
        self.supervision = phase

    def _light(
        self, frame: SensorFrame, v: float, view: LaneView
    ) -> tuple[LightReading, LightState | None]:
        """Returns the light ahead by map, and the colour that the camera sees while there is one (M-4).

        NO_LIGHT and None without the assist; None, too, where no lamp is seen.
        """
        if not self.assists:
            return NO_LIGHT, None
        light = self.scan.look(frame.ego.pose, v, view, frame.lights)
        if light.signal is None:
            return light, None
        return light, self.lamps.look(frame.images)

    def _speed_for_bends(self, frame: SensorFrame, v: float, view: LaneView) -> float:
        """Returns the m/s that bends ahead allow; inf without the function."""
        if self.bends is None:
            return inf

        def curvature(distance: float) -> float:
            place = self.tracker.ahead(view, distance, frame.ego.pose.yaw)
            return 0.0 if place is None else place.curvature

        return self.bends.update(v, curvature)

    def _situation(
        self,
        frame: SensorFrame,
        v: float,
        v_bends: float,
        view: LaneView,
        sight: Sight,
        stop_distance: float | None,
    ) -> tuple[Situation, Sight]:
        """Returns what the tiers see, and the sight; a target not confirmed at standstill is in neither.

        It is dropped before them, so that all tiers go on without it (A-116, D-043).
        """
        active, self.verified_by = self.resume.active, ""
        told_kmh = kmh_from_mps(self.v_told)
        s = Situation(
            v=v,
            v_kmh=kmh_from_mps(v),
            lead=_lead(sight, v),
            stop_distance=stop_distance,
            cruise_kmh=min(self.caps.cruise_kmh(active), kmh_from_mps(v_bends), told_kmh),
            follow_cap_kmh=min(self.caps.following_kmh(active), told_kmh),
        )
        if sight.distance is None or not (self.hierarchy.brakes and needs_verification(s)):
            return s, sight
        confirmed, self.verified_by = self.front.verify(frame, sight.distance, view)
        if confirmed:
            return s, sight
        return s._replace(lead=None), sight._replace(distance=None)

    def _steer(self, frame: SensorFrame, v: float, view: LaneView) -> float:
        """Returns the smoothed steering command in -1..1 that follows the lane at v in m/s."""
        command = self.steering.steer(
            frame.ego.pose, v, lambda d, heading: self.tracker.ahead(view, d, heading)
        )
        return self.smoothing.update(command)

    def _report(
        self,
        view: LaneView,
        sight: Sight,
        s: Situation,
        tier: Tier,
        light: LightReading,
        hsv: LightState | None,
    ) -> StackReport:
        """Returns the report of this tick: detections, tier, target speed, light and lane."""
        radar = sight.radar
        return StackReport(
            status=sight.status,
            tier=tier,
            detected=sight.distance is not None,
            distance=sight.distance,
            time_gap=s.lead.gap if s.lead is not None else None,
            bumper=sight.bumper,
            roof=sight.roof,
            fused=sight.fused,
            radar_pre=radar.pre,
            radar_lane=radar.lane,
            radar_velocity=radar.velocity,
            radar_points=radar.points,
            v_target=s.cruise_kmh / 3.6,
            light_distance=light.distance,
            light_state=light.state,
            light_source=light.source if self.assists else None,
            light_stop=s.stop_distance is not None,
            hsv=hsv,
            lane_offset=view.ego.offset if view.ego is not None else None,
            yaw_error=view.yaw_error if view.ego is not None else None,
            curvature=view.curvature if view.ego is not None else None,
            resume_timer=self.resume.timer,
        )


def _lead(sight: Sight, v: float) -> Lead | None:
    """Returns the lead with its distance in m and time gap in s; None where nothing is detected."""
    if sight.distance is None:
        return None
    confirmed = sight.confirmed or sight.status is DetectionStatus.RADAR_ACTIVE
    return Lead(sight.distance, time_gap(sight.distance, v), confirmed)


# Speed caps: the limiter and the cap after a stop at a light.


class ResumeProtocol:
    """Counts from the last stop at a light; its end is a time, or the end of the first curve."""

    def __init__(self, dt: float, end: ResumeEnd) -> None:
        self.dt, self.end = dt, end
        self.duration = ticks_to_reach(RESUME_DURATION, dt)
        self.reset()

    def reset(self) -> None:
        """Resets the protocol to no stop and no curve."""
        self.ticks: int | None = None
        self.in_curve = self.past_curve = False

    @property
    def timer(self) -> float | None:
        """Seconds since the last tick at a stop; None: no stop yet, and none after `reset`."""
        return None if self.ticks is None else self.ticks * self.dt

    @property
    def active(self) -> bool:
        """Whether the cap after a stop holds, for a time or until the first curve ends (A-174, A-176)."""
        if self.ticks is None:
            return False
        if self.ticks < self.duration:
            return True
        return self.end is ResumeEnd.FIRST_CURVE and not self.past_curve

    def update(self, stop_requested: bool, v_kmh: float, curvature: float) -> None:
        """Takes in one tick; the count starts anew in each at a requested stop below STOPPED_BELOW_KMH.

        curvature: of the ego's lane in 1/m.
        """
        if stop_requested and v_kmh < STOPPED_BELOW_KMH:
            self.ticks, self.in_curve, self.past_curve = 0, False, False
        elif self.ticks is not None:
            self.ticks += 1
            bends = abs(curvature) > CURVE
            self.past_curve = self.past_curve or (self.in_curve and not bends)
            self.in_curve = bends


class SpeedCaps:
    """The speeds in km/h that cruise aims at and that following may not accelerate beyond."""

    def __init__(
        self, functions: Functions, v_cruise_kmh: float, v_limiter_kmh: float, scope: CapScope
    ) -> None:
        self.limiter = v_limiter_kmh if Function.LIMITER in functions else inf
        self.v_cruise_kmh = min(v_cruise_kmh, self.limiter)
        self.resumes = {Function.TLA, Function.RESUME} <= functions
        self.scope = scope

    def _resume(self, resume_active: bool) -> float:
        """Returns the speed cap in km/h while resuming; inf where there is none."""
        return RESUME_KMH if self.resumes and resume_active else inf

    def cruise_kmh(self, resume_active: bool) -> float:
        """Returns the target in km/h of cruise without a lead (A-135, A-174)."""
        return min(self.v_cruise_kmh, self._resume(resume_active))

    def following_kmh(self, resume_active: bool) -> float:
        """Returns the km/h above which following gives no throttle; inf: no cap (A-129, A-178)."""
        if self.scope is CapScope.CRUISE:
            return inf
        return min(self.limiter, self._resume(resume_active))
