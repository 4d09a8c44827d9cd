"""Who yields to whom where lanes of a junction cross or join, and where zebras lie: baked per map.

Rank first: a lane behind a stop or yield line yields to one without. Among equals a left turn
yields to a right turn and both to who goes straight (Vienna Convention, art. 16, 18).
"""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from skidpad.core.arrays import Floats
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, SignalKind, SignalTable
from skidpad.roads.roadside import Roadside

CONFLICT = np.dtype(
    [
        ("other", "i4"),  # lane
        ("start", "f8"),  # m along my lane where the shared area begins
        ("end", "f8"),
        ("other_start", "f8"),
        ("other_end", "f8"),
        ("yields", "?"),  # I have to
        ("joins", "?"),  # both lead into the same lane
    ],
    align=True,
)
ENTRY = np.dtype(  # per lane
    [
        ("first", "i4"),  # conflicts are first:first + size
        ("size", "i4"),
        ("junction", "i4"),  # in which the lane lies, else -1
        ("bend", "f8"),  # 1/m, the largest curvature of the lane
        ("line", "f8"),  # m along the lane: where one waits before the junction behind its end
        ("control", "i4"),  # of that line: Control
        ("signal", "i4"),  # row of SignalTable for a light, else -1
        ("zebra_first", "i4"),
        ("zebras", "i4"),
    ],
    align=True,
)
ZEBRA = np.dtype([("s", "f8"), ("zebra", "i4")], align=True)  # m along the lane: its near edge

NO_CONTROL, LIGHT, STOP, YIELD = range(4)
CLOSE = 2.6  # m between centre lines: two bodies of 2 m and what they keep to each other
CLOSE_FORK = 1.8  # m, where lanes part: the rear still follows
FAST = 17.0  # m/s; junctions of faster roads are joined by gap following alone
STRAIGHT = 0.5  # rad of turn that still counts as straight on
WAIT_MARGIN = 0.5  # m before the end of a lane without a line


class _Bake:
    """Collects conflicts of one map."""

    def __init__(self, samples: LaneSamples, lanes: LaneTable, signals: SignalTable) -> None:
        self.samples, self.lanes, self.signals = samples, lanes, signals
        self.found: dict[int, list[tuple[object, ...]]] = defaultdict(list)
        self.entry = np.zeros(len(lanes.first), dtype=ENTRY)
        self.entry["line"] = lanes.length - WAIT_MARGIN
        self.entry["junction"] = lanes.junction
        self.entry["bend"] = np.maximum.reduceat(np.abs(samples.curvature), lanes.first)
        self.entry["signal"] = -1
        kinds = {SignalKind.LIGHT: LIGHT, SignalKind.STOP: STOP, SignalKind.YIELD: YIELD}
        for row in range(len(signals.id)):
            control = kinds.get(SignalKind(int(signals.kind[row])))
            if control is not None:
                self.control(row, control)

    def control(self, row: int, control: int) -> None:
        """Notes where one waits for a signal; one on a junction's lane holds at the lanes before it.

        row: of the signal table; control: LIGHT, STOP or YIELD.
        """
        lane = int(self.signals.lane[row])
        within = int(self.lanes.junction[lane])
        waiting = [lane]
        if within >= 0:
            waiting = [p for p in self.before(lane) if self.lanes.junction[p] != within]
        for place in waiting:
            at = self.entry[place]
            at["control"], at["signal"] = control, row if control == LIGHT else -1
            if within < 0:
                at["line"] = self.signals.s[row]

    def points(self, lane: int) -> tuple[Floats, Floats]:
        """Returns (k, 2) places in m and (k,) s of a lane."""
        at = slice(self.lanes.first[lane], self.lanes.first[lane] + self.lanes.size[lane])
        p = self.samples
        return np.column_stack([p.x[at], p.y[at]]), p.s[at]

    def before(self, lane: int) -> set[int]:
        """Returns the indices of the lanes that lead to a lane."""
        start = self.lanes.prev_start
        return {int(i) for i in self.lanes.prev_lane[start[lane] : start[lane + 1]]}

    def after(self, lane: int) -> set[int]:
        """Returns the indices of the lanes that follow a lane."""
        start = self.lanes.next_start
        return {int(i) for i in self.lanes.next_lane[start[lane] : start[lane + 1]]}

    def whole(self, lane: int, forward: bool) -> list[int]:
        """Returns the lane and what goes on from it within its junction (else: what leads to it).

        Files cut one way through a junction into sections.
        """
        found = [lane]
        for here in found:  # which grows meanwhile
            near = self.after(here) if forward else self.before(here)
            same = {n for n in near if self.lanes.junction[n] == self.lanes.junction[lane]}
            found += sorted(same - set(found))
        return found

    def outside(self, lane: int, forward: bool) -> set[int]:
        """Returns the lanes behind (else: before) the junction to which the way over `lane` leads."""
        way = self.whole(lane, forward)
        near = (self.after(w) if forward else self.before(w) for w in way)
        return set().union(*near) - set(way)

    def standing(self, lane: int) -> tuple[int, int, int]:
        """Returns a key by which lanes of a junction are compared: what is smaller yields."""
        controls = [int(self.entry["control"][p]) for p in self.outside(lane, forward=False)]
        major = 0 if any(c in (STOP, YIELD) for c in controls) else 1
        first, last = (self.whole(lane, forward)[-1] for forward in (False, True))
        ends = self.lanes.first[first], self.lanes.first[last] + self.lanes.size[last] - 1
        h = self.samples.heading[list(ends)]
        turn = float((h[1] - h[0] + np.pi) % (2.0 * np.pi) - np.pi)
        manner = 2 if abs(turn) < STRAIGHT else 1 if turn < 0.0 else 0
        return major, manner, -lane

    def pair(self, a: int, b: int) -> None:
        """Notes in `found` what lanes a and b of one junction share, if anything, and which yields."""
        if b in self.whole(a, True) or b in self.whole(a, False):
            return  # sections of one way
        forks = bool(self.outside(a, False) & self.outside(b, False))
        joins = bool(self.outside(a, True) & self.outside(b, True))
        (pa, sa), (pb, sb) = self.points(a), self.points(b)
        near = np.hypot(*(pa[:, None] - pb[None]).transpose(2, 0, 1)) < (
            CLOSE_FORK if forks else CLOSE
        )
        if not near.any():
            return
        in_a, in_b = np.flatnonzero(near.any(axis=1)), np.flatnonzero(near.any(axis=0))
        span_a, span_b = (sa[in_a[0]], sa[in_a[-1]]), (sb[in_b[0]], sb[in_b[-1]])
        a_yields = not forks and self.standing(a) < self.standing(b)
        b_yields = not forks and not a_yields
        self.found[a].append((b, *span_a, *span_b, a_yields, joins))
        self.found[b].append((a, *span_b, *span_a, b_yields, joins))


def bake_priority(
    samples: LaneSamples, lanes: LaneTable, signals: SignalTable, roadside: Roadside | None
) -> tuple[NDArray[np.void], NDArray[np.void], NDArray[np.void], Floats]:
    """Returns (L,) ENTRY, (C,) CONFLICT, (Q,) ZEBRA, and (Z, 5) zebras as x, y, heading, half sizes."""
    bake = _Bake(samples, lanes, signals)
    limit = np.nan_to_num(samples.limit[lanes.first], nan=0.0)
    drivable = np.isin(lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP)) & (limit < FAST)
    for junction in np.unique(lanes.junction[lanes.junction >= 0]):
        members = np.flatnonzero((lanes.junction == junction) & drivable).tolist()
        for i, a in enumerate(members):
            for b in members[i + 1 :]:
                bake.pair(a, b)
    rows: list[tuple[object, ...]] = []
    for lane in range(len(lanes.first)):
        bake.entry["first"][lane], bake.entry["size"][lane] = len(rows), len(bake.found[lane])
        rows += bake.found[lane]
    boxes = _zebras(roadside)
    zebras = _zebra_rows(bake, boxes)
    return bake.entry, np.array(rows, dtype=CONFLICT), zebras, boxes


def _zebras(roadside: Roadside | None) -> Floats:
    """Returns (Z, 5) centre, heading across the street, half length along it and half width."""
    rows = []
    for polygon in () if roadside is None else roadside.crosswalks:
        p = polygon[:4, :2]
        if len(p) < 3:  # a line or a point: no area that somebody could walk on
            continue
        u, v = p[1] - p[0], p[2] - p[1]
        if np.hypot(*u) < np.hypot(*v):
            u, v = v, u
        rows.append(
            (*p.mean(axis=0), np.arctan2(u[1], u[0]), np.hypot(*u) / 2.0, np.hypot(*v) / 2.0)
        )
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def _zebra_rows(bake: _Bake, boxes: Floats) -> NDArray[np.void]:
    """Returns where each drivable lane meets each zebra (ZEBRA); writes their numbers into the entries."""
    rows: list[tuple[float, int]] = []
    near = _zebras_near(bake, boxes)
    for lane in range(len(bake.lanes.first)):
        bake.entry["zebra_first"][lane] = len(rows)
        for z in near.get(lane, ()):
            x, y, h, half_l, half_w = boxes[z].tolist()
            points, s = bake.points(lane)
            d = points - (x, y)
            along = d @ (np.cos(h), np.sin(h))
            across = d @ (-np.sin(h), np.cos(h))
            inside = np.flatnonzero((np.abs(along) < half_l) & (np.abs(across) < half_w))
            if len(inside):
                rows.append((float(s[inside[0]]), z))
        bake.entry["zebras"][lane] = len(rows) - int(bake.entry["zebra_first"][lane])
    return np.array(rows, dtype=ZEBRA)


def _zebras_near(bake: _Bake, boxes: Floats) -> dict[int, list[int]]:
    """Returns, by drivable lane, the zebras within whose corners' distance it has a sample, ascending."""
    near: dict[int, list[int]] = defaultdict(list)
    if not len(boxes):
        return near
    drivable = np.isin(bake.lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP))
    rows = np.flatnonzero(drivable[bake.samples.lane])
    plan = cKDTree(np.column_stack((bake.samples.x[rows], bake.samples.y[rows])))
    reach = np.hypot(boxes[:, 3], boxes[:, 4])
    for z, met in enumerate(plan.query_ball_point(boxes[:, :2], reach)):
        for lane in np.unique(bake.samples.lane[rows[met]]).tolist():
            near[lane].append(z)
    return near
