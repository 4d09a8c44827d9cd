"""One drive, seen by its metrics: the log plus what the map adds, computed once."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Flags, Floats, Ints
from skidpad.core.vocabulary import ActorKind, Supervision
from skidpad.evidence.drive.lanematch import LaneIndex, LaneMatch
from skidpad.recording.run.log import RunLog
from skidpad.roads.queries import RoadMap

LEAD_RANGE = 80.0  # m, A-236


class LeadDefinition(str, Enum):
    """Which vehicle is the lead in truth (D-102 with D-103)."""

    AHEAD_ON_LANE = "ahead_on_lane"  # ahead, following the lane across road boundaries
    SAME_ROAD_AND_LANE = "same_road_and_lane"  # as printed: equal ids, ahead or behind


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricSettings:
    """Choices that the sources leave open."""

    lead: LeadDefinition = LeadDefinition.AHEAD_ON_LANE


class Leads(NamedTuple):
    """The vehicle in front of the ego in truth, arrays (T,); NaN and -1 where there is none."""

    actor: Ints
    distance: Floats  # m between positions
    gap: Floats  # m bumper to bumper along the lane, >= 0; NaN also where it is behind
    v_closing: Floats  # m/s along the lane, positive when closing
    overlap: Flags  # the two boxes overlap across the lane


class Pairs(NamedTuple):
    """The ego and a vehicle near it, arrays (m,): one entry per tick and vehicle."""

    row: Ints  # of the log
    actor: Ints
    ego: LaneMatch
    other: LaneMatch
    along: Floats  # m along the lane between positions, not finite where no lane leads there

    def where(self, chosen: Flags) -> Pairs:
        """Returns only the chosen pairs."""
        ego, other = self.ego.at(chosen), self.other.at(chosen)
        return Pairs(self.row[chosen], self.actor[chosen], ego, other, self.along[chosen])


@dataclass(frozen=True, slots=True)
class Drive:
    """What metrics are measured from: a log of T ticks, the ego on its lanes, and its leads.

    Attributes:
        log: States, commands and events of the run; row 0 of its actors is the ego; accelerations
            (`log.ego.ax`, `ay`) are m/s^2 forward and to the left.
        place: The lane that the ego is on in each tick, with s in m along and t in m across.
        lead: The true vehicle ahead: `gap` in m bumper to bumper, `v_closing` in m/s; NaN where
            there is none.
        v: (T,) m/s, true speed of the ego.
        free: (T,) the driver drives, and not the supervisor, which brakes and moves the ego after a crash.
        sample: (T,) free, and the driver reported what it perceived: ticks that count for perception (A-250).
        strays: (T,) all wheels are off every lane, and no counted departure follows (R-6).
    """

    log: RunLog
    place: LaneMatch
    lead: Leads
    v: Floats
    free: Flags
    sample: Flags
    strays: Flags

    def row(self, tick: int) -> int:
        """Returns the row of a tick, or of the first one after it, at most the last."""
        return min(int(np.searchsorted(self.log.tick, tick)), len(self.log) - 1)


def prepare(log: RunLog, road_map: RoadMap, settings: MetricSettings | None = None) -> Drive:
    """Matches a log, which must not be empty, to its map."""
    index = lane_index(road_map)
    a = log.actors
    place = index.match(a.x[:, 0], a.y[:, 0], a.z[:, 0])
    free = log.supervision == Supervision.NONE
    reported = ~np.isnan(log.report.status)
    return Drive(
        log=log,
        place=place,
        lead=find_leads(log, index, place, (settings or MetricSettings()).lead),
        v=log.v_ego,
        free=free,
        sample=free & reported,
        strays=_strays(log, road_map, free),
    )


@lru_cache(maxsize=4)
def lane_index(road_map: RoadMap) -> LaneIndex:
    """Returns the index of a map's lanes, made once per map."""
    return LaneIndex(road_map.samples, road_map.lanes)


def _strays(log: RunLog, road_map: RoadMap, free: Flags) -> Flags:
    """Returns (T,) ticks off all lanes, but for stretches that the supervisor ended: those are counted."""
    a, table = log.actors, log.table
    size = float(table.length[0]), float(table.width[0])
    off = road_map.edge.off(a.x[:, 0], a.y[:, 0], a.z[:, 0], a.yaw[:, 0], *size)
    strays: Flags = off & free
    for row in np.flatnonzero(free[:-1] & ~free[1:]).tolist():
        while row >= 0 and strays[row]:
            strays[row] = False
            row -= 1
    return strays


def find_leads(log: RunLog, index: LaneIndex, place: LaneMatch, rule: LeadDefinition) -> Leads:
    """Returns the nearest vehicle within LEAD_RANGE that the definition calls a lead, per tick (A-236)."""
    a, table = log.actors, log.table
    distance = np.hypot(a.x - a.x[:, :1], a.y - a.y[:, :1]).astype(np.float64)
    near = log.present & (distance < LEAD_RANGE) & (table.kind <= ActorKind.MOTORCYCLE)
    near[:, 0] = False
    k, i = np.nonzero(near)
    ego, other = place.at(k), index.match(a.x[k, i], a.y[k, i], a.z[k, i])
    pairs = Pairs(k, i, ego, other, index.distance_ahead(ego, other, LEAD_RANGE))
    if rule is LeadDefinition.AHEAD_ON_LANE:
        is_lead = np.isfinite(pairs.along)
    else:
        is_lead = _same_ids(index, ego, other)
    best = np.full(distance.shape, np.inf)
    best[k[is_lead], i[is_lead]] = distance[k[is_lead], i[is_lead]]
    return _describe(log, pairs.where(is_lead & (np.argmin(best, axis=1)[k] == i)))


def _same_ids(index: LaneIndex, a: LaneMatch, b: LaneMatch) -> Flags:
    """Returns (n,) True where both matches lie on lanes of the same road and lane id."""
    road, lane_id = index.lanes.road, index.lanes.lane_id
    same = (road[a.lane] == road[b.lane]) & (lane_id[a.lane] == lane_id[b.lane])
    known: Flags = same & (a.lane >= 0) & (b.lane >= 0)
    return known


def _describe(log: RunLog, leads: Pairs) -> Leads:
    """Returns the leads of a drive from at most one pair per tick."""
    a, (k, i, e, o, along) = log.actors, leads
    distance, gap, closing = (np.full(len(log), np.nan) for _ in range(3))
    actor = np.full(len(log), -1, dtype=np.int64)
    overlap = np.zeros(len(log), dtype=np.bool_)
    ego = np.zeros_like(i)
    long_e, wide_e = _extent(log, k, ego, e.heading)
    long_o, wide_o = _extent(log, k, i, o.heading)
    actor[k] = i
    distance[k] = np.hypot(a.x[k, i] - a.x[k, 0], a.y[k, i] - a.y[k, 0])
    gap[k] = np.where(np.isfinite(along), np.maximum(along - long_e - long_o, 0.0), np.nan)
    closing[k] = _speed_along(log, k, ego, e.heading) - _speed_along(log, k, i, o.heading)
    overlap[k] = np.abs(o.offset - e.offset) < wide_e + wide_o
    return Leads(actor, distance, gap, closing, overlap)


def _extent(log: RunLog, k: Ints, i: Ints, heading: Floats) -> tuple[Floats, Floats]:
    """Returns half length and half width in m of boxes along and across their lanes.

    k: rows, i: columns of actors, heading: rad of the lanes, (m,) each.
    """
    turn = log.actors.yaw[k, i] - heading
    c, s = np.abs(np.cos(turn)), np.abs(np.sin(turn))
    length, width = log.table.length[i] / 2.0, log.table.width[i] / 2.0
    return length * c + width * s, length * s + width * c


def _speed_along(log: RunLog, k: Ints, i: Ints, heading: Floats) -> Floats:
    """Returns the speeds in m/s of actors `i` at ticks `k` along the headings in rad."""
    a = log.actors
    return np.asarray(a.vx[k, i] * np.cos(heading) + a.vy[k, i] * np.sin(heading), np.float64)
