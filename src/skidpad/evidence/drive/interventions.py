"""The time that a drive went undisturbed: up to the first reset, and whether that intervened (T-4)."""

from __future__ import annotations

import numpy as np

from skidpad.core.vocabulary import RelocationReason, Supervision
from skidpad.evidence.drive.prepared import Drive, Mask

NO_INTERVENTION = (RelocationReason.STUCK, RelocationReason.ROAD_END)


def first_intervention(drive: Drive, where: Mask) -> tuple[float | None, float]:
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
    """Whether the supervisor began at this row for a crash, a departure or a wrong way."""
    if drive.log.supervision[begin] == Supervision.BRAKE:
        return True
    later = np.flatnonzero(drive.free[begin:])
    end = begin + int(later[0]) if later.size else len(drive.log)
    reasons = [r.reason for r in drive.log.relocations if begin <= drive.row(r.tick) < end]
    return bool(reasons) and reasons[0] not in NO_INTERVENTION
