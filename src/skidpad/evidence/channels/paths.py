"""Time-stamped paths sampled on a common clock (C-074), shared by indicators and risk."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats, Ints
from skidpad.core.kernels.jit import inner_kernel, kernel


@inner_kernel
def usable_length(times: Floats, points: Floats) -> int:
    """Returns how many leading rows are finite and strictly later than the row before them.

    times (m,) s, points (m, 2). What follows the first bad row is not trusted.
    """
    for i in range(len(times)):
        bad = not (np.isfinite(times[i]) and np.isfinite(points[i, 0] + points[i, 1]))
        if bad or (i > 0 and times[i] <= times[i - 1]):
            return i
    return len(times)


@inner_kernel
def sample_path(
    times: Floats, points: Floats, start: Floats, t_start: float, step: float, out: Floats
) -> int:
    """Writes positions on a path at t_start + i * step s into out (m, 2); returns how many lie in it.

    times (k,) and points (k, 2) begin after or at time 0, where the mover is at `start` (x, y, _,
    vx, vy). Beyond the end the last velocity is held (C-073). The samples, counted from the first,
    lie within the path's own duration: 0 when it has no usable point.
    """
    k = usable_length(times, points)
    # velocity after the end: of the last segment, else of the mover itself
    if k >= 2:
        dt = times[k - 1] - times[k - 2]
        vx = (points[k - 1, 0] - points[k - 2, 0]) / dt
        vy = (points[k - 1, 1] - points[k - 2, 1]) / dt
    elif k == 1 and times[0] > 0.0:
        vx = (points[0, 0] - start[0]) / times[0]
        vy = (points[0, 1] - start[1]) / times[0]
    else:
        vx, vy = start[3], start[4]
    t_end = times[k - 1] if k > 0 else 0.0
    x_end = points[k - 1, 0] if k > 0 else start[0]
    y_end = points[k - 1, 1] if k > 0 else start[1]
    inside = 0
    j = 0
    for i in range(out.shape[0]):
        t = t_start + i * step
        if t > t_end + 1e-9 or k == 0:
            out[i, 0] = x_end + vx * (t - t_end)
            out[i, 1] = y_end + vy * (t - t_end)
            continue
        inside = i + 1
        while j < k - 1 and times[j] < t:
            j += 1
        if j == 0 and t < times[0]:
            t0, x0, y0 = 0.0, start[0], start[1]
        elif j == 0:
            t0, x0, y0 = times[0] - 1.0, points[0, 0], points[0, 1]
        else:
            t0, x0, y0 = times[j - 1], points[j - 1, 0], points[j - 1, 1]
        f = min((t - t0) / (times[j] - t0), 1.0)
        out[i, 0] = x0 + f * (points[j, 0] - x0)
        out[i, 1] = y0 + f * (points[j, 1] - y0)
    return inside


@kernel
def sample_plan(plan: Floats, ego: Floats, t_start: float, step: float, out: Floats) -> int:
    """Writes samples of a plan (m, 3) of x, y, t and its ego (5,) into `out`, as `sample_path` does."""
    return sample_path(plan[:, 2].copy(), plan[:, :2].copy(), ego, t_start, step, out)


@kernel
def sample_predictions(
    objects: Floats,
    predictions: Floats,
    prediction_t: Floats,
    t_start: float,
    step: float,
    out: Floats,
    inside: Ints,
) -> None:
    """Writes samples of the predictions of n objects into out (n, m, 2), as `sample_path` does.

    objects (n, 5), predictions (n, p, 2) at prediction_t (p,) s; inside (n,) is written, too: how
    many samples lie within each prediction.
    """
    for i in range(objects.shape[0]):
        inside[i] = sample_path(prediction_t, predictions[i], objects[i], t_start, step, out[i])
