"""Parts of our stack for tests: each with a memory of its own, None for what kernels call NaN."""

from __future__ import annotations

from math import isnan, nan
from typing import NamedTuple

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.run import Function
from skidpad.core.settings.stack import StackSettings
from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.stack import memory, road
from skidpad.stack.control import bends, caps, pid, steering, tiers
from skidpad.stack.perception import corridor, front, fusion, lane_view, persistence, radar
from skidpad.stack.perception.lane_view import Place

time_gap = tiers.time_gap


def known(value: float) -> float | None:
    return None if isnan(value) else float(value)


def number(value: float | None) -> float:
    return nan if value is None else float(value)


class Pid:
    """A PID and its two sums."""

    def __init__(self, gains, dt):
        self.gains, self.dt = gains, dt
        self.reset()

    def reset(self):
        self.previous = self.integral = 0.0

    def update(self, error):
        u, self.integral = pid.regulate(
            self.gains, self.dt, self.previous, self.integral, float(error)
        )
        self.previous = error
        return u


class Lead(NamedTuple):
    distance: float
    gap: float
    confirmed: bool


class Request(NamedTuple):
    """A request with its tier as the word."""

    tier: Tier
    throttle: float = 0.0
    brake: float = 0.0
    handbrake: bool = False


def situation_of(v, v_kmh, lead, stop_distance, cruise_kmh, follow_cap_kmh):
    distance, gap, confirmed = (nan, nan, False) if lead is None else lead
    return tiers.Situation(
        float(v), float(v_kmh), float(distance), float(gap), bool(confirmed),
        number(stop_distance), float(cruise_kmh), float(follow_cap_kmh),
    )  # fmt: skip


def told(request):
    return Request(Tier(request[0]), *request[1:])


def zones(gap):
    return told(tiers.zones(float(gap)))


def slow_for_bend(request, v, v_allowed):
    plain = tiers.Request(int(request.tier), *request[1:])
    return told(bends.slow_for_bend(plain, float(v), float(v_allowed)))


class _Sums:
    """The sums of one PID in a memory."""

    def __init__(self, m, name, gains, dt):
        self.m, self.name, self.gains, self.dt = m, name, gains, dt

    @property
    def previous(self):
        return self.m[f"{self.name}_previous"]

    @property
    def integral(self):
        return self.m[f"{self.name}_integral"]

    def update(self, error):
        u, self.m[f"{self.name}_integral"] = pid.regulate(
            self.gains, self.dt, self.previous, self.integral, error
        )
        self.m[f"{self.name}_previous"] = error
        return u


class Hierarchy:
    """The tiers of some functions."""

    def __init__(self, functions, settings, dt):
        self.rules = tiers.tier_rules(functions, settings, dt)
        self.m = memory.new_memory()[0]
        tiers.begin_tiers(self.m, self.rules)
        self.speed_pid = _Sums(self.m, "speed", pid.SPEED_GAINS, dt)
        self.distance_pid = _Sums(self.m, "distance", pid.DISTANCE_GAINS, dt)

    def decide(self, s):
        return told(tiers.decide(self.m, self.rules, s))


class ResumeProtocol:
    """The count since a stop at a light, and the caps that it makes."""

    def __init__(self, dt, end, functions=frozenset()):
        settings = StackSettings(resume_end=end)
        self.m, self.dt = memory.new_memory()[0], dt
        self.rules = caps.cap_rules(functions, 150.0, 80.0, settings, dt)

    @property
    def timer(self):
        ticks = int(self.m["resume_ticks"])
        return None if ticks < 0 else ticks * self.dt

    @property
    def active(self):
        rules = self.rules._replace(resumes=True)
        return caps.caps_kmh(self.m, rules)[0] == caps.RESUME_KMH

    def update(self, stopping, v_kmh, curvature):
        caps.count_resume(self.m, stopping, float(v_kmh), float(curvature))


def speed_caps(functions, cruise_kmh, limiter_kmh, scope, resume_active):
    """The km/h of cruise and of following, with or without a stop just before."""
    m = memory.new_memory()[0]
    m["resume_ticks"] = 0 if resume_active else -1
    settings = StackSettings(cap_scope=scope)
    return caps.caps_kmh(m, caps.cap_rules(functions, cruise_kmh, limiter_kmh, settings, 0.05))


def fuse(bumper, roof, bumper_alone=True, guard=None):
    rules = fusion.fusion_rules(
        StackSettings(bumper_alone=bumper_alone, consistency_guard=guard), 0.05
    )
    return known(fusion.fuse(rules, number(bumper), number(roof)))


class MedianFilter:
    def __init__(self):
        self.reset()

    def reset(self):
        self.samples = fusion.far_samples(fusion.MEDIAN_SAMPLES)

    def update(self, distance):
        fusion.push(self.samples, number(distance))
        return known(fusion.median(self.samples))


class RateFilter:
    def __init__(self, dt):
        self.rules = fusion.fusion_rules(StackSettings(rate_filter=True), dt)
        self.history, self.m = fusion.rate_samples(dt), memory.new_memory()[0]
        self.m["smoothed"] = fusion.NOTHING

    @property
    def smoothed(self):
        return float(self.m["smoothed"])

    def update(self, distance):
        return known(fusion.limit_rate(self.m, self.rules, self.history, number(distance)))


def read_pair(pair, frame, yaw_error=0.0, kappa=0.0):
    """What a camera pair sees at either level."""
    segments = frame.segments.get(pair.depth_id)
    if segments is None:
        return known(pair.read(frame, yaw_error, kappa))
    keep = pair.keep
    return known(
        corridor.read_segments(
            segments,
            keep,
            keep.near,
            keep.far,
            fusion.PERCENTILE,
            np.sin(yaw_error),
            kappa,
            np.empty((len(segments.u), 2)),
        )
    )


def confirm(cameras, frame, distance):
    """Whether the cameras bear a target out, and which pair, at either level."""
    if frame.segments:
        pairs = cameras.bumper, cameras.roof
        by = front.verify_runs(
            *(frame.segments[pair.depth_id] for pair in pairs), tuple(p.keep for p in pairs),
            float(distance), 0.0, 0.0, np.empty((max(len(frame.segments[p.depth_id].u) for p in pairs), 2)),
        )  # fmt: skip
    else:
        by = cameras.verify(frame, float(distance), 0.0, 0.0)
    return by != front.BY_NONE, front.VERIFIED_BY[by]


class Detection(NamedTuple):
    status: DetectionStatus
    distance: float | None


class RadarReading(NamedTuple):
    pre: float | None
    lane: float | None
    velocity: float | None
    points: int


WAYS = np.empty((lane_view.WAYS, 4))
NO_RADAR = RadarReading(None, None, None, 0)


class Persistence:
    """Detections and their memory."""

    def __init__(self, dt, **settings):
        self.rules = persistence.detection_rules(StackSettings(**settings), dt)
        self.m = memory.new_memory()[0]
        persistence.forget_detections(self.m)

    def __getattr__(self, name):
        value = self.__dict__["m"][name].item()
        return known(value) if isinstance(value, float) else value

    def update(self, fused, bumper, reading):
        reading = radar.RadarReading(*(number(n) for n in reading[:3]), reading.points)
        found = persistence.detect(self.m, self.rules, number(fused), number(bumper), reading)
        return Detection(DetectionStatus(found.status), known(found.distance))

    def conclude(self, detected, acc_on, stopping):
        persistence.conclude(self.m, self.rules, detected, acc_on, stopping)


def place(x=0.0, y=0.0, z=0.0, yaw=0.0, v=0.0, lane=-1, s=0.0, yaw_error=0.0, kappa=0.0):
    """The ego on its lane."""
    return Place(
        float(x), float(y), float(z), float(yaw), float(v), int(lane), float(s), float(yaw_error),
        float(kappa),
    )  # fmt: skip


def place_of(pose, v, view):
    return place(
        pose.x, pose.y, pose.z, pose.yaw, v, view.lane, view.s, view.yaw_error, view.kappa
    )  # fmt: skip


class Lanes:
    """A map as a stack with lane centring reads it."""

    def __init__(self, map, first_branch=False, steering=None):
        functions = frozenset({Function.LCA})
        rules = road.road_rules(functions, StackSettings(), 0.05)._replace(
            first_branch=first_branch
        )
        if steering is not None:
            rules = rules._replace(steering=steering)
        self.road = road.Road(map, memory.new_memory(), rules)
        self.first_branch = first_branch

    def view(self, pose):
        """The ego against its lane."""
        self.steer(pose, 0.0)
        return lane_view.view_lane(
            self.road.map.arrays, self.road.on_highway, self.first_branch, WAYS,
            float(pose.x), float(pose.y), float(pose.z), float(pose.yaw),
        )  # fmt: skip

    def steer(self, pose, v):
        """The steer of a tick, v in m/s."""
        at = Pose(*map(float, (pose.x, pose.y, pose.z, pose.roll, pose.pitch, pose.yaw)))
        return self.road.read(at, float(v), True)[4]

    @property
    def on_highway(self):
        return self.road.on_highway


class Smoothing:
    """The steer command, smoothed."""

    def __init__(self, dt, smooths=True):
        settings = StackSettings(steer_smoothing=smooths)
        self.m = memory.new_memory()[0]
        self.rules = steering.steering_rules(frozenset(), settings, dt)

    def update(self, command):
        return steering.smooth(self.m, self.rules, float(command))


def read_radar(rules, points, at, map, on_highway, tracking=False, known_before=None):
    """One measurement of the radar, after those that left (memory, kept) where it is given."""
    whole, kept = known_before or (
        memory.new_memory(),
        np.empty(max(len(points.range), 1), np.int64),
    )
    found = radar.read_radar(
        whole[0], rules, points, kept, tracking, at, map.arrays, on_highway, WAYS
    )
    return RadarReading(*(known(n) for n in found[:3]), found.points)


def find_in_lane(map, on_highway, points, n, at):
    """The first of n points that is in the ego's lane, or -1."""
    return radar.first_in_lane(map.arrays, on_highway, points, np.arange(n), n, at, WAYS)
