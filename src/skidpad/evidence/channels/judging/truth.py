"""Two truths about hazards, to judge the rules by (C-212, decisions C-3 and C-4).

Simulator truth knows true states and, with hindsight, the path that was driven. World-model truth
takes what the channels report as the world. Both use shapely and none of the code that the rules
or indicators use: an error there cannot hide itself here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely import affinity

from skidpad.core.channels import ChannelFrame, Cycle, TruthFrame
from skidpad.core.vocabulary import HazardType, SemanticClass

Floats = NDArray[np.float64]
G = 9.80665  # m/s^2
BRAKE_LEADER = 6.0  # m/s^2, decision C-3
REACTION_TIME = 1.0  # s
MIN_DURATION = 0.5  # s
V_EGO_MIN = 2.0  # m/s
REACH = 80.0  # m of driven path before and after the ego that is looked at
JUMP, JUMP_TIME = 1.0, 0.5  # m within s: a position that jumps
DRIFT = 2.0  # m: a position that is off
SWEEP_TIME = 3.0  # s, decision C-4
SWEEP_STEP = 0.25  # s; the hull of two steps tells where to look closer
SUBSTEPS = 5  # of a step, 0.05 s apart: hulls alone would join cars that follow each other closely
PAUSE = 2.0  # s, shorter pauses are one hazard (C-140)
VEHICLES = {
    int(c)
    for c in (
        SemanticClass.CAR, SemanticClass.TRUCK, SemanticClass.BUS, SemanticClass.TRAIN,
        SemanticClass.MOTORCYCLE, SemanticClass.BICYCLE, SemanticClass.RIDER, SemanticClass.NONE,
    )
}  # fmt: skip


class World(str, Enum):
    """Whose world a hazard is true in."""

    SIM = "sim"
    CHANNELS = "channels"


@dataclass(frozen=True, slots=True)
class TrueHazard:
    """A hazard that was there from t_start to t_end, in s."""

    hazard: HazardType
    t_start: float
    t_end: float
    world: World
    about: frozenset[str] = frozenset()  # objects or channels, by name
    kind: str = ""  # jump or drift of a position
    seen: bool = True  # False: no channel reported the object at any time


@dataclass(frozen=True, slots=True)
class _Mark:
    """A hazard in one cycle."""

    hazard: HazardType
    t: float
    about: str
    kind: str = ""
    seen: bool = True


def simulator_truth(cycles: Sequence[Cycle], channels: Sequence[str]) -> list[TrueHazard]:
    """Hazards by true states; empty when the recording holds none."""
    known = [c for c in cycles if c.truth is not None]
    path = _DrivenPath([c.truth for c in known if c.truth is not None])
    marks: list[_Mark] = []
    for k, cycle in enumerate(known):
        truth = cycle.truth
        if truth is not None and np.hypot(*truth.ego[3:]) > V_EGO_MIN:
            marks.extend(_tail_marks(k, cycle.t, truth, path, cycle.frames))
    marks = _lasting(marks, MIN_DURATION)
    marks.extend(_position_errors(known, channels))
    return _merged(marks, World.SIM)


class _DrivenPath:
    """The path that the ego's centre drove in the whole recording."""

    def __init__(self, truths: Sequence[TruthFrame]) -> None:
        self.xy = np.array([t.ego[:2] for t in truths]).reshape(-1, 2)
        steps = np.hypot(*np.diff(self.xy, axis=0).T) if len(self.xy) > 1 else np.zeros(0)
        self.s = np.concatenate([[0.0], np.cumsum(steps)])

    def around(self, k: int) -> tuple[shapely.LineString | None, float]:
        """The path from REACH before to REACH after cycle k, and where on it the ego is."""
        first = int(np.searchsorted(self.s, self.s[k] - REACH))
        last = int(np.searchsorted(self.s, self.s[k] + REACH, side="right"))
        moved = np.concatenate([[True], np.diff(self.s[first:last]) > 1e-3])
        points = self.xy[first:last][moved]
        if len(points) < 2:
            return None, 0.0
        return shapely.LineString(points), float(self.s[k] - self.s[first])


def _tail_marks(
    k: int, t: float, truth: TruthFrame, path: _DrivenPath, frames: Sequence[ChannelFrame | None]
) -> list[_Mark]:
    line, s_ego = path.around(k)
    near = np.flatnonzero(np.hypot(*(truth.actors[:, :2] - truth.ego[:2]).T) < REACH)
    if line is None or near.size == 0:
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
        if would_hit(max(gap, 0.0), *map(float, about)):
            marks.append(
                _Mark(
                    hazard, t, f"actor {int(truth.ids[i])}", seen=_reported(truth.actors[i], frames)
                )
            )
    return marks


def would_hit(
    gap: float, v_leader: float, mu_leader: float, v_follower: float, mu_follower: float
) -> bool:
    """Whether the follower hits a leader that brakes at 6 m/s^2 and reacts after 1 s (C-3).

    The follower then brakes at all its grip; the leader at no more than its own. gap in m.
    """
    a_leader = min(BRAKE_LEADER, mu_leader * G)
    a_follower = mu_follower * G
    t_leader = v_leader / a_leader
    t_follower = REACTION_TIME + v_follower / a_follower
    t = np.linspace(0.0, max(t_leader, t_follower), 200)
    leader = v_leader * np.minimum(t, t_leader) - a_leader * np.minimum(t, t_leader) ** 2 / 2.0
    braked = np.clip(t - REACTION_TIME, 0.0, v_follower / a_follower)
    follower = v_follower * (np.minimum(t, REACTION_TIME) + braked) - a_follower * braked**2 / 2.0
    return bool((gap + leader - follower).min() <= 0.0)


def _reported(actor: Floats, frames: Sequence[ChannelFrame | None], within: float = 3.0) -> bool:
    """Whether any channel has an object within `within` m of the actor."""
    return any(
        bool((np.hypot(*(frame.objects[:, :2] - actor[:2]).T) < within).any())
        for frame in frames
        if frame is not None and len(frame.objects)
    )


def _position_errors(cycles: Sequence[Cycle], channels: Sequence[str]) -> list[_Mark]:
    marks = []
    for c, name in enumerate(channels):
        rows = [
            (cycle.t, *(frame.ego[:2] - truth.ego[:2]))
            for cycle in cycles
            if (frame := cycle.frames[c]) is not None and (truth := cycle.truth) is not None
        ]
        marks.extend(_offsets(np.array(rows).reshape(-1, 3), name))
    return marks


def _offsets(rows: Floats, about: str) -> list[_Mark]:
    """Jumps and drifts of an offset given as rows of t, dx, dy."""
    rows = rows[np.isfinite(rows).all(axis=1)]
    marks = []
    for k, (t, dx, dy) in enumerate(rows):
        j = int(np.searchsorted(rows[:, 0], t - JUMP_TIME - 1e-6))
        change = np.hypot(rows[j:k, 1] - dx, rows[j:k, 2] - dy).max(initial=0.0)
        if change > JUMP:
            marks.append(_Mark(HazardType.INCONSISTENT_LOCALISATION, t, about, "jump"))
        elif np.hypot(dx, dy) > DRIFT:
            marks.append(_Mark(HazardType.INCONSISTENT_LOCALISATION, t, about, "drift"))
    return marks


def world_model_truth(cycles: Sequence[Cycle], channels: Sequence[str]) -> list[TrueHazard]:
    """Hazards in the union of all channels' worlds, ghosts included (C-218)."""
    marks: list[_Mark] = []
    for cycle in cycles:
        for frame in cycle.frames:
            if frame is not None and len(frame.plan) >= 2 and np.isfinite(frame.ego).all():
                marks.extend(_sweeps(cycle, frame, channels))
    for a in range(len(channels)):
        for b in range(a + 1, len(channels)):
            rows = [
                (cycle.t, *(one.ego[:2] - two.ego[:2]))
                for cycle in cycles
                if (one := cycle.frames[a]) is not None and (two := cycle.frames[b]) is not None
            ]
            marks.extend(_offsets(np.array(rows).reshape(-1, 3), f"{channels[a]}+{channels[b]}"))
    return _merged(marks, World.CHANNELS)


def _sweeps(cycle: Cycle, ego: ChannelFrame, channels: Sequence[str]) -> list[_Mark]:
    """Objects of any channel that the plan of `ego` and their prediction bring together."""
    plan = ego.plan[np.isfinite(ego.plan).all(axis=1)]
    plan_t = np.concatenate([[0.0], plan[:, 2]])
    plan_xy = np.vstack([ego.ego[:2], plan[:, :2]])
    marks = []
    for b, frame in enumerate(cycle.frames):
        if frame is None or len(frame.objects) == 0:
            continue
        times = np.arange(0.0, min(SWEEP_TIME, plan_t[-1]) + 1e-9, SWEEP_STEP)
        whole = _along(times, plan_t, plan_xy)
        ego_reach = _radius(ego.ego_polygon) + _stride(whole)
        for i, state in enumerate(frame.objects):
            if not np.isfinite(state).all():
                continue
            said = np.isfinite(frame.predictions[i]).all(
                axis=1
            )  # an object's own end may be earlier
            p_t = np.concatenate([[0.0], frame.prediction_t[said]])
            n = int(np.searchsorted(times, p_t[-1] + 1e-9, side="right"))
            theirs = _along(times[:n], p_t, np.vstack([state[:2], frame.predictions[i, said]]))
            mine = whole[:n]
            shape = frame.polygons[i, : frame.polygon_size[i]]
            reach = ego_reach + _radius(shape) + _stride(theirs)
            near = np.flatnonzero(np.hypot(*(mine - theirs).T) < reach)
            if near.size == 0:
                continue
            if _meet(
                _Sweep.of(ego.ego_polygon, ego.ego, mine), _Sweep.of(shape, state, theirs), near
            ):
                offset = state[:2] - ego.ego[:2]
                behind = offset @ [np.cos(ego.ego[2]), np.sin(ego.ego[2])] < 0.0
                hazard = HazardType.EGO_TAILGATED if behind else HazardType.EGO_TAILGATING
                marks.append(_Mark(hazard, cycle.t, _object_name(channels[b], frame, i)))
    return marks


def _object_name(channel: str, frame: ChannelFrame, i: int) -> str:
    return f"{channel} {int(frame.ids[i])}" if frame.ids[i] >= 0 else ""


def _along(times: Floats, path_t: Floats, path: Floats) -> Floats:
    return np.column_stack([np.interp(times, path_t, path[:, k]) for k in (0, 1)])


def _stride(path: Floats) -> float:
    """Longest step of a path, m."""
    return float(np.hypot(*(path[1:] - path[:-1]).T).max(initial=0.0))


class _Sweep(NamedTuple):
    """A footprint along a path of n steps."""

    corners: Floats  # (n, vertices, 2)
    moves: Floats  # (n, 2) m to the next step; none after the last

    @classmethod
    def of(cls, shape: Floats, state: Floats, path: Floats) -> _Sweep:
        """It turns into the direction of motion; where it hardly moves it keeps its heading."""
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
        """(m,) hulls of the footprint at each of `steps` together with the step after it."""
        after = np.minimum(steps + 1, len(self.corners) - 1)
        return _hulls(np.concatenate([self.corners[steps], self.corners[after]], axis=1))

    def at(self, steps: NDArray[np.int64], share: float) -> NDArray[np.object_]:
        """(m,) footprints when a share of the way to the next step is done."""
        return _hulls(self.corners[steps] + share * self.moves[steps][:, None])


def _hulls(corners: Floats) -> NDArray[np.object_]:
    owner = np.repeat(np.arange(len(corners)), corners.shape[1])
    hulls: NDArray[np.object_] = shapely.convex_hull(
        shapely.multipoints(corners.reshape(-1, 2), indices=owner)
    )
    return hulls


def _meet(mine: _Sweep, theirs: _Sweep, near: NDArray[np.int64]) -> bool:
    """Whether two footprints overlap at any time within the steps `near`."""
    steps = near[shapely.intersects(mine.between(near), theirs.between(near))]
    return steps.size > 0 and any(
        bool(shapely.intersects(mine.at(steps, share), theirs.at(steps, share)).any())
        for share in np.linspace(0.0, 1.0, SUBSTEPS + 1)
    )


def footprint(shape: Floats, state: Floats) -> shapely.Geometry:
    """A polygon (k, 2) in its own frame, placed at the state (5,) in the world."""
    points = shape[np.isfinite(shape).all(axis=1)]
    if len(points) < 3:
        return shapely.Point(state[:2])
    turned = affinity.rotate(shapely.Polygon(points), state[2], origin=(0, 0), use_radians=True)
    return affinity.translate(turned, state[0], state[1])


def _extent(polygon: Floats) -> tuple[float, float, float]:
    """Front and rear from the reference point along the body, and half width."""
    x, y = polygon[:, 0], polygon[:, 1]
    return float(x.max()), float(-x.min()), float(np.abs(y).max())


def _radius(polygon: Floats) -> float:
    return float(np.nan_to_num(np.hypot(*polygon.T)).max(initial=0.0))


def _lasting(marks: list[_Mark], duration: float) -> list[_Mark]:
    """Marks that belong to runs of at least `duration` for the same hazard and object."""
    kept: list[_Mark] = []
    runs: dict[tuple[HazardType, str], list[_Mark]] = {}

    def end(run: list[_Mark]) -> None:
        if run[-1].t - run[0].t >= duration - 1e-6:
            kept.extend(run)

    for mark in marks:
        key = mark.hazard, mark.about
        run = runs.setdefault(key, [])
        if run and mark.t - run[-1].t > 0.15:
            end(run)
            run = runs[key] = []
        run.append(mark)
    for run in runs.values():
        end(run)
    return kept


def _merged(marks: list[_Mark], world: World) -> list[TrueHazard]:
    """Marks of one hazard whose pause is under 2 s, as one (C-140, C-141)."""
    out: list[TrueHazard] = []
    for hazard in HazardType:
        group: list[_Mark] = []
        for mark in sorted((m for m in marks if m.hazard is hazard), key=lambda m: m.t):
            if group and mark.t - group[-1].t >= PAUSE - 1e-6:
                out.append(_hazard(group, world))
                group = []
            group.append(mark)
        if group:
            out.append(_hazard(group, world))
    return sorted(out, key=lambda h: (h.t_start, h.hazard.value))


def _hazard(group: list[_Mark], world: World) -> TrueHazard:
    kinds = {m.kind for m in group}
    return TrueHazard(
        group[0].hazard,
        group[0].t,
        group[-1].t,
        world,
        frozenset(m.about for m in group if m.about),
        "jump" if "jump" in kinds else "".join(kinds),
        any(m.seen for m in group),
    )
