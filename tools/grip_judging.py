"""How good the envelope's estimate of grip is: drives whose signals are kept, judged under other tyres.

One drive serves many estimators: the frames of the ego are kept, and each estimator reads them again with
its own errors of the bus and its own design's stiffness. The truth is only compared with.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.driving.loop import Moment, Sink
from skidpad.campaign.runs.run import run
from skidpad.core.arrays import Floats
from skidpad.core.run import RunSpec
from skidpad.core.setup import DT
from skidpad.core.states import EgoEstimate, VehicleCommand
from skidpad.envelope.envelope import AIR_ID, RAIN_ID
from skidpad.envelope.grip import STIFFNESS, GripEstimator, drive_at
from skidpad.envelope.sight import way_ahead
from skidpad.envelope.signals import BusModel, CarBus
from skidpad.roads.bundled import load_map
from skidpad.roads.queries import RoadMap

V_LEAST = 2.0  # m/s, below which nothing is judged
SURE = 0.3  # confidence from which an estimate counts as one
ALARM, MISSED = 0.6, 1.3  # of the true grip: below is a false alarm, above is too high
DROP = 0.6  # of the grip before, a fall that is to be noticed
APART = 10  # ticks between two false alarms


@dataclass(slots=True)
class KeptSignals(Sink):
    """What the car's sensors had to measure in each tick of a drive, and the true grip beside it."""

    map: RoadMap
    ego: list[EgoEstimate] = field(default_factory=list)
    commands: list[VehicleCommand] = field(default_factory=list)
    air: list[tuple[int, float]] = field(default_factory=list)
    grades: list[float] = field(default_factory=list)
    truth: list[float] = field(default_factory=list)

    def see(self, moment: Moment) -> None:
        """Keeps the signals and the true grip of one tick."""
        self.ego.append(moment.frame.ego)
        self.commands.append(moment.command)
        self.air.append((int(moment.frame.extra[RAIN_ID]), float(moment.frame.extra[AIR_ID])))
        way = way_ahead(self.map, moment.frame.ego.pose)
        self.grades.append(0.0 if way is None else way.grade)
        self.truth.append(float(np.nanmean(moment.truth.mu[0])))


@dataclass(frozen=True, slots=True)
class Estimates:
    """Per tick: (n,) true grip, careful value, confidence, speed in m/s; judged ticks alone count."""

    truth: Floats
    value: Floats
    confidence: Floats
    v: Floats

    @property
    def is_judged(self) -> NDArray[np.bool_]:
        """(n,) ticks in which the car moves and its signals told something."""
        judged: NDArray[np.bool_] = (self.v > V_LEAST) & (self.confidence >= SURE)
        return judged


def keep_signals(spec: RunSpec) -> KeptSignals:
    """Drives a run whose stack has the envelope's sensors, and keeps what its car could measure."""
    kept = KeptSignals(load_map(spec.course.map))  # type: ignore[union-attr]
    run(spec, sinks=(kept,))
    return kept


def estimate_again(
    kept: KeptSignals, share: float = 1.0, seed: int = 1, bus: BusModel | None = None
) -> Estimates:
    """Returns what an estimator says whose design's stiffness is `share` of the true dry one."""
    estimator = GripEstimator(DT, stiffness=STIFFNESS * share)
    car_bus = CarBus(seed, bus, estimator.car.steer_max)
    before, rows = VehicleCommand(), []
    kept_rows = zip(kept.ego, kept.commands, kept.air, kept.grades, strict=True)
    for ego, command, (stage, air_c), grade in kept_rows:
        drive = drive_at(estimator.car, before.throttle, ego.speed)
        grip = estimator.update(car_bus.read(ego, before, drive, grade), stage, air_c, grade)
        rows.append((grip.value, grip.confidence))
        before = command
    value, confidence = np.array(rows).T
    v = np.array([ego.speed for ego in kept.ego])
    return Estimates(np.array(kept.truth), value, confidence, v)


@dataclass(frozen=True, slots=True)
class GripJudgement:
    """How good estimates were over some drives."""

    error: (
        tuple[float, float, float] | None
    )  # 5, 50, 95 % of value over truth less 1; None: no information
    prior_share: float  # of the distance on the prior alone
    too_high: float  # share of the distance with more than 1.3 times the true grip
    alarms: int
    hours: float
    notice: tuple[float, ...]  # s to notice each fall of the grip; inf: not before the next change


def judge_estimates(drives: Sequence[Estimates], dt: float = DT) -> GripJudgement:
    """Returns the judgement over all drives of one kind."""
    ratio = np.concatenate([e.value[e.is_judged] / e.truth[e.is_judged] for e in drives])
    way = np.concatenate([np.maximum(e.v, 0.0) for e in drives])
    alone = np.concatenate([e.confidence < SURE for e in drives])
    high = np.concatenate([e.value > MISSED * e.truth for e in drives])
    total = max(float(way.sum()), 1e-9)
    five, half, most = np.quantile(ratio - 1.0, (0.05, 0.5, 0.95)) if len(ratio) else (0.0,) * 3
    return GripJudgement(
        (float(five), float(half), float(most)) if len(ratio) else None,
        float(way[alone].sum()) / total, float(way[high].sum()) / total,
        sum(_count_alarms(e) for e in drives), len(way) * dt / 3600.0,
        tuple(s for e in drives for s in _times_to_notice(e, dt)),
    )  # fmt: skip


def _count_alarms(e: Estimates) -> int:
    """Returns how often the estimate began to be far below the true grip; near ticks count once."""
    low = np.flatnonzero(e.is_judged & (e.value < ALARM * e.truth))
    return int((np.diff(low) > APART).sum() + 1) if len(low) else 0


def _times_to_notice(e: Estimates, dt: float) -> list[float]:
    """s from each fall of the true grip until the estimate is no longer 1.3 times too high."""
    n, times, i = len(e.truth), [], 1
    while i < n:
        before = e.truth[max(i - 20, 0)]
        if e.truth[i] > DROP * before or e.value[i] <= MISSED * e.truth[i]:
            i += 1
            continue
        end = next((j for j in range(i, n) if e.truth[j] > MISSED * e.truth[i]), n)
        seen = next((j for j in range(i, end) if e.value[j] <= MISSED * e.truth[j]), None)
        times.append(float("inf") if seen is None else (seen - i) * dt)
        i = max(end, i + 20)
    return times
