"""All metrics of one run from its log: one row of results, and one per weather (A-231)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import fields

import numpy as np

from skidpad.core.arrays import Flags, Floats
from skidpad.core.states import LaneInvasion
from skidpad.core.vocabulary import RelocationReason, Supervision
from skidpad.evidence.drive.background import background
from skidpad.evidence.drive.collisions import BEND_RADIUS, Crash, CrashKind, find_crashes
from skidpad.evidence.drive.conflict import conflicts, true_conflicts
from skidpad.evidence.drive.perception import (
    distance_errors,
    dropout_pct,
    gap_variance,
    radar_levels,
)
from skidpad.evidence.drive.prepared import Drive, MetricSettings, prepare
from skidpad.evidence.drive.severity import (
    Measure,
    Severity,
    distinct_contacts,
    graded_contacts,
)
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.run.events import Event
from skidpad.recording.run.log import RunLog
from skidpad.roads.queries import RoadMap

V_MIN = 5.0 / 3.6  # m/s, slower the offset says nothing
CHANGE_COOL_DOWN = 12.0  # s
KMH = 3.6


def run_metrics(log: RunLog, road_map: RoadMap, settings: MetricSettings | None = None) -> Metrics:
    """Returns the metrics of a whole run; those that the log cannot give are None (A-251)."""
    if not len(log):
        return Metrics(samples=0)
    drive = prepare(log, road_map, settings)
    return summarise(drive, find_crashes(drive), highway_roads(drive, road_map))


def weather_metrics(
    log: RunLog, road_map: RoadMap, settings: MetricSettings | None = None
) -> dict[str, Metrics]:
    """Returns the metrics of the ticks of each weather of the run, by its slug (A-231); {}: an empty log."""
    if not len(log):
        return {}
    drive = prepare(log, road_map, settings)
    crashes, highway = find_crashes(drive), highway_roads(drive, road_map)
    return {
        slug: summarise(drive, crashes, highway, log.weather == number)
        for number, slug in enumerate(log.weathers)
        if np.any(log.weather == number)
    }


def highway_roads(drive: Drive, road_map: RoadMap) -> frozenset[int]:
    """Returns the ids of the roads met when driving on from the start (A-032, A-212); empty off the lanes."""
    a = drive.log.actors
    start = road_map.project(float(a.x[0, 0]), float(a.y[0, 0]), float(a.z[0, 0]))
    return frozenset() if start is None else road_map.traced_roads(start)


def summarise(
    drive: Drive, crashes: Sequence[Crash], highway: frozenset[int], where: Flags | None = None
) -> Metrics:
    """Returns the metrics over the ticks of `where` (T,), all by default.

    crashes: of the whole drive; highway: ids of its roads.
    """
    if where is None:
        where = np.ones(len(drive.log), dtype=np.bool_)
    here = [c for c in crashes if where[drive.row(c.tick)]]
    return combine_metrics(
        _collisions(drive, here, where),
        _severity(drive, here, where),
        _lanes(drive, highway, where),
        lateral_offset(drive, where),
        conflicts(drive, where),
        true_conflicts(drive, where),
        _radar(drive, where),
        distance_errors(drive, where),
        _dropouts(drive, where),
        _driving(drive, here, where),
        background(drive, where),
        _ticks(drive, where),
    )


def combine_metrics(*parts: Metrics) -> Metrics:
    """Returns one row from partial ones, each of which sets its own columns."""
    names = [f.name for f in fields(Metrics)]
    set_by = {n: getattr(p, n) for p in parts for n in names if getattr(p, n) is not None}
    return Metrics(**set_by)


def _among(drive: Drive, events: Iterable[Event], where: Flags) -> int:
    """Returns how many of the events lie in ticks of the mask `where`."""
    return sum(bool(where[drive.row(e.tick)]) for e in events)


def _collisions(drive: Drive, here: Sequence[Crash], where: Flags) -> Metrics:
    """Returns the metrics of crashes in `where`; `here` are the crashes there."""
    log = drive.log
    kinds, first = [c.kind for c in here], [c.kind for c in here if not c.follows]
    impacts = [(c.kind, c.v_closing * KMH) for c in here if c.v_closing is not None]
    stuck = [r for r in log.relocations if r.reason is RelocationReason.STUCK]
    return Metrics(
        fatal_collisions=len(here),
        crashes_vehicle=kinds.count(CrashKind.VEHICLE),
        road_departures=len(kinds) - kinds.count(CrashKind.VEHICLE),
        collisions_vehicle=kinds.count(CrashKind.VEHICLE),
        collisions_static=kinds.count(CrashKind.STATIC),
        off_road=kinds.count(CrashKind.OFF_ROAD),
        wrong_way=kinds.count(CrashKind.WRONG_WAY),
        roll_overs=kinds.count(CrashKind.ROLL_OVER),
        fatal_first=len(first),
        crashes_vehicle_first=first.count(CrashKind.VEHICLE),
        road_departures_first=len(first) - first.count(CrashKind.VEHICLE),
        first_fatal_s=_first_fatal(drive, here, where),
        contacts=_among(drive, log.contacts, where),
        rear_ended=sum(c.rear_ended for c in here),
        bend_exits=sum(c.bend_exit for c in here),
        stuck_relocations=_among(drive, stuck, where),
        max_impact_kmh=max((v for _, v in impacts), default=None),
        max_impact_vehicle_kmh=max(
            (v for kind, v in impacts if kind is CrashKind.VEHICLE), default=None
        ),
    )


def _severity(drive: Drive, here: Sequence[Crash], where: Flags) -> Metrics:
    """Returns the metrics of how hard contacts were in `where`; `here` are the crashes there."""
    touches = [c for c in graded_contacts(drive) if where[drive.row(c.tick)]]
    users = [c for c in distinct_contacts(drive) if where[drive.row(c.tick)]]
    static = sum(not c.is_road_user for c in touches)
    counts = Counter(c.severity for c in users)
    serious = sum(c.is_serious for c in users)
    hardest = max((c.delta_v for c in users if c.delta_v is not None), default=None)
    first_s, undisturbed_s = first_intervention(drive, where)
    return Metrics(
        serious_contacts=serious,
        contacts_light=counts[Severity.LIGHT],
        contacts_medium=counts[Severity.MEDIUM],
        contacts_heavy=counts[Severity.HEAVY],
        contacts_vulnerable=sum(c.is_vulnerable for c in users),
        contacts_by_closing_speed=sum(c.graded_by is Measure.CLOSING_SPEED for c in users),
        contacts_repeated=len(touches) - static - len(users),
        contacts_static=static,
        max_delta_v_kmh=None if hardest is None else hardest * KMH,
        interventions=len(here),
        first_intervention_s=first_s,
        undisturbed_s=undisturbed_s,
        serious_contacts_per_100_km=_per_100_km(drive, where, serious),
    )


def _first_fatal(drive: Drive, here: Sequence[Crash], where: Flags) -> float | None:
    """Returns the s driven among `where` up to the first fatal event; None: there was none."""
    if not here:
        return None
    return float(np.count_nonzero(where[: drive.row(here[0].tick)]) * drive.log.header.dt)


def _lanes(drive: Drive, highway: frozenset[int], where: Flags) -> Metrics:
    """Returns the metrics of lane markings that the ego's outline crossed in `where` (A-030 to A-032)."""
    counted = where & drive.free
    crossed = [i for i in drive.log.invasions if counted[drive.row(i.tick)]]
    return count_invasions(crossed, highway, drive.log.header.dt)


def _radar(drive: Drive, where: Flags) -> Metrics:
    """Returns the metrics of false and missed radar detections in `where`."""
    pre, lane, final = radar_levels(drive, where)
    return Metrics(
        radar_fpr_pct=lane.fpr_pct,
        radar_fnr_pct=lane.fnr_pct,
        radar_fpr_pct_pre=pre.fpr_pct,
        radar_fnr_pct_pre=pre.fnr_pct,
        radar_fpr_pct_final=final.fpr_pct,
        radar_fnr_pct_final=final.fnr_pct,
        tp=lane.tp,
        fp=lane.fp,
        tn=lane.tn,
        fn=lane.fn,
    )


def _dropouts(drive: Drive, where: Flags) -> Metrics:
    """Returns the metrics of the true gap and of dropouts of the measured distance in `where`."""
    dropout, dropout_present = dropout_pct(drive, where)
    return Metrics(
        gap_variance_m2=gap_variance(drive, where),
        dropout_pct=dropout,
        dropout_present_pct=dropout_present,
    )


def _driving(drive: Drive, here: Sequence[Crash], where: Flags) -> Metrics:
    """Returns the metrics of speed, distance and rates in `where`; `here` are the crashes there."""
    counted = where & drive.free
    v = drive.v * KMH
    in_bend = counted & (np.abs(drive.place.curvature) > 1.0 / BEND_RADIUS)
    dt = drive.log.header.dt
    hits = sum(c.kind is CrashKind.VEHICLE for c in here)
    return Metrics(
        mean_speed_kmh=float(v[counted].mean()) if counted.any() else None,
        max_speed_kmh=_percentile(v[counted], 100.0),
        p50_speed_kmh=_percentile(v[counted], 50.0),
        p95_speed_kmh=_percentile(v[counted], 95.0),
        bend_speed_kmh=_percentile(v[in_bend], 95.0),
        distance_km=_distance_km(drive, where),
        duration_s=float(np.count_nonzero(where) * dt),
        fatal_per_100_km=_per_100_km(drive, where, len(here)),
        crashes_vehicle_per_100_km=_per_100_km(drive, where, hits),
        road_departures_per_100_km=_per_100_km(drive, where, len(here) - hits),
        off_lanes_pct=100.0 * float(drive.strays[where].mean()) if where.any() else None,
    )


def _distance_km(drive: Drive, where: Flags) -> float:
    """Returns the distance in km driven in the ticks of `where`."""
    return float(drive.v[where].sum() * drive.log.header.dt / 1000.0)


def _per_100_km(drive: Drive, where: Flags, events: int) -> float | None:
    """Returns the events per 100 km driven in `where`; None without distance."""
    distance_km = _distance_km(drive, where)
    return 100.0 * events / distance_km if distance_km > 0.0 else None


def _percentile(values: Floats, percent: float) -> float | None:
    """Returns the percentile of the values; None without values."""
    return float(np.percentile(values, percent)) if values.size else None


def _ticks(drive: Drive, where: Flags) -> Metrics:
    """Returns the metrics of ticks counted and skipped in `where`, and of notices."""
    return Metrics(
        samples=int(np.count_nonzero(where & drive.sample)),
        skipped_supervised=int(np.count_nonzero(where & ~drive.free)),
        skipped_no_report=int(np.count_nonzero(where & drive.free & ~drive.sample)),
        notices=_among(drive, drive.log.notices, where),
    )


# --- the time that a drive went undisturbed: up to the first reset, and whether that intervened (T-4)
NO_INTERVENTION = (RelocationReason.STUCK, RelocationReason.ROAD_END)


def first_intervention(drive: Drive, where: Flags) -> tuple[float | None, float]:
    """Returns the s driven among `where` to the first intervention, and to the first reset.

    The first is None when no reset was made, when another one came first (a stuck ego, the end of
    the road), or when it was made outside `where`; the second is then still the time observed.
    """
    dt = drive.log.header.dt
    supervised = np.flatnonzero(~drive.free)
    if not supervised.size:
        return None, float(np.count_nonzero(where) * dt)
    begin = int(supervised[0])
    undisturbed = float(np.count_nonzero(where[:begin]) * dt)
    intervened = where[begin] and _is_intervention(drive, begin)
    return (undisturbed if intervened else None), undisturbed


def _is_intervention(drive: Drive, begin: int) -> bool:
    """Returns whether the supervisor began at row `begin` for a crash, a departure or a wrong way."""
    if drive.log.supervision[begin] == Supervision.BRAKE:
        return True
    later = np.flatnonzero(drive.free[begin:])
    end = begin + int(later[0]) if later.size else len(drive.log)
    reasons = [r.reason for r in drive.log.relocations if begin <= drive.row(r.tick) < end]
    return bool(reasons) and reasons[0] not in NO_INTERVENTION


# Lane keeping: distance from the lane centre, markings crossed, lane changes.


def lateral_offset(drive: Drive, where: Flags) -> Metrics:
    """Returns statistics of |offset| above V_MIN in `where`, outside recovery and warm-up (A-245)."""
    offset = np.abs(drive.place.offset)
    use = where & drive.free & (drive.v > V_MIN) & ~np.isnan(offset)
    values = offset[use]
    if not values.size:
        return Metrics()
    return Metrics(
        lateral_mean_m=float(values.mean()),
        lateral_max_m=float(values.max()),
        lateral_std_m=float(values.std()),
    )


def count_invasions(
    invasions: Iterable[LaneInvasion], highway: frozenset[int], dt: float
) -> Metrics:
    """Counts solid markings as infractions and broken ones as lane changes, at most one per 12 s (A-248).

    highway: ids of roads; dt: s per tick.
    """
    solid = total = on_highway = changes = 0
    last_change = -np.inf
    for invasion in sorted(invasions, key=lambda i: i.tick):
        total += 1
        if invasion.marking.startswith("solid"):
            solid += 1
            on_highway += invasion.road in highway
        elif (
            invasion.marking.startswith("broken")
            and (invasion.tick - last_change) * dt >= CHANGE_COOL_DOWN
        ):
            changes += 1
            last_change = invasion.tick
    return Metrics(
        lane_invasions=solid,
        lane_invasions_all=total,
        lane_invasions_highway=on_highway,
        lane_changes=changes,
    )
