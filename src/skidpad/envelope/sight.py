"""What lies ahead by map and radar: the lane, its bends, the lead, and how far leads are seen."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import cos, inf, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.frames import RadarPoints
from skidpad.core.geometry import Pose
from skidpad.core.specs import RadarSpec
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


@dataclass(frozen=True, slots=True)
class Way:
    """The lane ahead: (n,) distance, x, y, z, curvature along it; grade at the car, uphill > 0."""

    s: Floats
    x: Floats
    y: Floats
    z: Floats
    curvature: Floats
    grade: float


def way_ahead(map: RoadMap, pose: Pose) -> Way | None:
    """Returns the lane ahead of a pose every STEP m, up to REACH m or its end; None off every lane."""
    here = map.project(pose.x, pose.y, pose.z)
    if here is None:
        return None
    further = map.trace_ahead(here, STEP, round(REACH / STEP), pose.yaw)
    x, y, z, curvature = np.vstack(((here.x, here.y, here.z, here.curvature), further)).T
    s = STEP * np.arange(len(x), dtype=np.float64)
    grade = float((z[1] - z[0]) / STEP) if len(s) > 1 else 0.0
    return Way(s, x, y, z, curvature, grade)


def locate_on(way: Way, x: Floats, y: Floats) -> tuple[NDArray[np.intp], Floats]:
    """Returns (n,) the nearest place of the way and the m to its left of (n,) points of the world."""
    nearest = np.argmin(np.hypot(x[:, None] - way.x, y[:, None] - way.y), axis=1)
    k = np.minimum(nearest, len(way.s) - 2)
    heading = np.arctan2(way.y[k + 1] - way.y[k], way.x[k + 1] - way.x[k])
    return nearest, (y - way.y[k]) * np.cos(heading) - (x - way.x[k]) * np.sin(heading)


@dataclass(frozen=True, slots=True)
class Lead:
    """What drives ahead in the lane: gap from bumper to return in m, speed in m/s."""

    gap: float
    speed: float


class Sight:
    """Leads by the radar, and the distance at which they are seen.

    known: m at which they are seen first, for studies; None: it is found out.
    """

    def __init__(self, radar: RadarSpec | None, dt: float, known: float | None = None) -> None:
        self.radar, self.dt, self.known = radar, dt, known
        self.lead: Lead | None = None
        self.first_seen: deque[float] = deque(maxlen=SEEN_KEPT)
        self.unseen = inf  # s since the last return of the lead

    def reset(self) -> None:
        """Forgets the lead of another place; the distances of first sight are kept."""
        self.lead, self.unseen = None, inf

    def look(self, points: RadarPoints, pose: Pose, way: Way, v: float) -> Lead | None:
        """Returns the lead of this tick, None without one; call it once per tick. v: own speed in m/s.

        A lead without a return is carried on for HOLD s. A return JOIN m or more beyond a held lead does not
        replace it. First distances of leads that come nearer are noted for `reach`.
        """
        found = self._find(points, pose, way, v)
        held = self._carry_lead(v)
        if found is None:
            self.lead = held
        else:
            if held is None and v - found.speed > APPROACHED:
                self.first_seen.append(found.gap)
            near = held is None or found.gap < held.gap + JOIN
            self.lead = found if near else held
            self.unseen = 0.0 if near else self.unseen
        return self.lead

    @property
    def reach(self) -> float:
        """Distance in m at which leads are first seen: `known`, else the SEEN_SHARE quantile of those noted.

        SEEN_PRIOR before SEEN_LEAST were noted, and half of it at least.
        """
        if self.known is not None:
            return self.known
        if len(self.first_seen) < SEEN_LEAST:
            return SEEN_PRIOR
        return max(float(np.quantile(self.first_seen, SEEN_SHARE)), SEEN_PRIOR / 2.0)

    def clear_way(self, pose: Pose, way: Way) -> float:
        """Returns the m of lane ahead that lie in the radar's field of view; SEEN_PRIOR without a radar."""
        if self.radar is None:
            return SEEN_PRIOR
        bearing = np.arctan2(way.y - pose.y, way.x - pose.x) - pose.yaw
        bearing = np.abs((bearing + np.pi) % (2.0 * np.pi) - np.pi)
        outside = (bearing > np.radians(self.radar.horizontal_fov_deg / 2.0)) & (way.s > 15.0)
        seen = way.s[np.argmax(outside)] if outside.any() else self.radar.range
        return float(min(seen, self.radar.range))

    def _carry_lead(self, v: float) -> Lead | None:
        """Returns the last lead moved on by one step, whose time counts as unseen.

        None without a lead, or when it is unseen for more than HOLD s.
        """
        self.unseen += self.dt
        if self.lead is None or self.unseen > HOLD:
            return None
        gap = self.lead.gap + (self.lead.speed - v) * self.dt
        return Lead(max(gap, 0.0), self.lead.speed)

    def _find(self, points: RadarPoints, pose: Pose, way: Way, v: float) -> Lead | None:
        """Returns the lead at the nearest radar point in the lane, not slower than 0.

        None where there is none.
        """
        if self.radar is None or not len(points.range) or len(way.s) < 2:
            return None
        mount = self.radar.mount
        flat = points.range * np.cos(points.altitude)
        ahead = mount.x + flat * np.cos(points.azimuth)
        left = mount.y + flat * np.sin(points.azimuth)
        c, s = cos(pose.yaw), sin(pose.yaw)
        x, y = pose.x + c * ahead - s * left, pose.y + s * ahead + c * left
        height = pose.z + mount.z + points.range * np.sin(points.altitude) - ahead * sin(pose.pitch)
        nearest, across = locate_on(way, x, y)
        above = height - way.z[nearest]
        in_lane = (np.abs(across) < HALF_LANE) & (above > LEAST_HEIGHT) & (above < MOST_HEIGHT)
        in_lane &= ahead > FRONT
        if not in_lane.any():
            return None
        i = int(np.argmin(np.where(in_lane, flat, np.inf)))
        speed = v + float(points.velocity[i]) / max(cos(float(points.azimuth[i])), 0.1)
        return Lead(max(float(ahead[i]) - FRONT, 0.0), max(speed, 0.0))
