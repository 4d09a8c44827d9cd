"""The hash that says whether two drives moved alike (decision T-3)."""

from __future__ import annotations

import hashlib

import msgspec
import numpy as np

from skidpad.core.states import ContactEvent, TrafficContact
from skidpad.recording.run.events import encode_events
from skidpad.recording.run.log import RunLog

POSE = ("x", "y", "z", "yaw")
TOUCHES = (ContactEvent, TrafficContact)


def motion_hash(log: RunLog) -> str:
    """Returns a SHA-256 over the poses and contacts of all actors and the commands of the ego.

    Equal hashes are one drive for totals, intervals and verdicts. What the sensors and the stack
    said is left out, so a lamp that is seen at noon and not at night makes no second drive. The
    full content hash (`log_files.log_hash`) stays the promise of reproducibility.
    """
    kind, size = log.table.kind.tolist(), (log.table.length.tolist(), log.table.width.tolist())
    head = {"map": log.header.map_hash, "dt": log.header.dt, "kind": kind, "size": size}
    digest = hashlib.sha256(msgspec.json.encode(head, order="deterministic"))
    digest.update(log.tick.astype(np.int64).tobytes())
    digest.update(np.packbits(log.present).tobytes())
    for name in POSE:
        values = np.where(log.present, getattr(log.actors, name), np.float32(0.0))
        digest.update((values + np.float32(0.0)).astype(np.float32).tobytes())  # -0.0 is 0.0
    for command in log.applied:
        digest.update((np.nan_to_num(command) + 0.0).tobytes())
    digest.update(encode_events(e for e in log.events if isinstance(e, TOUCHES)))
    return digest.hexdigest()
