"""Comfort of a driven or planned path (C-040 to C-047), in the three forms of decision C-16."""

from __future__ import annotations

from math import exp, tanh

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import kernel

STEEPNESS = 0.2  # per m/s^2 and per m/s^3 (C-045)
MIN_POINTS = 4  # three differences give one jerk (C-041)
FIT_WINDOW = 1.0  # s, decision C-16
FIT_MIN_POINTS = 8
V_STANDING = 0.5  # m/s, slower motion does not tell a direction


@kernel
def accelerations(
    t: Floats, x: Floats, y: Floats, heading: Floats
) -> tuple[Floats, Floats, Floats]:
    """Returns longitudinal (n - 2,) and lateral (n - 2,) acceleration and jerk (n - 3,) of n positions.

    Differences of positions give velocities at the middles of intervals (DC-03), theirs the
    accelerations, resolved along and across the heading (DC-02); jerk is the difference of the
    longitudinal part. NaN where times do not increase. Source: C-041.
    """
    n = len(t)
    along = np.empty(max(n - 2, 0))
    across = np.empty(max(n - 2, 0))
    middle = np.empty(max(n - 2, 0))
    for i in range(n - 2):
        dt0, dt1 = t[i + 1] - t[i], t[i + 2] - t[i + 1]
        if dt0 <= 0.0 or dt1 <= 0.0:
            along[i] = across[i] = middle[i] = np.nan
            continue
        dt = 0.5 * (dt0 + dt1)
        ax = ((x[i + 2] - x[i + 1]) / dt1 - (x[i + 1] - x[i]) / dt0) / dt
        ay = ((y[i + 2] - y[i + 1]) / dt1 - (y[i + 1] - y[i]) / dt0) / dt
        c, s = np.cos(heading[i + 1]), np.sin(heading[i + 1])
        along[i] = ax * c + ay * s
        across[i] = ay * c - ax * s
        middle[i] = 0.25 * (t[i] + 2.0 * t[i + 1] + t[i + 2])
    jerk = np.empty(max(n - 3, 0))
    for i in range(n - 3):
        jerk[i] = (along[i + 1] - along[i]) / (middle[i + 1] - middle[i])
    return along, across, jerk


@kernel
def comfort_score(
    along: float, across: float, jerk: float, steepness: float, printed: bool
) -> float:
    """Returns the score in [0, 1] of two accelerations in m/s^2 and a jerk in m/s^3; NaN if any is NaN.

    1 - ((NV(along) + NV(across)) / 2 + NV(jerk)) / 2 (C-043), where the printed normalisation is
    NV(s) = 1 / (1 + exp(-w s)) (C-042) and the completed one tanh(w |s| / 2) (C-044, DC-01).
    """
    if printed:
        nv_along = 1.0 / (1.0 + exp(-steepness * along))
        nv_across = 1.0 / (1.0 + exp(-steepness * across))
        nv_jerk = 1.0 / (1.0 + exp(-steepness * jerk))
    else:
        nv_along = tanh(0.5 * steepness * abs(along))
        nv_across = tanh(0.5 * steepness * abs(across))
        nv_jerk = tanh(0.5 * steepness * abs(jerk))
    return 1.0 - (0.5 * (nv_along + nv_across) + nv_jerk) / 2.0


@kernel
def path_comfort(
    t: Floats, x: Floats, y: Floats, heading: Floats, steepness: float, printed: bool
) -> float:
    """Returns the comfort of n stored positions, (n,) each; NaN with fewer than MIN_POINTS (C-040).

    The raw values are averaged over the path: signed in the printed form, else by size (C-045).
    """
    if len(t) < MIN_POINTS:
        return np.nan
    along, across, jerk = accelerations(t, x, y, heading)
    if not printed:
        along, across, jerk = np.abs(along), np.abs(across), np.abs(jerk)
    return comfort_score(
        float(np.mean(along)), float(np.mean(across)), float(np.mean(jerk)), steepness, printed
    )


@kernel
def direction_of_motion(t: Floats, x: Floats, y: Floats, first: float, out: Floats) -> None:
    """Writes the heading in rad at each of n positions, of the motion to the next, into out (n,).

    It is held below V_STANDING. `first` is the heading at the start; a path driven in reverse keeps
    the car's own heading.
    """
    heading = first
    n = len(t)
    for i in range(n):
        if i < n - 1 and t[i + 1] > t[i]:
            dx, dy = x[i + 1] - x[i], y[i + 1] - y[i]
            if np.hypot(dx, dy) >= V_STANDING * (t[i + 1] - t[i]):
                reverse = dx * np.cos(heading) + dy * np.sin(heading) < 0.0
                heading = np.arctan2(-dy, -dx) if reverse else np.arctan2(dy, dx)
        out[i] = heading


@kernel
def planned_path_comfort(plan: Floats, ego: Floats, steepness: float, printed: bool) -> float:
    """Returns the comfort of the ego's place followed by its plan (C-046); NaN for a plan too short.

    plan: (m, 3) x, y, t, up to the first row that is not finite; ego: (5,).
    """
    k = 0
    for i in range(plan.shape[0]):
        if not np.isfinite(plan[i, 0] + plan[i, 1] + plan[i, 2]):
            break
        k = i + 1
    first = 1 if k > 0 and plan[0, 2] > 1e-6 else 0
    n = k + first
    t, x, y = np.empty(n), np.empty(n), np.empty(n)
    if first == 1:
        t[0], x[0], y[0] = 0.0, ego[0], ego[1]
    for i in range(k):
        x[first + i], y[first + i], t[first + i] = plan[i, 0], plan[i, 1], plan[i, 2]
    heading = np.empty(n)
    direction_of_motion(t, x, y, ego[2], heading)
    return path_comfort(t, x, y, heading, steepness, printed)


@kernel
def fitted_acceleration(t: Floats, x: Floats, y: Floats, heading: float) -> tuple[float, float]:
    """Returns longitudinal and lateral acceleration of a least-squares parabola through n positions.

    The leading coefficient comes from the polynomial orthogonal to 1 and t, so no system is solved.
    NaN with fewer than FIT_MIN_POINTS or when all times coincide. heading: rad, at the middle.
    """
    n = len(t)
    if n < FIT_MIN_POINTS:
        return np.nan, np.nan
    t_mean = np.mean(t)
    m2 = m3 = 0.0
    for i in range(n):
        u = t[i] - t_mean
        m2 += u * u
        m3 += u * u * u
    if m2 <= 0.0:
        return np.nan, np.nan
    ax = ay = norm = 0.0
    for i in range(n):
        u = t[i] - t_mean
        p = u * u - (m3 / m2) * u - m2 / n
        ax += p * x[i]
        ay += p * y[i]
        norm += p * p
    ax, ay = 2.0 * ax / norm, 2.0 * ay / norm
    c, s = np.cos(heading), np.sin(heading)
    return ax * c + ay * s, ay * c - ax * s
