"""What lies ahead by map and radar: the lane, its bends, the lead, and how far leads are seen."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, hypot, inf, isnan, nan, pi, radians, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import Held, kernel
from skidpad.core.specs import RadarSpec
from skidpad.roads.along import advance_point
from skidpad.roads.kernels import LaneArrays, project_point
from skidpad.roads.queries import RoadMap

STEP, REACH = 5.0, 160.0  # m between places along the lane, and to the last one
HALF_LANE = 1.5  # m to either side in which a return counts as being in the lane
LEAST_HEIGHT, MOST_HEIGHT = 0.3, 3.0  # m above the road, else a return is road or bridge
HOLD = 1.0  # s for which a lead is held without a return
JOIN = 8.0  # m by which a new return may differ from the held lead
APPROACHED = 2.0  # m/s of closing speed, from which on a first return tells of the radar's reach
SEEN_PRIOR = 80.0  # m at which leads are expected to be seen first, before any was; our assumption
SEEN_SHARE, SEEN_LEAST, SEEN_KEPT = 0.2, 5, 20  # quantile of so many first distances, of the newest
FRONT = 1.9  # m from the reference point to the bumper


PLACES = round(REACH / STEP) + 1


@dataclass(frozen=True, slots=True)
class Way:
    """The lane ahead: (n,) distance, x, y, z, curvature along it; grade at the car, uphill > 0."""

    s: Floats
    x: Floats
    y: Floats
    z: Floats
    curvature: Floats
    grade: float


@kernel
def trace_way(
    map: Held[LaneArrays], x: float, y: float, z: float, yaw: float, out: Floats
) -> tuple[int, float]:
    """Writes the lane ahead of a pose every STEP m to (5, PLACES) s, x, y, z, curvature.

    Returns the number of places up to REACH m or the lane's end, 0 off every lane, and the grade at the car.
    """
    here = project_point(map.value, x, y, z, True)
    if here[0] < 0:
        return 0, 0.0
    n = 0
    place = here
    while True:
        out[0, n], out[1, n], out[2, n] = STEP * n, place[3], place[4]
        out[3, n], out[4, n] = place[5], place[7]
        n += 1
        if n == PLACES:
            break
        place = advance_point(map.value, here[0], here[1], n * STEP, yaw)
        if place[0] < 0:
            break
    return n, (out[3, 1] - out[3, 0]) / STEP if n > 1 else 0.0


def way_ahead(map: RoadMap, pose: Pose) -> Way | None:
    """Returns the lane ahead of a pose every STEP m, up to REACH m or its end; None off every lane."""
    out = np.empty((5, PLACES))
    n, grade = trace_way(map.held, pose.x, pose.y, pose.z, pose.yaw, out)
    return make_way(out, n, grade) if n else None


def make_way(out: Floats, n: int, grade: float) -> Way:
    """Returns n places that `trace_way` wrote."""
    s, x, y, z, curvature = out[:, :n]
    return Way(s, x, y, z, curvature, grade)


def locate_on(way: Way, x: Floats, y: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Returns (n,) the nearest place of the way and the m to its left of (n,) points of the world."""
    nearest = np.argmin(np.hypot(x[:, None] - way.x, y[:, None] - way.y), axis=1)
    k = np.minimum(nearest, len(way.s) - 2)
    heading = np.arctan2(way.y[k + 1] - way.y[k], way.x[k + 1] - way.x[k])
    return nearest, (y - way.y[k]) * np.cos(heading) - (x - way.x[k]) * np.sin(heading)


class Motion(NamedTuple):
    """Pose, speed and accelerations of the ego, as `feel_motion` has them."""

    x: float
    y: float
    z: float
    pitch: float
    yaw: float
    v: float
    yaw_rate: float
    ax: float
    ay: float
    wheels: tuple[float, float, float, float]


class SightRules(NamedTuple):
    """What holds for the sight of one stack."""

    has_radar: bool
    x: float  # m, mount of the radar ahead of the origin
    y: float  # m, to its left
    z: float  # m
    half_fov: float  # rad, to either side
    range: float  # m
    known: float  # m at which leads are seen first, for studies; NaN: it is found out
    dt: float  # s


SIGHT = np.dtype(
    [
        ("gap", np.float64),  # m from the bumper to the lead; NaN: there is none
        ("lead_speed", np.float64),  # m/s
        ("unseen", np.float64),  # s since its last return
        ("noted", np.int64),  # first distances, ever
        ("reach", np.float64),  # m, distance of first sight
    ],
    align=True,
)


class SightArrays(NamedTuple):
    """What is remembered of leads, for kernels."""

    memory: NDArray[np.void]  # (1,) SIGHT
    first: Floats  # (SEEN_KEPT,) m, the newest first distances, as a ring
    sorted: Floats  # (SEEN_KEPT,) room
    way: Floats  # (5, PLACES) room: the lane ahead, as `trace_way`


def sight_rules(radar: RadarSpec | None, dt: float, known: float | None = None) -> SightRules:
    """Returns the rules of a radar; known: m at which leads are seen first, for studies."""
    reach = nan if known is None else known
    if radar is None:
        return SightRules(False, 0.0, 0.0, 0.0, 0.0, 0.0, reach, dt)
    mount, half = radar.mount, radians(radar.horizontal_fov_deg / 2.0)
    return SightRules(True, mount.x, mount.y, mount.z, half, radar.range, reach, dt)


def new_sight(rules: SightRules) -> SightArrays:
    """Returns what is remembered before anything was seen."""
    memory = np.zeros(1, SIGHT)
    memory["gap"], memory["unseen"] = nan, inf
    memory["reach"] = SEEN_PRIOR if isnan(rules.known) else rules.known
    return SightArrays(memory, np.zeros(SEEN_KEPT), np.zeros(SEEN_KEPT), np.zeros((5, PLACES)))


@kernel
def lose_lead(arrays: SightArrays) -> None:
    """Forgets the lead of another place; the distances of first sight are kept."""
    arrays.memory[0].gap, arrays.memory[0].unseen = nan, inf


@kernel
def look_for_lead(
    arrays: SightArrays, r: SightRules, points: RadarPoints, n: int, ego: Motion
) -> bool:
    """Notes the lead of this tick and returns whether there is one; call it once per tick.

    n: places of the way ahead. A lead without a return is carried on for HOLD s. A return JOIN m or more
    beyond a held lead does not replace it. First distances of leads that come nearer are noted for the
    reach.
    """
    m, v = arrays.memory[0], max(ego.v, 0.0)
    gap, speed = find_lead(arrays.way, r, points, n, ego, v)
    m.unseen += r.dt
    is_held = not isnan(m.gap) and m.unseen <= HOLD
    m.gap = max(m.gap + (m.lead_speed - v) * r.dt, 0.0) if is_held else nan
    if isnan(gap):
        return is_held
    if not is_held and v - speed > APPROACHED:
        note_first(arrays, r, gap)
    if not is_held or gap < m.gap + JOIN:
        m.gap, m.lead_speed, m.unseen = gap, speed, 0.0
    return True


@kernel
def find_lead(
    way: Floats, r: SightRules, points: RadarPoints, n: int, ego: Motion, v: float
) -> tuple[float, float]:
    """Returns gap in m and speed in m/s, not below 0, of the nearest radar point in the lane; NaN: none.

    v: m/s of the ego, not below 0.
    """
    gap, speed, nearest = nan, nan, inf
    if not r.has_radar or n < 2:
        return gap, speed
    c, s, climb = cos(ego.yaw), sin(ego.yaw), sin(ego.pitch)
    for i in range(len(points.range)):
        distance, azimuth = float(points.range[i]), float(points.azimuth[i])
        altitude = float(points.altitude[i])
        flat = distance * cos(altitude)
        ahead, left = r.x + flat * cos(azimuth), r.y + flat * sin(azimuth)
        if ahead <= FRONT or flat >= nearest:
            continue
        place, across = find_place(
            way, n, ego.x + c * ahead - s * left, ego.y + s * ahead + c * left
        )
        above = ego.z + r.z + distance * sin(altitude) - ahead * climb - way[3, place]
        if abs(across) < HALF_LANE and LEAST_HEIGHT < above < MOST_HEIGHT:
            nearest, gap = flat, max(ahead - FRONT, 0.0)
            speed = max(v + float(points.velocity[i]) / max(cos(azimuth), 0.1), 0.0)
    return gap, speed


@kernel
def find_place(way: Floats, n: int, x: float, y: float) -> tuple[int, float]:
    """Returns the nearest of n >= 2 places of the way and the m to its left of a point of the world."""
    best, least = 0, inf
    for i in range(n):
        dx, dy = x - way[1, i], y - way[2, i]
        d2 = dx * dx + dy * dy
        if d2 < least:
            best, least = i, d2
    k = min(best, n - 2)
    dx, dy = way[1, k + 1] - way[1, k], way[2, k + 1] - way[2, k]
    length = hypot(dx, dy)
    across = ((y - way[2, k]) * dx - (x - way[1, k]) * dy) / length if length > 0.0 else inf
    return best, across


@kernel
def note_first(arrays: SightArrays, r: SightRules, gap: float) -> None:
    """Notes at how many m a lead was seen first, and what follows for the reach.

    That is `known`, else the SEEN_SHARE quantile of the newest: SEEN_PRIOR before SEEN_LEAST were noted, and
    half of it at least.
    """
    m = arrays.memory[0]
    arrays.first[m.noted % SEEN_KEPT] = gap
    m.noted += 1
    n = min(m.noted, SEEN_KEPT)
    if not isnan(r.known) or n < SEEN_LEAST:
        return
    for i in range(n):  # by insertion
        value, k = arrays.first[i], i
        while k > 0 and arrays.sorted[k - 1] > value:
            arrays.sorted[k] = arrays.sorted[k - 1]
            k -= 1
        arrays.sorted[k] = value
    at = SEEN_SHARE * (n - 1)
    low = int(at)
    a, b = arrays.sorted[low], arrays.sorted[min(low + 1, n - 1)]
    m.reach = max(a + (at - low) * (b - a), SEEN_PRIOR / 2.0)


@kernel
def clear_way(way: Floats, r: SightRules, n: int, x: float, y: float, yaw: float) -> float:
    """Returns the m of n places ahead that lie in the radar's field of view; SEEN_PRIOR without a radar."""
    if not r.has_radar:
        return SEEN_PRIOR
    for i in range(n):
        if way[0, i] <= 15.0:
            continue
        bearing = atan2(way[2, i] - y, way[1, i] - x) - yaw
        if abs((bearing + pi) % (2.0 * pi) - pi) > r.half_fov:
            return float(min(way[0, i], r.range))
    return r.range
