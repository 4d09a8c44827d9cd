"""Time to collision as the stack saw it, and the conflicts that there truly were."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Flags, Floats
from skidpad.evidence.drive.prepared import Drive
from skidpad.recording.campaign.matrix import Metrics

V_EGO_MIN = 1.0  # m/s, below there is no time to collision
V_CLOSING_MIN = 0.5  # m/s
TTC_MAX = 30.0  # s
TTC_CRITICAL = 1.5  # s
V_GATE = 10.0 / 3.6  # m/s, for the gated minimum
GAP_MIN = 0.1  # m, nearer the needed deceleration says nothing more


def time_to_collision(gap: Floats, v_closing: Floats) -> Floats:
    """Returns the time to collision in s at constant closing speed; inf where the gap is not closing.

    gap in m, v_closing in m/s: (...) broadcastable, gap >= 0. Returns (...).
    Source: Hayward (1972), Near-miss determination through use of a scale of danger.
    """
    out = np.full(np.broadcast(gap, v_closing).shape, np.inf)
    np.divide(gap, v_closing, out=out, where=np.asarray(v_closing) > 0.0)
    return out


def deceleration_to_avoid_crash(gap: Floats, v_closing: Floats) -> Floats:
    """Returns the constant m/s^2 that just avoids contact: v^2 / (2 gap), 0 where nothing closes.

    A gap below GAP_MIN counts as that.
    Source: Cooper and Space (1976), as DRAC in Archer (2005), Indicators for traffic safety.
    """
    drac: Floats = np.maximum(v_closing, 0.0) ** 2 / (2.0 * np.maximum(gap, GAP_MIN))
    return drac


def reported_ttc(drive: Drive) -> Floats:
    """Returns (T,) s to collision from what the stack measured; inf where there is none (A-232, A-233).

    The closing speed is the radar's, or the ego's own speed where the radar has none.
    """
    report, v = drive.log.report, drive.v
    closing = np.where(np.isnan(report.radar_velocity), v, -report.radar_velocity)
    valid = (report.detected == 1.0) & (v > V_EGO_MIN) & (closing > V_CLOSING_MIN)
    ttc = time_to_collision(report.distance, np.where(valid, closing, 0.0))
    inside: Floats = np.where((ttc > 0.0) & (ttc < TTC_MAX), ttc, np.inf)
    return inside


def conflicts(drive: Drive, where: Flags) -> Metrics:
    """Returns the least time to collision and the time below TTC_CRITICAL, over samples in `where`."""
    ttc = np.where(where & drive.sample, reported_ttc(drive), np.inf)
    critical = int(np.count_nonzero(ttc < TTC_CRITICAL))
    return Metrics(
        min_ttc_s=least(ttc),
        min_ttc_above_10_kmh_s=least(ttc[drive.v > V_GATE]),
        ttc_critical_count=critical,
        ttc_below_1_5_s=critical * drive.log.header.dt,
    )


def true_conflicts(drive: Drive, where: Flags) -> Metrics:
    """Returns surrogates from truth along the lane, for leads whose box is in the driving ego's way (M-8)."""
    lead = drive.lead
    use = where & drive.free & (drive.v > V_EGO_MIN) & lead.overlap & ~np.isnan(lead.gap)
    gap, closing = lead.gap[use], lead.v_closing[use]
    drac = deceleration_to_avoid_crash(gap, closing)
    return Metrics(
        min_ttc_true_s=least(time_to_collision(gap, closing)),
        max_drac_true=float(drac.max()) if drac.size else None,
        min_gap_true_m=least(gap),
    )


def least(values: Floats) -> float | None:
    """Returns the smallest finite value, None when there is none."""
    finite = values[np.isfinite(values)]
    return float(finite.min()) if finite.size else None
