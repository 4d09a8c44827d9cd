"""What a driving channel reports each cycle (C-020): arrays, and masks for absence."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.vocabulary import LightState


class ChannelFrame(NamedTuple):
    """One channel's ego and world at one cycle; world frame, SI, 2-D.

    `plan` begins at the ego's place. n objects; predictions have p points each. Shapes are given
    as polygons relative to the object's own position and heading.

    Attributes:
        t: s, time of the cycle.
        ego: (5,) x, y, heading, vx, vy.
        ego_polygon: (k, 2).
        plan: (m, 3) x, y, t relative to `t`; (0, 3) when there is none.
        objects: (n, 5) x, y, heading, vx, vy.
        polygons: (n, k, 2), rows beyond polygon_size are NaN.
        polygon_size: (n,).
        predictions: (n, p, 2).
        prediction_t: (p,) relative to `t`.
        ids: (n,) -1: this channel gives no identity.
        classes: (n,) SemanticClass, -1: unknown.
    """

    t: float
    ego: Floats
    ego_polygon: Floats
    plan: Floats
    objects: Floats
    polygons: Floats
    polygon_size: NDArray[np.int64]
    predictions: Floats
    prediction_t: Floats
    ids: NDArray[np.int64]
    classes: NDArray[np.int64]


class TruthFrame(NamedTuple):
    """The true world at one cycle, for evaluation only: no indicator or rule may read it (C-021).

    Same conventions as `ChannelFrame`; `mu` is the friction available at an actor's tyres.
    """

    t: float  # s
    ego: Floats  # (5,) x, y, heading, vx, vy
    ego_polygon: Floats  # (k, 2)
    ego_mu: float
    actors: Floats  # (n, 5) x, y, heading, vx, vy
    polygons: Floats  # (n, k, 2), rows beyond polygon_size are NaN
    polygon_size: NDArray[np.int64]  # (n,)
    ids: NDArray[np.int64]  # (n,)
    classes: NDArray[np.int64]  # (n,) SemanticClass
    mu: Floats  # (n,)


class Decision(NamedTuple):
    """Which channel drives from `t` on, and why."""

    t: float  # s
    driving: str
    reason: str
    scores: tuple[float, ...]  # safety score per channel, NaN: not evaluated


class Context(NamedTuple):
    """Words about the drive from `t` on: route, weather, map, versions."""

    t: float  # s
    entries: dict[str, str]


class Due(NamedTuple):
    """Everything up to t has been said: a live source says so, and the cycle is judged at once."""

    t: float  # s


class Cycle(NamedTuple):
    """One step of the evaluation grid: what each channel last said, in the recording's order."""

    k: int
    t: float  # s, time of the grid
    frames: tuple[ChannelFrame | None, ...]  # None: nothing fresh enough
    driving: int | None = None  # index of the driving channel, None: not recorded
    truth: TruthFrame | None = None


class ChannelView(NamedTuple):
    """What a channel's own sensors deliver in a cycle: all that its stack receives (decision C-1).

    Objects were measured at `t_seen` and are given in the ego's frame of that moment.
    """

    t: float  # s
    ego: Floats  # (5,) x, y, heading by localisation; speed, yaw rate by odometry
    t_seen: float  # s, <= t
    objects: Floats  # (n, 5) x, y, heading, length, width
    classes: NDArray[np.int64]  # (n,) SemanticClass
    lights: Mapping[int, LightState]  # by signal id: those whose head is in sight
