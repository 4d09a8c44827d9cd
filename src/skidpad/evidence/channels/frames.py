"""What of a channel's message can be evaluated: objects that are numbers, the nearest first."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from skidpad.core.channels import ChannelFrame

OBJECT_LIMIT = 300  # objects per channel that are compared, the nearest; all are counted


class Usable(NamedTuple):
    """A frame that kernels can take, and what was left out of it."""

    frame: ChannelFrame
    reported: int  # objects in the message
    unusable: int  # objects whose place, heading or velocity is not a number
    beyond_limit: int  # objects left out for their number


def usable(frame: ChannelFrame, limit: int = OBJECT_LIMIT) -> Usable:
    """Returns the frame without objects that are not finite and, above `limit`, without the farthest.

    It comes with the counts of what was left out; the same frame where nothing was.
    """
    objects = frame.objects
    n = len(objects)
    if n <= limit and np.isfinite(objects).all():
        return Usable(frame, n, 0, 0)
    rows = np.flatnonzero(np.isfinite(objects).all(axis=1))
    finite = len(rows)
    if finite > limit:
        distance = np.hypot(*(objects[rows, :2] - np.nan_to_num(frame.ego[:2])).T)
        rows = np.sort(rows[np.argsort(distance, kind="stable")[:limit]])
    kept = frame._replace(
        objects=objects[rows],
        polygons=frame.polygons[rows],
        polygon_size=frame.polygon_size[rows],
        predictions=frame.predictions[rows],
        ids=frame.ids[rows],
        classes=frame.classes[rows],
    )
    return Usable(kept, n, n - finite, finite - len(rows))
