"""All metrics of one run from its log: one row of results, and one per weather (A-231)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from skidpad.core.vocabulary import RelocationReason
from skidpad.evidence.metrics.collisions import BEND_RADIUS, Crash, CrashKind, find_crashes
from skidpad.evidence.metrics.conflict import conflicts, true_conflicts
from skidpad.evidence.metrics.drive import Drive, Mask, MetricSettings, prepare
from skidpad.evidence.metrics.lateral import count_invasions, lateral_offset
from skidpad.evidence.metrics.perception import (
    distance_errors,
    dropout_pct,
    gap_variance,
    radar_levels,
)
from skidpad.recording.results import Metrics
from skidpad.recording.runlog import RunLog
from skidpad.roads.queries import RoadMap

KMH = 3.6


def run_metrics(log: RunLog, road_map: RoadMap, settings: MetricSettings | None = None) -> Metrics:
    """The metrics of a whole run; complete whatever the log lacks (A-251)."""
    if not len(log):
        return Metrics(samples=0)
    drive = prepare(log, road_map, settings)
    return summarise(drive, find_crashes(drive), highway_roads(drive, road_map))


def weather_metrics(
    log: RunLog, road_map: RoadMap, settings: MetricSettings | None = None
) -> dict[str, Metrics]:
    """The same for each weather of the run, by slug (A-231)."""
    drive = prepare(log, road_map, settings)
    crashes, highway = find_crashes(drive), highway_roads(drive, road_map)
    return {
        slug: summarise(drive, crashes, highway, log.weather == number)
        for number, slug in enumerate(log.weathers)
        if np.any(log.weather == number)
    }


def highway_roads(drive: Drive, road_map: RoadMap) -> frozenset[int]:
    """Roads met when driving on from the start (A-032, A-212)."""
    a = drive.log.actors
    start = road_map.project(float(a.x[0, 0]), float(a.y[0, 0]), float(a.z[0, 0]))
    return frozenset() if start is None else road_map.traced_roads(start)


def summarise(
    drive: Drive, crashes: Sequence[Crash], highway: frozenset[int], where: Mask | None = None
) -> Metrics:
    """Metrics over the ticks of `where` (T,), all by default."""
    log = drive.log
    if where is None:
        where = np.ones(len(log), dtype=np.bool_)
    here = [c for c in crashes if where[drive.row(c.tick)]]
    seen, true = conflicts(drive, where), true_conflicts(drive, where)
    pre, lane, final = radar_levels(drive, where)
    errors, offsets = distance_errors(drive, where), lateral_offset(drive, where)
    dropout, dropout_present = dropout_pct(drive, where)
    counted = where & drive.free
    invasions = count_invasions(
        (i for i in log.invasions if counted[drive.row(i.tick)]), highway, log.header.dt
    )
    kinds = [c.kind for c in here]
    impacts = [c.v_closing * KMH for c in here if c.v_closing is not None]
    stuck = [r for r in log.relocations if r.reason is RelocationReason.STUCK]
    v = drive.v[counted] * KMH
    curved = counted & (np.abs(drive.place.curvature) > 1.0 / BEND_RADIUS)
    distance_km = float(drive.v[where].sum() * log.header.dt / 1000.0)
    return Metrics(
        fatal_collisions=len(here),
        collisions_vehicle=kinds.count(CrashKind.VEHICLE),
        collisions_static=kinds.count(CrashKind.STATIC),
        wrong_way=kinds.count(CrashKind.WRONG_WAY),
        contacts=sum(bool(where[drive.row(c.tick)]) for c in log.contacts),
        rear_ended=sum(c.rear_ended for c in here),
        bend_exits=sum(c.bend_exit for c in here),
        stuck_relocations=sum(bool(where[drive.row(r.tick)]) for r in stuck),
        max_impact_kmh=max(impacts, default=None),
        lane_invasions=invasions.solid,
        lane_invasions_all=invasions.any,
        lane_invasions_highway=invasions.solid_on_highway,
        lane_changes=invasions.lane_changes,
        lateral_mean_m=offsets.mean,
        lateral_max_m=offsets.max,
        lateral_std_m=offsets.std,
        min_ttc_s=seen.min_ttc,
        min_ttc_above_10_kmh_s=seen.min_ttc_gated,
        ttc_below_1_5_s=seen.critical_time,
        ttc_critical_count=seen.critical_ticks,
        min_ttc_true_s=true.min_ttc,
        max_drac_true=true.max_drac,
        min_gap_true_m=true.min_gap,
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
        mean_error_m=errors.mean,
        max_error_m=errors.max,
        max_error_at_s=errors.max_at,
        headway_variance_m2=errors.variance,
        gap_variance_m2=gap_variance(drive, where),
        dropout_pct=dropout,
        dropout_present_pct=dropout_present,
        mean_speed_kmh=float(v.mean()) if v.size else None,
        max_speed_kmh=float(v.max()) if v.size else None,
        p50_speed_kmh=float(np.percentile(v, 50)) if v.size else None,
        p95_speed_kmh=float(np.percentile(v, 95)) if v.size else None,
        bend_speed_kmh=float(np.percentile(drive.v[curved], 95)) * KMH if curved.any() else None,
        distance_km=distance_km,
        duration_s=float(np.count_nonzero(where) * log.header.dt),
        fatal_per_100_km=100.0 * len(here) / distance_km if distance_km > 0.0 else None,
        samples=int(np.count_nonzero(where & drive.sample)),
        skipped_supervised=int(np.count_nonzero(where & ~drive.free)),
        skipped_no_report=int(np.count_nonzero(where & drive.free & ~drive.sample)),
        notices=sum(bool(where[drive.row(n.tick)]) for n in log.notices),
    )
