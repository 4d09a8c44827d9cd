"""Truth by true states and, with hindsight, the path that was driven (C-212, decision C-3)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle, TruthFrame
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import HazardType, SemanticClass
from skidpad.evidence.channels.judging.truth.marks import (
    Mark,
    TrueHazard,
    World,
    lasting,
    merge_marks,
    offsets,
)

BRAKE_LEADER = 6.0  # m/s^2, decision C-3
REACTION_TIME = 1.0  # s
MIN_DURATION = 0.5  # s
V_EGO_MIN = 2.0  # m/s
REACH = 80.0  # m of driven path before and after the ego that is looked at
VEHICLES = {
    int(c)
    for c in (
        SemanticClass.CAR, SemanticClass.TRUCK, SemanticClass.BUS, SemanticClass.TRAIN,
        SemanticClass.MOTORCYCLE, SemanticClass.BICYCLE, SemanticClass.RIDER, SemanticClass.NONE,
    )
}  # fmt: skip


def simulator_truth(cycles: Sequence[Cycle], channels: Sequence[str]) -> list[TrueHazard]:
    """Returns hazards by true states; [] when the recording holds none."""
    known = [c for c in cycles if c.truth is not None]
    marks = lasting(tail_marks(known, 0.0), MIN_DURATION)
    marks.extend(_position_errors(known, channels))
    return merge_marks(marks, World.SIM)


def tail_marks(cycles: Sequence[Cycle], spare: float) -> list[Mark]:
    """Returns marks of vehicles that follow so closely that at most `spare` m would be left in braking.

    Only in cycles with a truth in which the ego drives more than V_EGO_MIN.
    """
    path = _DrivenPath([c.truth for c in cycles if c.truth is not None])
    marks: list[Mark] = []
    for k, cycle in enumerate(cycles):
        truth = cycle.truth
        if truth is not None and np.hypot(*truth.ego[3:]) > V_EGO_MIN:
            marks.extend(_mark_tailgating(k, cycle.t, truth, path, cycle.frames, spare))
    return marks


class _DrivenPath:
    """The path that the ego's centre drove in the whole recording."""

    def __init__(self, truths: Sequence[TruthFrame]) -> None:
        self.xy = np.array([t.ego[:2] for t in truths]).reshape(-1, 2)
        steps = np.hypot(*np.diff(self.xy, axis=0).T) if len(self.xy) > 1 else np.zeros(0)
        self.s = np.concatenate([[0.0], np.cumsum(steps)])

    def around(self, k: int) -> tuple[shapely.LineString | None, float]:
        """Returns the path from REACH before to REACH after cycle k, and at how many m on it the ego is.

        (None, 0.0) where the ego stands throughout.
        """
        first = int(np.searchsorted(self.s, self.s[k] - REACH))
        last = int(np.searchsorted(self.s, self.s[k] + REACH, side="right"))
        moved = np.concatenate([[True], np.diff(self.s[first:last]) > 1e-3])
        points = self.xy[first:last][moved]
        if len(points) < 2:
            return None, 0.0
        return shapely.LineString(points), float(self.s[k] - self.s[first])


def _mark_tailgating(
    k: int,
    t: float,
    truth: TruthFrame,
    path: _DrivenPath,
    frames: Sequence[ChannelFrame | None],
    spare: float,
) -> list[Mark]:
    """Returns a mark per vehicle on the driven path that would have at most `spare` m left in braking.

    k: number of the cycle among those with truth; t: its time in s.
    """
    near = _near(truth, spare)
    line, s_ego = path.around(k) if near.size else (None, 0.0)
    if line is None:
        return []
    front, rear, half_width = _extent(truth.ego_polygon)
    corridor = line.buffer(half_width, cap_style="flat")
    v_ego = float(np.hypot(*truth.ego[3:]))
    marks = []
    for i in near:
        if int(truth.classes[i]) not in VEHICLES and truth.classes[i] != -1:
            continue
        shape = footprint(truth.polygons[i, : truth.polygon_size[i]], truth.actors[i])
        if not shape.intersects(corridor):
            continue
        s = line.project(shapely.Point(truth.actors[i, :2]))
        ahead = line.interpolate(min(s + 0.5, line.length))
        back = line.interpolate(max(s - 0.5, 0.0))
        tangent = np.array([ahead.x - back.x, ahead.y - back.y])
        tangent /= max(np.hypot(*tangent), 1e-9)
        v_other = max(float(truth.actors[i, 3:] @ tangent), 0.0)
        along = [
            float((np.array(p) - truth.actors[i, :2]) @ tangent) for p in shape.exterior.coords
        ]
        if s < s_ego:
            gap = (s_ego - rear) - (s + max(along))
            hazard, about = HazardType.EGO_TAILGATED, (v_ego, truth.ego_mu, v_other, truth.mu[i])
        else:
            gap = (s + min(along)) - (s_ego + front)
            hazard, about = HazardType.EGO_TAILGATING, (v_other, truth.mu[i], v_ego, truth.ego_mu)
        clearance = least_gap(max(gap, 0.0), *map(float, about))
        if clearance <= spare:
            marks.append(
                Mark(
                    hazard,
                    t,
                    f"actor {int(truth.ids[i])}",
                    seen=_is_reported(truth.actors[i], frames),
                    clearance=clearance,
                )
            )
    return marks


def _near(truth: TruthFrame, spare: float) -> NDArray[np.int64]:
    """Returns rows of actors within reach: no path is shorter than the straight line.

    A cyclist has no grip (NaN), and brakes as hard as any when it leads.
    """
    away = np.hypot(*(truth.actors[:, :2] - truth.ego[:2]).T)
    v = np.maximum(np.hypot(*truth.actors[:, 3:].T), np.hypot(*truth.ego[3:]))
    stop = v * REACTION_TIME + v * v / (2.0 * G * np.fmin(truth.mu, truth.ego_mu))
    sizes = _size(truth.polygons) + _size(truth.ego_polygon)
    return np.flatnonzero((away < REACH) & (away < stop + 2.0 * sizes + spare))


def _size(polygons: Floats) -> Floats:
    """Returns m from the reference point to the farthest corner, of polygons (..., k, 2)."""
    away = np.nan_to_num(np.hypot(polygons[..., 0], polygons[..., 1]))
    return np.asarray(away.max(axis=-1, initial=0.0), dtype=np.float64)


def least_gap(
    gap: float, v_leader: float, mu_leader: float, v_follower: float, mu_follower: float
) -> float:
    """Returns the least m between both when the leader brakes at 6 m/s^2; negative: they would overlap.

    The follower brakes at all its grip after REACTION_TIME; the leader at no more than its own (C-3).
    gap: m, bumper to bumper; speeds in m/s; mu: grip of each.
    """
    a_leader = min(BRAKE_LEADER, mu_leader * G)
    a_follower = mu_follower * G
    t_leader = v_leader / a_leader
    t_follower = REACTION_TIME + v_follower / a_follower
    t = np.linspace(0.0, max(t_leader, t_follower), 200)
    leader = v_leader * np.minimum(t, t_leader) - a_leader * np.minimum(t, t_leader) ** 2 / 2.0
    braked = np.clip(t - REACTION_TIME, 0.0, v_follower / a_follower)
    follower = v_follower * (np.minimum(t, REACTION_TIME) + braked) - a_follower * braked**2 / 2.0
    return float((gap + leader - follower).min())


def _is_reported(actor: Floats, frames: Sequence[ChannelFrame | None], within: float = 3.0) -> bool:
    """Returns whether any channel has an object within `within` m of the actor."""
    return any(
        bool((np.hypot(*(frame.objects[:, :2] - actor[:2]).T) < within).any())
        for frame in frames
        if frame is not None and len(frame.objects)
    )


def _position_errors(cycles: Sequence[Cycle], channels: Sequence[str]) -> list[Mark]:
    """Returns the marks of jumps and drifts of each channel's position against the true one."""
    marks = []
    for c, name in enumerate(channels):
        rows = [
            (cycle.t, *(frame.ego[:2] - truth.ego[:2]))
            for cycle in cycles
            if (frame := cycle.frames[c]) is not None and (truth := cycle.truth) is not None
        ]
        marks.extend(offsets(np.array(rows).reshape(-1, 3), name))
    return marks


def footprint(shape: Floats, state: Floats) -> shapely.Geometry:
    """Returns a polygon (k, 2) in its own frame as placed at the state (5,) in the world.

    Vertices that are not finite are left out; with fewer than three it is a point.
    """
    points = shape[np.isfinite(shape).all(axis=1)]
    if len(points) < 3:
        return shapely.Point(state[:2])
    turned = affinity.rotate(shapely.Polygon(points), state[2], origin=(0, 0), use_radians=True)
    return affinity.translate(turned, state[0], state[1])


def _extent(polygon: Floats) -> tuple[float, float, float]:
    """Returns front and rear from the reference point along the body, and half width, in m."""
    x, y = polygon[:, 0], polygon[:, 1]
    return float(x.max()), float(-x.min()), float(np.abs(y).max())
