"""Truth in the world that the channels report, ghosts included (C-212, C-218, decisions C-4, R-9).

A vehicle is a hazard while a channel's plan and the prediction of the object sweep into each other
within 3 s, the object being on the plan's path: inside its corridor, heading along it. Positions
are one when two channels differ by more than both their alert limits. All of it for half a second.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame, Cycle
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.judging.truth.corridor import Corridor, Trail
from skidpad.evidence.channels.judging.truth.marks import (
    Mark,
    TrueHazard,
    World,
    lasting,
    merge_marks,
)

SWEEP_TIME = 3.0  # s, decision C-4
SWEEP_STEP = 0.25  # s; the hull of two steps tells where to look closer
SUBSTEPS = 5  # of a step, 0.05 s apart: hulls alone would join cars that follow each other closely
PERSISTENCE = 0.5  # s, decision R-9
# m, alert limits of localisation on freeways, the wider ones (Reid et al. 2019, SAE 12-02-03-0012).
# Two channels that are both within theirs differ by less than twice as much.
ALERT_ACROSS, ALERT_ALONG = 0.57, 1.40


def world_model_truth(cycles: Sequence[Cycle], channels: Sequence[str]) -> list[TrueHazard]:
    """Hazards in the union of all channels' worlds, ghosts included (C-218)."""
    marks: list[Mark] = []
    trails = [Trail() for _ in channels]
    for cycle in cycles:
        for trail, frame in zip(trails, cycle.frames, strict=True):
            if frame is not None and np.isfinite(frame.ego).all():
                trail.add(frame.ego)
                if len(frame.plan) >= 2:
                    marks.extend(_sweeps(cycle, frame, trail, channels))
        marks.extend(_apart(cycle, channels))
    return merge_marks(lasting(marks, PERSISTENCE), World.CHANNELS)


def _apart(cycle: Cycle, channels: Sequence[str]) -> list[Mark]:
    """Returns a mark per pair of channels of which at least one must be beyond an alert limit."""
    marks = []
    for a in range(len(channels)):
        for b in range(a + 1, len(channels)):
            one, two = cycle.frames[a], cycle.frames[b]
            if one is None or two is None:
                continue
            dx, dy = (two.ego[:2] - one.ego[:2]).tolist()
            c, s = np.cos(one.ego[2]), np.sin(one.ego[2])
            along, across = abs(c * dx + s * dy), abs(c * dy - s * dx)
            if along > 2.0 * ALERT_ALONG or across > 2.0 * ALERT_ACROSS:  # never with NaN
                name = f"{channels[a]}+{channels[b]}"
                marks.append(Mark(HazardType.INCONSISTENT_LOCALISATION, cycle.t, name, "apart"))
    return marks


def _sweeps(cycle: Cycle, ego: ChannelFrame, trail: Trail, channels: Sequence[str]) -> list[Mark]:
    """Returns marks of objects on the path of `ego` where its plan and their prediction meet.

    Objects of all channels count, the ego's own among them.
    """
    plan = ego.plan[np.isfinite(ego.plan).all(axis=1)]
    plan_t = np.concatenate([[0.0], plan[:, 2]])
    plan_xy = np.vstack([ego.ego[:2], plan[:, :2]])
    corridor = Corridor(trail.points, ego.ego, plan[:, :2], ego.ego_polygon)
    times = np.arange(0.0, min(SWEEP_TIME, plan_t[-1]) + 1e-9, SWEEP_STEP)
    whole = _along(times, plan_t, plan_xy)
    ego_reach = _radius(ego.ego_polygon) + _stride(whole)
    marks = []
    for b, frame in enumerate(cycle.frames):
        if frame is None or len(frame.objects) == 0:
            continue
        on_path, ahead = corridor.places(frame.objects, frame.polygons)
        for i in np.flatnonzero(on_path):
            state = frame.objects[i]
            # an object's own end may be earlier
            said = np.isfinite(frame.predictions[i]).all(axis=1)
            p_t = np.concatenate([[0.0], frame.prediction_t[said]])
            n = int(np.searchsorted(times, p_t[-1] + 1e-9, side="right"))
            theirs = _along(times[:n], p_t, np.vstack([state[:2], frame.predictions[i, said]]))
            mine = whole[:n]
            shape = frame.polygons[i, : frame.polygon_size[i]]
            reach = ego_reach + _radius(shape) + _stride(theirs)
            near = np.flatnonzero(np.hypot(*(mine - theirs).T) < reach)
            if near.size and _meet(
                _Sweep.of(ego.ego_polygon, ego.ego, mine), _Sweep.of(shape, state, theirs), near
            ):
                hazard = HazardType.EGO_TAILGATING if ahead[i] else HazardType.EGO_TAILGATED
                marks.append(Mark(hazard, cycle.t, _object_name(channels[b], frame, int(i))))
    return marks


def _object_name(channel: str, frame: ChannelFrame, i: int) -> str:
    """Returns "CHANNEL ID" of an object, "" where it has no id."""
    return f"{channel} {int(frame.ids[i])}" if frame.ids[i] >= 0 else ""


def _along(times: Floats, path_t: Floats, path: Floats) -> Floats:
    """Returns (n, 2) the points of a path at `times`, linear between and constant beyond its ends."""
    return np.column_stack([np.interp(times, path_t, path[:, k]) for k in (0, 1)])


def _stride(path: Floats) -> float:
    """Returns the longest step of a path (n, 2) in m; 0 for one point."""
    return float(np.hypot(*(path[1:] - path[:-1]).T).max(initial=0.0))


class _Sweep(NamedTuple):
    """A footprint along a path of n steps."""

    corners: Floats  # (n, vertices, 2)
    moves: Floats  # (n, 2) m to the next step; none after the last

    @classmethod
    def of(cls, shape: Floats, state: Floats, path: Floats) -> _Sweep:
        """Returns the footprint `shape` along a path (n, 2), turned into the direction of motion.

        state: of the mover now; its heading is kept where it hardly moves and in reverse.
        """
        points = shape[np.isfinite(shape).all(axis=1)]
        if len(points) == 0:
            points = np.zeros((1, 2))
        moves = np.diff(path, axis=0, append=path[-1:])
        turns = moves.copy()
        if len(path) > 1:
            turns[-1] = turns[-2]
        heading = np.where(np.hypot(*turns.T) > 0.1, np.arctan2(turns[:, 1], turns[:, 0]), state[2])
        heading = np.where(np.cos(heading - state[2]) < 0.0, heading + np.pi, heading)  # in reverse
        c, s = np.cos(heading)[:, None], np.sin(heading)[:, None]
        x = path[:, :1] + c * points[:, 0] - s * points[:, 1]
        y = path[:, 1:] + s * points[:, 0] + c * points[:, 1]
        return cls(np.stack([x, y], axis=2), moves)

    def between(self, steps: NDArray[np.int64]) -> NDArray[np.object_]:
        """Returns (m,) hulls of the footprint at each of `steps` together with the step after it."""
        after = np.minimum(steps + 1, len(self.corners) - 1)
        return _hulls(np.concatenate([self.corners[steps], self.corners[after]], axis=1))

    def at(self, steps: NDArray[np.int64], share: float) -> NDArray[np.object_]:
        """Returns (m,) footprints when a share of the way from each of `steps` to the next is done."""
        return _hulls(self.corners[steps] + share * self.moves[steps][:, None])


def _hulls(corners: Floats) -> NDArray[np.object_]:
    """Returns a convex hull per row of corners (n, k, 2)."""
    owner = np.repeat(np.arange(len(corners)), corners.shape[1])
    hulls: NDArray[np.object_] = shapely.convex_hull(
        shapely.multipoints(corners.reshape(-1, 2), indices=owner)
    )
    return hulls


def _meet(mine: _Sweep, theirs: _Sweep, near: NDArray[np.int64]) -> bool:
    """Returns whether two footprints overlap at any time within the steps `near`."""
    steps = near[shapely.intersects(mine.between(near), theirs.between(near))]
    return steps.size > 0 and any(
        bool(shapely.intersects(mine.at(steps, share), theirs.at(steps, share)).any())
        for share in np.linspace(0.0, 1.0, SUBSTEPS + 1)
    )


def _radius(polygon: Floats) -> float:
    """Returns the largest distance in m of a vertex from the origin; 0 for none."""
    return float(np.nan_to_num(np.hypot(*polygon.T)).max(initial=0.0))
