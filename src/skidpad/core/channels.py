"""What a driving channel reports each cycle (C-020): arrays, and masks for absence."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


class ChannelFrame(NamedTuple):
    """One channel's ego and world at one cycle; world frame, SI, 2-D.

    `plan` begins at the ego's place. n objects; predictions have p points each. Shapes are given
    as polygons relative to the object's own position and heading.
    """

    t: float  # s, time of the cycle
    ego: Floats  # (5,) x, y, heading, vx, vy
    ego_polygon: Floats  # (k, 2)
    plan: Floats  # (m, 3) x, y, t relative to `t`; (0, 3) when there is none
    objects: Floats  # (n, 5) x, y, heading, vx, vy
    polygons: Floats  # (n, k, 2), rows beyond polygon_size are NaN
    polygon_size: NDArray[np.int64]  # (n,)
    predictions: Floats  # (n, p, 2)
    prediction_t: Floats  # (p,) relative to `t`
    ids: NDArray[np.int64]  # (n,) -1: this channel gives no identity
    classes: NDArray[np.int64]  # (n,) SemanticClass, -1: unknown
