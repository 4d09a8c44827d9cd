"""How whole the background stayed: contacts among vehicles that are not the ego."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Flags
from skidpad.core.vocabulary import ActorKind
from skidpad.evidence.drive.prepared import Drive
from skidpad.recording.campaign.matrix import Metrics

AFTER_EGO = 20.0  # s after a contact of the ego, in which others may owe theirs to it
UNSEEN = "unseen"  # `traffic` of a log's header: the backend does not tell contacts of others


def background(drive: Drive, where: Flags) -> Metrics:
    """Returns the metrics of contacts among background vehicles over the ticks of `where` (T,).

    Those within AFTER_EGO of a contact of the ego are counted apart. All None where the backend does
    not report contacts of others.
    """
    log = drive.log
    if log.header.about.get("traffic") == UNSEEN:
        return Metrics()
    hold = AFTER_EGO / log.header.dt
    own = np.array([c.tick for c in log.contacts])
    found = [c.tick for c in log.background if c.other > 0 and where[drive.row(c.tick)]]
    after = sum(bool(np.any((tick >= own) & (tick - own <= hold))) for tick in found)
    km = _vehicle_km(drive, where)
    free = len(found) - after
    return Metrics(
        traffic_contacts=free,
        traffic_contacts_after_ego=after,
        traffic_put_back=sum(bool(where[drive.row(e.tick)]) for e in log.put_back),
        traffic_moved=sum(bool(where[drive.row(e.tick)]) for e in log.moved_on),
        traffic_roll_overs=sum(
            e.actor > 0 and bool(where[drive.row(e.tick)]) for e in log.roll_overs
        ),
        traffic_km=km,
        traffic_contacts_per_100_km=100.0 * free / km if km > 0.0 else None,
    )


def _vehicle_km(drive: Drive, where: Flags) -> float:
    """Returns the km that all vehicles but the ego drove in the ticks of `where`."""
    log = drive.log
    others = log.table.kind <= ActorKind.MOTORCYCLE
    others[0] = False
    moving = log.present & where[:, None] & others
    speed = np.hypot(log.actors.vx, log.actors.vy, dtype=np.float64)
    return float(np.where(moving, speed, 0.0).sum() * log.header.dt / 1000.0)
