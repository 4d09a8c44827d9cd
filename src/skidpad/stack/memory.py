"""What our stack knows from tick to tick: one record with named fields, which kernels read and write.

NaN stands for none, in distances in m as in any other number; counters are of ticks.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

KMH = 3.6  # per m/s
MEMORY = np.dtype(
    [
        # the ego on its lane, left positive; 0 off every lane
        ("lane", np.int64),  # index; -1: off every lane
        ("s", np.float64),  # m along it
        ("bend", np.float64),  # 1/m, curvature of that lane there
        ("reference", np.int64),  # index of the lane that is followed; -1: none
        ("reference_s", np.float64),
        ("yaw_error", np.float64),  # rad, heading minus lane heading
        ("kappa", np.float64),  # 1/m, of the parabola
        ("steer", np.float64),  # smoothed
        # what the tick shows ahead
        ("status", np.int64),  # DetectionStatus
        ("distance", np.float64),  # measured, as the tiers use it
        ("bumper", np.float64),
        ("roof", np.float64),
        ("fused", np.float64),  # of both cameras, before the filters
        ("radar_pre", np.float64),  # nearest point after the pre-filter
        ("radar_lane", np.float64),  # nearest point in the ego's lane
        ("radar_velocity", np.float64),  # m/s of that point, else of the nearest; negative closing
        ("radar_points", np.int64),
        ("velocity_limit", np.float64),  # m/s, slower radar points count as standing
        # filters and memory of detections
        ("smoothed", np.float64),  # by the rate filter
        ("seen_ticks", np.int64),
        ("missed_ticks", np.int64),
        ("last_distance", np.float64),
        ("was_following", np.bool_),
        ("was_stopping", np.bool_),
        # tiers
        ("tier", np.int64),  # Tier that won the last tick
        ("holding", np.bool_),  # behind a lead at a red light
        ("ticks_since_lead", np.int64),
        ("speed_previous", np.float64),  # km/h, error of the speed PID
        ("speed_integral", np.float64),
        ("distance_previous", np.float64),  # m, error of the distance PID
        ("distance_integral", np.float64),
        ("steady_integral", np.float64),  # share of throttle
        # the light at which it stops
        ("stops", np.bool_),
        ("stop_signal", np.int64),  # id
        ("stop_left", np.float64),  # m to its line
        # resume protocol
        ("resume_ticks", np.int64),  # since the last tick at a stop; -1: no stop yet
        ("in_curve", np.bool_),
        ("past_curve", np.bool_),
    ],
    align=True,
)
Memory = NDArray[np.void]  # one row
Record = Any  # that row, as kernels take it


def new_memory() -> Memory:
    """Returns the memory of a stack on no lane that has stopped nowhere, all else zero.

    `forget_sight` and `forget_tiers` write what a stack knows that has seen nothing.
    """
    memory = np.zeros(1, MEMORY)
    memory["lane"] = memory["reference"] = memory["resume_ticks"] = -1
    return memory
