"""Tracks of objects from one channel's detections: association, Kalman filter, birth and death.

Tracks live in the odometry frame, the path that the car's own wheels and gyroscope tell; so an
error of localisation moves the whole world at once and no object by itself.
"""

from __future__ import annotations

from collections import deque
from math import cos, pi, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelView
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.stack.channels.settings import ChannelSettings

GATE = 2.5  # m: a car at 40 m/s may accelerate by 6 m/s^2 for 0.5 s unseen, and errs by 3 sigma
SIGMA_MEASURED = 0.2  # m per axis
SIGMA_ACCELERATION = 2.5  # m/s^2, what road users do within a second
SIGMA_SPEED_FIRST = 6.0  # m/s of an object that was never seen before
V_FIRST = 50.0  # m/s ahead that it may have; the gate alone ends at 25 m/s in cycles of 0.1 s
HEADING_SHARE = 0.3  # of a new measurement in the smoothed heading
SIZE_SHARE = 0.1
V_TURNING = 2.0  # m/s, from which the motion tells the heading better than a detector
MAX_TRACKS = 128
VOTES = 10

TRACK = np.dtype(
    [
        ("id", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("vx", "f8"),
        ("vy", "f8"),
        ("p_xx", "f8"),  # covariance of one axis, the same for both
        ("p_xv", "f8"),
        ("p_vv", "f8"),
        ("heading", "f8"),
        ("length", "f8"),
        ("width", "f8"),
        ("label", "i8"),
        ("votes", "i8"),
        ("hits", "i8"),
        ("unseen", "f8"),  # s
    ],
    align=True,
)


class Tracker:
    """All tracks of one channel."""

    def __init__(self, settings: ChannelSettings) -> None:
        self.settings = settings
        self.reset()

    def reset(self) -> None:
        """Forgets all tracks and puts odometry to its origin."""
        self._all = np.zeros(MAX_TRACKS, dtype=TRACK)
        self.count = 0
        self.next_id = 0
        self.pose = np.zeros(3)  # x, y, heading by odometry
        self.t: float | None = None
        self._poses: deque[tuple[float, Floats]] = deque(maxlen=16)

    def update(self, view: ChannelView) -> None:
        """Moves the own pose on and updates the tracks with one view of the channel."""
        dt = 0.0 if self.t is None else view.t - self.t
        self.t = view.t
        speed, rate = float(view.ego[3]), float(view.ego[4])
        middle = self.pose[2] + 0.5 * dt * rate
        self.pose = self.pose + dt * np.array([speed * cos(middle), speed * sin(middle), rate])
        self._poses.append((view.t, self.pose))
        at = next((p for t, p in self._poses if t >= view.t_seen - 1e-6), self.pose)
        self.count, self.next_id = _update(
            self._all,
            self.count,
            self.next_id,
            dt,
            view.t_seen - view.t,
            at,
            view.objects,
            view.classes,
            self.settings.confirm,
            self.settings.coast,
        )

    @property
    def confirmed_tracks(self) -> NDArray[np.void]:
        """Rows of TRACK that count as objects, `confirm` detections at least, in the odometry frame."""
        rows = self._all[: self.count]
        chosen: NDArray[np.void] = rows[rows["hits"] >= self.settings.confirm]
        return chosen

    def objects(self, ego: Floats) -> Floats:
        """Returns (n, 5) x, y, heading, vx, vy of confirmed tracks in the world.

        ego: x, y, heading (and more) of the ego in the world.
        """
        rows = self.confirmed_tracks
        turn = float(ego[2]) - float(self.pose[2])
        c, s = cos(turn), sin(turn)
        dx, dy = rows["x"] - self.pose[0], rows["y"] - self.pose[1]
        return np.column_stack(
            [
                ego[0] + c * dx - s * dy,
                ego[1] + s * dx + c * dy,
                (rows["heading"] + turn + pi) % (2.0 * pi) - pi,
                c * rows["vx"] - s * rows["vy"],
                s * rows["vx"] + c * rows["vy"],
            ]
        )


@inner_kernel
def _predict(tracks: NDArray[np.void], count: int, dt: float) -> None:
    """Moves `count` tracks on by dt s: constant velocity with white acceleration.

    Source: Bar-Shalom et al. 2001, 6.2.
    """
    q = SIGMA_ACCELERATION**2
    for i in range(count):
        t = tracks[i]
        t.x += dt * t.vx
        t.y += dt * t.vy
        t.p_xx += dt * (2.0 * t.p_xv + dt * t.p_vv) + 0.25 * q * dt**4
        t.p_xv += dt * t.p_vv + 0.5 * q * dt**3
        t.p_vv += q * dt * dt
        t.unseen += dt


@inner_kernel
def _correct(t: Any, x: float, y: float, age: float) -> None:
    """Corrects a track by a position measured `age` (<= 0) s from now (Kalman update)."""
    r = SIGMA_MEASURED**2
    h = age
    variance = t.p_xx + 2.0 * h * t.p_xv + h * h * t.p_vv + r
    k_x = (t.p_xx + h * t.p_xv) / variance
    k_v = (t.p_xv + h * t.p_vv) / variance
    e_x, e_y = x - t.x - h * t.vx, y - t.y - h * t.vy
    t.x += k_x * e_x
    t.y += k_x * e_y
    t.vx += k_v * e_x
    t.vy += k_v * e_y
    p_xx, p_xv, p_vv = t.p_xx, t.p_xv, t.p_vv
    t.p_xx = p_xx - k_x * (p_xx + h * p_xv)
    t.p_xv = p_xv - k_x * (p_xv + h * p_vv)
    t.p_vv = p_vv - k_v * (p_xv + h * p_vv)


@inner_kernel
def _start_moving(t: Any, x: float, y: float, age: float) -> None:
    """Sets the state of an object seen twice: the difference of two places whose errors are independent."""
    t.vx, t.vy = (x - t.x) / t.unseen, (y - t.y) / t.unseen
    t.x, t.y = x - age * t.vx, y - age * t.vy
    r = SIGMA_MEASURED**2
    t.p_xx, t.p_xv, t.p_vv = r, r / t.unseen, 2.0 * r / t.unseen**2


@inner_kernel
def _shape(t: Any, heading: float, length: float, width: float, label: int) -> None:
    """Smooths heading and size of a track and votes on its class."""
    v = np.hypot(t.vx, t.vy)
    if v > V_TURNING:
        travel = np.arctan2(t.vy, t.vx)
        if np.cos(travel - heading) > 0.7:
            heading = travel
    turn = (heading - t.heading + np.pi) % (2.0 * np.pi) - np.pi
    t.heading += HEADING_SHARE * turn
    t.length += SIZE_SHARE * (length - t.length)
    t.width += SIZE_SHARE * (width - t.width)
    if label == t.label:
        t.votes = min(t.votes + 1, VOTES)
    elif t.votes > 0:
        t.votes -= 1
    else:
        t.label = label


@inner_kernel
def _second_sight(t: Any, dx: float, dy: float) -> float:
    """Returns how far aside a detection is of an object seen once that drove on along its heading.

    dx, dy: m from the track to the detection. GATE is added, so that it counts as farther than all within
    a gate; inf where it cannot be that object.
    """
    c, s = np.cos(t.heading), np.sin(t.heading)
    ahead, aside = c * dx + s * dy, abs(c * dy - s * dx)
    if not 0.0 < ahead < V_FIRST * t.unseen or aside > 0.5 * GATE:
        return np.inf
    return float(GATE + aside)


@inner_kernel
def _distances(tracks: NDArray[np.void], count: int, x: Floats, y: Floats, age: float) -> Floats:
    """Returns (m, count) m from each detection to each track where they may be one, else inf.

    age: s (<= 0) of the detections from now.
    """
    distance = np.full((len(x), count), np.inf)
    for j in range(len(x)):
        for i in range(count):
            t = tracks[i]
            dx, dy = x[j] - t.x - age * t.vx, y[j] - t.y - age * t.vy
            d = np.hypot(dx, dy)
            if d >= GATE and t.hits == 1:
                d = _second_sight(t, dx, dy)
            if d < 2.0 * GATE:
                distance[j, i] = d
    return distance


@inner_kernel
def _bury(tracks: NDArray[np.void], count: int, dt: float, confirm: int, coast: float) -> int:
    """Removes tracks that were not seen for too long, closing the gaps; returns how many are left.

    Confirmed ones go after `coast` s, others after a cycle of dt s.
    """
    kept = 0
    for i in range(count):
        t = tracks[i]
        patience = coast if t.hits >= confirm else 0.5 * dt
        if t.unseen <= patience + 1e-9:
            if kept != i:
                tracks[kept] = tracks[i]
            kept += 1
    return kept


@kernel
def _update(
    tracks: NDArray[np.void],
    count: int,
    next_id: int,
    dt: float,
    age: float,
    pose: Floats,
    objects: Floats,
    classes: NDArray[np.int64],
    confirm: int,
    coast: float,
) -> tuple[int, int]:
    """Moves all tracks through one cycle and returns their new count and the next free id.

    Predicts, associates nearest first, corrects, removes lost tracks and begins new ones. objects (m, 5):
    x, y, heading, length, width seen from the car at `pose` (odometry) `age` s ago (<= 0).
    """
    _predict(tracks, count, dt)
    m = objects.shape[0]
    c, s = np.cos(pose[2]), np.sin(pose[2])
    x, y = np.empty(m), np.empty(m)
    for j in range(m):
        x[j] = pose[0] + c * objects[j, 0] - s * objects[j, 1]
        y[j] = pose[1] + s * objects[j, 0] + c * objects[j, 1]
    distance = _distances(tracks, count, x, y, age)
    taken = np.zeros(m, np.bool_)
    for _ in range(min(m, count)):
        best, best_j, best_i = np.inf, -1, -1
        for j in range(m):
            for i in range(count):
                if distance[j, i] < best:
                    best, best_j, best_i = distance[j, i], j, i
        if best_j < 0:
            break
        taken[best_j] = True
        distance[best_j, :] = np.inf
        distance[:, best_i] = np.inf
        t = tracks[best_i]
        if best < GATE:
            _correct(t, x[best_j], y[best_j], age)
        else:
            _start_moving(t, x[best_j], y[best_j], age)
        row = objects[best_j]
        _shape(t, pose[2] + row[2], row[3], row[4], classes[best_j])
        t.hits += 1
        t.unseen = 0.0
    kept = _bury(tracks, count, dt, confirm, coast)
    for j in range(m):
        if taken[j] or kept == tracks.shape[0]:
            continue
        t = tracks[kept]
        t.id, next_id = next_id, next_id + 1
        t.x, t.y, t.vx, t.vy = x[j], y[j], 0.0, 0.0
        t.p_xx, t.p_xv, t.p_vv = SIGMA_MEASURED**2, 0.0, SIGMA_SPEED_FIRST**2
        t.heading = pose[2] + objects[j, 2]
        t.length, t.width = objects[j, 3], objects[j, 4]
        t.label, t.votes, t.hits, t.unseen = classes[j], 1, 1, 0.0
        kept += 1
    return kept, next_id
