"""Small worlds for the sensor tests: a straight road, an oval with an overpass, some cars."""

from __future__ import annotations

from itertools import count

import numpy as np

from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind, SemanticClass
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, Marking
from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside, SignalHead

LANES = (-1, -2, -3, -4)
WIDTH = 3.5


def lanes_along(x, y, z, heading, lanes=LANES, road=1, bank=0.0, grade=0.0):
    """Samples and table of parallel lanes along a reference line sampled every metre."""
    n = len(x)
    offsets = {-l: (abs(l) - 0.5) * WIDTH for l in lanes}
    cols = {name: [] for name in LaneSamples._fields}
    for i, lane in enumerate(lanes):
        right = offsets[-lane]
        marks = (
            Marking.SOLID if lane == lanes[0] else Marking.BROKEN,
            Marking.SOLID if lane == lanes[-1] else Marking.BROKEN,
        )
        values = {
            "x": x + right * np.sin(heading),
            "y": y - right * np.cos(heading),
            "z": z,
            "heading": heading,
            "s": np.arange(n, dtype=float),
            "s_road": np.arange(n, dtype=float),
            "curvature": np.zeros(n),
            "grade": np.full(n, grade),
            "bank": np.full(n, bank),
            "width": np.full(n, WIDTH),
            "limit": np.full(n, 36.0),
            "marking_left": np.full(n, int(marks[0]), dtype=np.uint8),
            "marking_right": np.full(n, int(marks[1]), dtype=np.uint8),
            "lane": np.full(n, i, dtype=np.int32),
        }
        for key, value in values.items():
            cols[key].append(value)
    samples = LaneSamples(**{k: np.concatenate(v) for k, v in cols.items()})
    total = len(lanes)

    def ints(*v):
        return np.array(v, dtype=np.int32)

    table = LaneTable(
        road=np.full(total, road, dtype=np.int32),
        lane_id=np.array(lanes, dtype=np.int32),
        section=np.zeros(total, dtype=np.int32),
        first=np.arange(total, dtype=np.int32) * n,
        size=np.full(total, n, dtype=np.int32),
        length=np.full(total, n - 1.0),
        kind=np.full(total, int(LaneKind.DRIVING), dtype=np.uint8),
        junction=np.full(total, -1, dtype=np.int32),
        left=np.arange(-1, total - 1, dtype=np.int32),
        right=np.array([*range(1, total), -1], dtype=np.int32),
        opposite=np.full(total, -1, dtype=np.int32),
        next_start=np.zeros(total + 1, dtype=np.int32),
        next_lane=ints(),
        prev_start=np.zeros(total + 1, dtype=np.int32),
        prev_lane=ints(),
    )
    return samples, table


NOTHING = Roadside()
SERIAL = count()


class World:
    """What the sensors read of a road map."""

    def __init__(self, samples, lanes, roadside=NOTHING, name="test"):
        self.samples, self.lanes, self.roadside = samples, lanes, roadside
        self.name, self.content_hash = name, f"{name}-{next(SERIAL)}"


def straight(length=1000, boxes=(), heads=(), rails=True):
    """A level road along x from 0, its lanes at y < 0."""
    x = np.arange(length + 1, dtype=float)
    zero = np.zeros_like(x)
    samples, lanes = lanes_along(x, zero, zero, zero)
    foot = np.stack([x, zero, zero], axis=1)
    barriers = (
        (
            Barrier(BarrierKind.GUARDRAIL, foot + np.array([0, 1.0, 0]), 0.75),
            Barrier(BarrierKind.GUARDRAIL, foot + np.array([0, -15.5, 0]), 0.75),
        )
        if rails
        else ()
    )
    return World(samples, lanes, Roadside(barriers, tuple(boxes), tuple(heads)), "straight")


def figure_eight(scale=420.0, rise=8.0):
    """A lemniscate-like loop of about 3 km with a crossing `rise` m below itself."""
    t = np.linspace(0, 2 * np.pi, 40001)
    x, y = scale * 1.6 * np.cos(t), scale * 0.55 * np.sin(2 * t)
    z = rise / 2 * (1 + np.cos(t - np.pi / 2))
    s = np.concatenate([[0], np.cumsum(np.hypot(np.diff(x), np.diff(y)))])
    at = np.arange(0, s[-1], 1.0)
    x, y, z = (np.interp(at, s, a) for a in (x, y, z))
    heading = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
    samples, lanes = lanes_along(x, y, z, heading)
    normal = np.stack([-np.sin(heading), np.cos(heading), 0 * x], axis=1)
    line = np.stack([x, y, z], axis=1)
    barriers = (
        Barrier(BarrierKind.GUARDRAIL, line + 1.0 * normal, 0.75),
        Barrier(BarrierKind.GUARDRAIL, line - 15.5 * normal, 0.75),
    )
    boxes, heads = [], []
    for k, i in enumerate(range(100, len(at), 480)):
        p, n, h = line[i], normal[i], heading[i]
        grey = (110, 114, 118)
        for side in (1.6, -16.2):
            q = p + side * n
            boxes.append(Box(int(SemanticClass.POLE), *q, h, 0.3, 0.3, 7.0, rgb=grey))
        m = p - 7.3 * n
        boxes.append(
            Box(int(SemanticClass.POLE), m[0], m[1], m[2] + 6.6, h, 0.4, 18.0, 0.4, False, grey)
        )
        if k % 2:
            for lane in range(4):
                q = p - (lane + 0.5) * WIDTH * n
                heads.append(SignalHead(k, q[0], q[1], q[2] + 5.8, h))
        else:
            q = p - 10 * n
            boxes.append(
                Box(
                    int(SemanticClass.TRAFFIC_SIGN),
                    q[0],
                    q[1],
                    q[2] + 5.5,
                    h,
                    0.1,
                    6.0,
                    2.2,
                    False,
                    (20, 70, 160),
                )
            )
        for j in range(3):
            q = p + (45 + 30 * j) * n
            boxes.append(
                Box(
                    int(SemanticClass.BUILDING),
                    q[0],
                    q[1],
                    q[2] - 2,
                    h,
                    22,
                    14,
                    9 + 5 * j,
                    rgb=((176, 150, 128), (190, 186, 176), (150, 120, 104))[j],
                )
            )
    return World(samples, lanes, Roadside(barriers, tuple(boxes), tuple(heads)), "eight")


PAINT = np.array(
    [(196, 34, 38), (30, 70, 160), (230, 230, 228), (40, 42, 46), (180, 184, 188), (214, 160, 40)],
    dtype=np.uint8,
)
DIMS = {
    ActorKind.CAR: (4.5, 1.85, 1.48),
    ActorKind.VAN: (5.9, 2.0, 2.5),
    ActorKind.TRUCK: (9.0, 2.5, 3.6),
    ActorKind.BUS: (12.0, 2.55, 3.1),
    ActorKind.MOTORCYCLE: (2.2, 0.8, 1.6),
    ActorKind.BICYCLE: (1.8, 0.6, 1.7),
    ActorKind.PEDESTRIAN: (0.4, 0.6, 1.75),
    ActorKind.PROP: (0.5, 0.5, 0.8),
}


def table_of(kinds):
    """An ego of the published size, then actors of these kinds."""
    kinds = list(kinds)
    dims = np.array([(3.86, 1.97, 1.48), *(DIMS[k] for k in kinds)], dtype=float)
    n = len(kinds) + 1
    return ActorTable(
        names=tuple(f"a{i}" for i in range(n)),
        types=tuple("t" for _ in range(n)),
        kind=np.array([0, *map(int, kinds)], dtype=np.uint8),
        length=dims[:, 0].copy(),
        width=dims[:, 1].copy(),
        height=dims[:, 2].copy(),
        rgb=PAINT[np.arange(n) % len(PAINT)],
    )


def states_at(poses, speeds=None):
    """States with rows (x, y, z, yaw) and speeds along the heading."""
    poses = np.asarray(poses, dtype=float)
    states = ActorStates.empty(len(poses))
    for i, (x, y, z, yaw) in enumerate(poses):
        states.x[i], states.y[i], states.z[i], states.yaw[i] = x, y, z, yaw
        v = 0.0 if speeds is None else speeds[i]
        states.vx[i], states.vy[i] = v * np.cos(yaw), v * np.sin(yaw)
    states.present[:] = True
    return states


def traffic(world, start=200, others=20):
    """Ego at a sample, and cars, vans, trucks around it on all lanes."""
    n = int(world.lanes.size[0])
    kinds = [
        (
            ActorKind.CAR,
            ActorKind.CAR,
            ActorKind.VAN,
            ActorKind.CAR,
            ActorKind.TRUCK,
            ActorKind.BUS,
        )[i % 6]
        for i in range(others)
    ]
    gaps = [0, *(15 * (i + 1) - (0 if i < 15 else 320) for i in range(others))]
    lane = [1, *((i * 2 + 1) % 4 for i in range(others))]
    rows = []
    for gap, l in zip(gaps, lane, strict=True):
        k = l * n + (start + gap) % n
        s = world.samples
        rows.append((s.x[k], s.y[k], s.z[k], s.heading[k]))
    return table_of(kinds), states_at(rows, [20.0] * len(rows))
