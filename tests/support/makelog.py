"""Small logs for tests: a straight drive along x, unless told otherwise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from skidpad.core.frames import RadarPoints, SensorFrame
from skidpad.core.geometry import Pose
from skidpad.core.states import (
    ActorStates,
    ActorTable,
    ContactEvent,
    EgoEstimate,
    LaneInvasion,
    StackReport,
    VehicleCommand,
    WorldTruth,
)
from skidpad.core.vocabulary import LightState, Supervision
from skidpad.recording.run.log import LogHeader, RunLog
from skidpad.recording.run.ticks import TickLog

DT = 0.05


def actor_table(n: int, length: float = 4.0, width: float = 2.0) -> ActorTable:
    return ActorTable(
        names=("ego", *(f"car {i}" for i in range(1, n))),
        types=("mini",) * n,
        kind=np.zeros(n, np.uint8),
        length=np.full(n, length),
        width=np.full(n, width),
        height=np.full(n, 1.5),
        rgb=np.zeros((n, 3), np.uint8),
    )


def states(rows: Sequence[dict[str, float]]) -> ActorStates:
    """One dict of fields per actor; what is not named is zero, and everybody is present."""
    s = ActorStates.empty(len(rows))
    s.present[:] = True
    for i, row in enumerate(rows):
        for name, value in row.items():
            getattr(s, name)[i] = value
    return s


def world(
    tick: int,
    rows: Sequence[dict[str, float]],
    table: ActorTable,
    contacts: tuple[ContactEvent, ...] = (),
    invasions: tuple[LaneInvasion, ...] = (),
    lights: dict[int, LightState] | None = None,
) -> WorldTruth:
    n = len(rows)
    mu = np.full((n, 4), 0.9)
    return WorldTruth(
        tick, table, states(rows), mu, np.zeros((n, 5)), lights or {}, contacts, invasions
    )


def frame(truth: WorldTruth, **fields: Any) -> SensorFrame:
    s = truth.states
    speed = float(np.hypot(s.vx[0], s.vy[0]))
    ego = EgoEstimate(s.pose(0), speed, 0.0, 0.0, 0.0, (speed,) * 4, 1)
    return SensorFrame(truth.tick, ego, {}, {}, RadarPoints.none(), {}, **fields)


def drive(
    n_ticks: int,
    rows: Callable[[int], Sequence[dict[str, float]]],
    report: Callable[[int], StackReport | None] = lambda _k: None,
    supervision: Callable[[int], Supervision] = lambda _k: Supervision.NONE,
    contacts: Sequence[ContactEvent] = (),
    invasions: Sequence[LaneInvasion] = (),
    extra: Callable[[TickLog, int], None] = lambda _log, _k: None,
    table: ActorTable | None = None,
    map_hash: str = "straight",
) -> RunLog:
    """A log of `n_ticks`, from functions of the tick."""
    table = table or actor_table(len(rows(0)))
    header = LogHeader(map="test", map_hash=map_hash, dt=DT, about={"config": "2", "seed": "7"})
    log = TickLog(table, header, "clear-noon", capacity=4)
    for k in range(n_ticks):
        extra(log, k)
        truth = world(
            k,
            rows(k),
            table,
            tuple(c for c in contacts if c.tick == k),
            tuple(i for i in invasions if i.tick == k),
        )
        log.append(truth, frame(truth), VehicleCommand(0.1, 0.2, 0.3), report(k), supervision(k))
    return log.finish()


def pose(x: float) -> Pose:
    return Pose(x, 0.0)
