"""Where tracked objects will be: along their lanes, or straight on."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.jit import kernel
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.kernels import LaneArrays, advance_point, project_point

V_MOVING = 0.5  # m/s, slower objects are predicted to stay
ALIGNED = 0.87  # cosine of 30 deg between motion and lane
OFFSET_MAX = 2.0  # m beside the centre line
PERSON = int(SemanticClass.PEDESTRIAN)


@kernel
def predict(
    lanes: LaneArrays,
    objects: Floats,
    labels: NDArray[np.int64],
    z: float,
    along_lanes: bool,
    times: Floats,
    out: Floats,
) -> None:
    """Writes positions of objects at `times` (p,) into out (n, p, 2), at constant speed.

    objects (n, 5): x, y, heading, vx, vy; z: m, height of the road for all. A vehicle that moves with its
    lane keeps its offset from the centre line and takes the straightest way on; everything else goes
    straight on, and what is slower than V_MOVING stays.
    """
    for i in range(objects.shape[0]):
        x, y, vx, vy = objects[i, 0], objects[i, 1], objects[i, 3], objects[i, 4]
        v = hypot(vx, vy)
        if v < V_MOVING:
            vx = vy = v = 0.0
        for k in range(times.size):
            out[i, k, 0], out[i, k, 1] = x + vx * times[k], y + vy * times[k]
        if not along_lanes or v == 0.0 or labels[i] == PERSON:
            continue
        lane, s, offset, _, _, _, heading, _, _ = project_point(lanes, x, y, z, True)
        if lane < 0 or abs(offset) > OFFSET_MAX:
            continue
        if vx * cos(heading) + vy * sin(heading) < ALIGNED * v:
            continue
        for k in range(times.size):
            there = advance_point(lanes, lane, s, v * times[k], heading)
            if there[0] < 0:
                break
            out[i, k, 0] = there[3] - offset * sin(there[6])
            out[i, k, 1] = there[4] + offset * cos(there[6])
