"""One tick of perception and control as a kernel: from distances and radar points to pedals."""

from __future__ import annotations

from math import isnan, nan, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats, Floats32
from skidpad.core.frames import RadarPoints, Segments
from skidpad.core.kernels.jit import Held, kernel
from skidpad.roads.kernels import LaneArrays
from skidpad.stack.control.bends import slow_for_bend
from skidpad.stack.control.caps import CapRules, caps_kmh, count_resume
from skidpad.stack.control.tiers import (
    NO_ACTION,
    Situation,
    TierRules,
    begin_tiers,
    decide,
    needs_verification,
    time_gap,
)
from skidpad.stack.memory import KMH, Memory
from skidpad.stack.perception.corridor import Corridor, read_segments
from skidpad.stack.perception.front import BY_NONE, look_ahead, verify_runs
from skidpad.stack.perception.fusion import NOTHING, PERCENTILE, FusionRules
from skidpad.stack.perception.lane_view import Place
from skidpad.stack.perception.lights import Way
from skidpad.stack.perception.persistence import (
    RADAR_ACTIVE,
    DetectionRules,
    conclude,
    forget_detections,
    is_confirmed,
)
from skidpad.stack.perception.radar import RadarRules, forget_radar


class Rules(NamedTuple):
    """All that a stack's settings and functions decide, as kernels take it."""

    tiers: TierRules
    caps: CapRules
    fusion: FusionRules
    detection: DetectionRules
    radar: RadarRules
    keep: tuple[Corridor, Corridor]  # of bumper and roof


class Parts(NamedTuple):
    """What a stack reads: behind one pointer, as each costs a kernel's call 0.3 us."""

    rules: Rules
    lanes: LaneArrays


# Tier, throttle, brake, handbrake, index of VERIFIED_BY, cruise target in km/h, DetectionStatus,
# distance, time gap, then what bumper, roof, both, and radar saw (nearest, in the lane, range rate,
# number of points), ticks since a stop (-1: none yet). NaN: none. A named tuple would cost twice as much.
Answer = tuple[
    int, float, float, bool, int, float, int, float, float, float, float, float, float, float,
    float, int, int,
]  # fmt: skip
Light = tuple[int, int, float, float]


@kernel
def hold_rules(rules: Rules, map: Held[LaneArrays]) -> Held[Parts]:
    """Returns rules and map behind one pointer."""
    return Held(Parts(rules, map.value))


@kernel
def forget_sight(memory: Memory, samples: Floats, history: Floats) -> None:
    """Resets filters, radar and the memory of detections to no target, and the smoothed steer."""
    m = memory[0]
    forget_detections(m)
    forget_radar(m)
    m.smoothed, m.steer = NOTHING, 0.0
    samples.fill(NOTHING)
    history.fill(NOTHING)


@kernel
def forget_tiers(memory: Memory, parts: Held[Parts]) -> None:
    """Resets what the tiers remember."""
    begin_tiers(memory[0], parts.value.rules.tiers)


@kernel
def perceive(
    memory: Memory, parts: Held[Parts], samples: Floats, history: Floats, kept: NDArray[np.int64],
    ways: Floats, bumper: float, roof: float, points: RadarPoints,
    on_highway: NDArray[np.bool_], x: float, y: float, z: float, yaw: float, v: float,
) -> bool:  # fmt: skip
    """Notes what two distances in m and the radar show; returns whether the target must be verified.

    x, y, z, yaw, v: of the ego, in the world frame.
    """
    m, r = memory[0], parts.value.rules
    place = Place(x, y, z, yaw, v, m.lane, m.s, m.yaw_error, m.kappa)
    look_ahead(
        m, r.fusion, r.detection, r.radar, samples, history, kept, bumper, roof, points, place,
        parts.value.lanes, on_highway, ways,
    )  # fmt: skip
    return bool(needs_verification(r.tiers, m.distance, v * KMH))


@kernel
def act(
    memory: Memory, parts: Held[Parts], verified_by: int, v: float, drives: bool,
    stop_distance: float, v_bends: float, v_told: float,
) -> Answer:  # fmt: skip
    """Returns the answer to what was noted ahead.

    A target that no camera bears out is dropped before the tiers, so that all go on without it (A-116,
    D-043). drives: no supervisor does; stop_distance: m, NaN: no stop; v_bends, v_told: m/s that bends
    and others allow, inf: any.
    """
    m, r = memory[0], parts.value.rules
    v_kmh, stopping = v * KMH, not isnan(stop_distance)
    count_resume(m, stopping, v_kmh, m.bend)
    cruise_kmh, follow_kmh = caps_kmh(m, r.caps)
    cruise_kmh = min(cruise_kmh, v_bends * KMH, v_told * KMH)
    if verified_by == BY_NONE:
        m.distance = nan
    confirmed = is_confirmed(m, r.detection) or m.status == RADAR_ACTIVE
    gap = time_gap(m.distance, v)
    request = NO_ACTION
    if drives:
        situation = Situation(
            v, v_kmh, m.distance, gap, confirmed, stop_distance, cruise_kmh,
            min(follow_kmh, v_told * KMH),
        )  # fmt: skip
        request = slow_for_bend(decide(m, r.tiers, situation), v, v_bends)
    conclude(m, r.detection, not isnan(m.distance), r.tiers.follows, stopping)
    return (
        request.tier, request.throttle, request.brake, request.handbrake, verified_by, cruise_kmh,
        m.status, m.distance, gap, m.bumper, m.roof, m.fused, m.radar_pre, m.radar_lane,
        m.radar_velocity, m.radar_points, m.resume_ticks,
    )  # fmt: skip


@kernel
def think(
    memory: Memory, parts: Held[Parts], samples: Floats, history: Floats, kept: NDArray[np.int64],
    ways: Floats, room: Floats,
    bumper_u: Floats32, bumper_width: Floats32, bumper_top: Floats32, bumper_bottom: Floats32,
    bumper_depth: Floats32, bumper_label: NDArray[np.uint8],
    roof_u: Floats32, roof_width: Floats32, roof_top: Floats32, roof_bottom: Floats32,
    roof_depth: Floats32, roof_label: NDArray[np.uint8],
    radar_range: Floats32, azimuth: Floats32, altitude: Floats32, velocity: Floats32,
    on_highway: NDArray[np.bool_],
    x: float, y: float, z: float, yaw: float, v: float, drives: bool, stop_distance: float,
    v_bends: float, v_told: float,
) -> Answer:  # fmt: skip
    """Returns what `act` does, from what the sensors of the object level see.

    Arrays cross into a kernel one by one, as a named tuple of them takes twice as long.
    """
    m, r = memory[0], parts.value.rules
    bumper = Segments(bumper_u, bumper_width, bumper_top, bumper_bottom, bumper_depth, bumper_label)
    roof = Segments(roof_u, roof_width, roof_top, roof_bottom, roof_depth, roof_label)
    near, far = r.keep
    turn = sin(m.yaw_error)
    asks = perceive(
        memory, parts, samples, history, kept, ways,
        read_segments(bumper, near, near.near, near.far, PERCENTILE, turn, m.kappa, room),
        read_segments(roof, far, far.near, far.far, PERCENTILE, turn, m.kappa, room),
        RadarPoints(radar_range, azimuth, altitude, velocity), on_highway, x, y, z, yaw, v,
    )  # fmt: skip
    by = verify_runs(bumper, roof, r.keep, m.distance, turn, m.kappa, room) if asks else 0
    return act(memory, parts, by, v, drives, stop_distance, v_bends, v_told)


@kernel
def write_report(
    row: Floats, at: int, told: Answer, way: Way, light: Light, assists: bool, dt: float
) -> None:
    """Writes what the stack says of a tick as numbers in the order of `StackReport`; NaN: none.

    at: where in the row it begins; told, way: of `think` and `read_road`; light: source, state (-1:
    none), m, and m to a stop. As `AdasStack.report` has it where no lamp is seen.
    """
    source, state, there, stop = light
    row[at], row[at + 1], row[at + 2] = told[6], told[0], 0.0 if isnan(told[7]) else 1.0
    row[at + 3], row[at + 4] = or_nan(told[7]), or_nan(told[8])
    row[at + 5], row[at + 6], row[at + 7] = or_nan(told[9]), or_nan(told[10]), or_nan(told[11])
    row[at + 8], row[at + 9], row[at + 10] = or_nan(told[12]), or_nan(told[13]), or_nan(told[14])
    row[at + 11], row[at + 12], row[at + 13] = told[15], told[5] / KMH, or_nan(there)
    row[at + 14] = state if state >= 0 else nan
    row[at + 15] = source if assists else nan
    row[at + 16], row[at + 17] = 0.0 if isnan(stop) else 1.0, nan
    row[at + 18], row[at + 19], row[at + 20] = or_nan(way[1]), or_nan(way[2]), or_nan(way[3])
    row[at + 21] = told[16] * dt if told[16] >= 0 else nan


@kernel
def or_nan(value: float) -> float:
    """Returns a number, and for every NaN the same one."""
    return nan if isnan(value) else value
