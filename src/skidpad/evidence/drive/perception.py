"""How well the ego saw what was in front of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Flags, Floats
from skidpad.core.vocabulary import DetectionStatus, Tier
from skidpad.evidence.drive.prepared import LEAD_RANGE, Drive
from skidpad.recording.campaign.matrix import Metrics

PRESENT = (2.0, LEAD_RANGE)  # m, exclusive
MEASURED = (0.1, 99.0)  # m, exclusive
LOST = (DetectionStatus.NO_TARGET, DetectionStatus.FUSION_PERSIST)
FOLLOWING = (Tier.ACC_HOLD, Tier.ACC_OPEN, Tier.ACC_CLOSE)


class Confusion(NamedTuple):
    """Ticks by what was reported and what was there (A-238)."""

    tp: int
    fp: int
    tn: int
    fn: int

    @property
    def fpr_pct(self) -> float | None:
        """Returns 100 FP / (FP + TN), eq. 20; None when no vehicle-free tick exists."""
        return percent(self.fp, self.fp + self.tn)

    @property
    def fnr_pct(self) -> float | None:
        """Returns 100 FN / (FN + TP), eq. 21; None when no vehicle was ever there."""
        return percent(self.fn, self.fn + self.tp)


def percent(part: int, whole: int) -> float | None:
    """Returns 100 part / whole; None when there is no whole (decision X-3)."""
    return 100.0 * part / whole if whole else None


def vehicle_present(drive: Drive) -> Flags:
    """Returns (T,) whether a lead is there in truth: between the distances PRESENT (A-237)."""
    d = drive.lead.distance
    return np.asarray((d > PRESENT[0]) & (d < PRESENT[1]), dtype=np.bool_)


def confusion(reported: Flags, present: Flags, where: Flags) -> Confusion:
    """Returns the counts over the ticks of `where`; all masks are (T,)."""
    r, p = reported[where], present[where]
    counts = (r & p, r & ~p, ~r & ~p, ~r & p)
    return Confusion(*(int(np.count_nonzero(c)) for c in counts))


def radar_levels(drive: Drive, where: Flags) -> tuple[Confusion, Confusion, Confusion]:
    """Returns the counts at the pre-filter, after the lane check, and of the final decision (A-239)."""
    report, present = drive.log.report, vehicle_present(drive)
    use = where & drive.sample
    levels = (~np.isnan(report.radar_pre), ~np.isnan(report.radar_lane), report.detected == 1.0)
    pre, lane, final = (confusion(level, present, use) for level in levels)
    return pre, lane, final


def distance_errors(drive: Drive, where: Flags) -> Metrics:
    """Returns errors |truth - measured| where both lie strictly between 0.1 and 99 m (A-240).

    All None without such a sample.
    """
    truth, measured = drive.lead.distance, drive.log.report.distance
    use = where & drive.sample & _inside(truth) & _inside(measured)
    error = np.abs(truth - measured)[use]
    if not error.size:
        return Metrics()
    return Metrics(
        mean_error_m=float(error.mean()),
        max_error_m=float(error.max()),
        max_error_at_s=float(drive.log.t[use][np.argmax(error)]),
        headway_variance_m2=float(error.var()) if error.size > 1 else None,
    )


def _inside(distance: Floats) -> Flags:
    """Returns (n,) True where the distance in m lies within the MEASURED range, ends excluded."""
    return np.asarray((distance > MEASURED[0]) & (distance < MEASURED[1]), dtype=np.bool_)


def gap_variance(drive: Drive, where: Flags) -> float | None:
    """Returns the population variance of the true gap in m^2 while the stack follows (A-242).

    None with fewer than two samples.
    """
    following = np.isin(drive.log.report.tier, FOLLOWING)
    gap = drive.lead.gap[where & drive.sample & following]
    gap = gap[~np.isnan(gap)]
    return float(gap.var()) if gap.size > 1 else None


def dropout_pct(drive: Drive, where: Flags) -> tuple[float | None, float | None]:
    """Returns the share of ticks that are a detection gap, in % of all samples (A-243), and in % of

    those on which a vehicle is truly there (A-244); None without any.
    """
    lost = np.isin(drive.log.report.status, LOST)
    every = where & drive.sample
    there = every & vehicle_present(drive)
    return (_share(lost, every), _share(lost, there))


def _share(part: Flags, whole: Flags) -> float | None:
    """Returns how many % of the `whole` are also in `part`; None where the whole is empty."""
    return percent(int(np.count_nonzero(part & whole)), int(np.count_nonzero(whole)))
