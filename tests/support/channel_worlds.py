"""Small worlds seen by driving channels, for tests: everything moves at constant velocity."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from skidpad.core.channels import ChannelFrame, TruthFrame
from skidpad.core.maths.randomness import stream

CAR = np.array([[2.25, 0.9], [-2.25, 0.9], [-2.25, -0.9], [2.25, -0.9]])
STEP = 0.1


@dataclass(frozen=True)
class Eyes:
    """How one channel sees the world."""

    name: str
    noise: float = 0.0  # m, standard deviation per axis of objects
    ego_noise: float = 0.0  # m
    blind: tuple[int, ...] = ()  # objects that it never sees
    plan_length: float = 3.0  # s
    ego_offset: dict[float, tuple[float, float]] = field(default_factory=dict)  # from time on


def frame(
    t: float,
    ego: tuple[float, float, float, float, float],
    objects: np.ndarray | list = (),
    *,
    plan: np.ndarray | None = None,
    plan_length: float = 3.0,
    prediction_length: float = 3.0,
    ids: list[int] | None = None,
    classes: list[int] | None = None,
) -> ChannelFrame:
    """A frame whose plan and predictions go straight on; objects (n, 5)."""
    objects = np.asarray(objects, dtype=float).reshape(-1, 5)
    n = len(objects)
    ahead = np.arange(round(plan_length / 0.2) + 1) * 0.2
    if plan is None:
        plan = np.column_stack([ego[0] + ego[3] * ahead, ego[1] + ego[4] * ahead, ahead])
    t_prediction = np.arange(round(prediction_length / 0.2) + 1) * 0.2
    predictions = objects[:, None, :2] + objects[:, None, 3:] * t_prediction[None, :, None]
    return ChannelFrame(
        t=t,
        ego=np.array(ego, dtype=float),
        ego_polygon=CAR.copy(),
        plan=np.asarray(plan, dtype=float).reshape(-1, 3),
        objects=objects,
        polygons=np.repeat(CAR[None], n, axis=0).reshape(n, 4, 2),
        polygon_size=np.full(n, 4, dtype=np.int64),
        predictions=predictions,
        prediction_t=t_prediction,
        ids=np.array(ids if ids is not None else [-1] * n, dtype=np.int64),
        classes=np.array(classes if classes is not None else [14] * n, dtype=np.int64),
    )


def truth(t: float, ego: tuple[float, ...], actors: np.ndarray, mu: float = 0.9) -> TruthFrame:
    """The same world as it is."""
    actors = np.asarray(actors, dtype=float).reshape(-1, 5)
    n = len(actors)
    return TruthFrame(
        t=t,
        ego=np.array(ego, dtype=float),
        ego_polygon=CAR.copy(),
        ego_mu=mu,
        actors=actors,
        polygons=np.repeat(CAR[None], n, axis=0).reshape(n, 4, 2),
        polygon_size=np.full(n, 4, dtype=np.int64),
        ids=np.arange(n, dtype=np.int64),
        classes=np.full(n, 14, dtype=np.int64),
        mu=np.full(n, mu),
    )


@dataclass(frozen=True)
class World:
    """Ego and objects (x, y, heading, vx, vy) at t = 0, each at constant velocity."""

    ego: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 10.0, 0.0)
    objects: np.ndarray = field(default_factory=lambda: np.zeros((0, 5)))
    mu: float = 0.9

    def at(self, t: float) -> tuple[np.ndarray, np.ndarray]:
        ego = np.array(self.ego)
        ego[:2] += ego[3:] * t
        objects = np.array(self.objects, dtype=float).reshape(-1, 5)
        objects[:, :2] += objects[:, 3:] * t
        return ego, objects


def seen(world: World, eyes: Eyes, t: float, seed: int = 1) -> ChannelFrame:
    """What `eyes` report at `t`."""
    rng = stream(seed, eyes.name, round(t * 1000))
    ego, objects = world.at(t)
    keep = [i for i in range(len(objects)) if i not in eyes.blind]
    objects = objects[keep]
    objects[:, :2] += rng.normal(0.0, 1.0, (len(keep), 2)) * eyes.noise
    ego[:2] += rng.normal(0.0, 1.0, 2) * eyes.ego_noise
    for since, offset in eyes.ego_offset.items():
        if t >= since:
            ego[:2] += offset
    return frame(t, tuple(ego), objects, plan_length=eyes.plan_length, ids=keep)


def traffic(n: int, seed: int = 3) -> np.ndarray:
    """n cars in three lanes around the origin, (n, 5)."""
    rng = stream(seed, "traffic")
    lane = rng.integers(-1, 2, n) * 3.5
    x = rng.permutation(n) * 12.0 - 6.0 * n + 6.0
    v = rng.uniform(8.0, 12.0, n)
    return np.column_stack([x, lane, np.zeros(n), v, np.zeros(n)])


@dataclass
class Listed:
    """A recording in memory, with the interface of one on disk."""

    channels: tuple[str, ...]
    rows: list

    def __post_init__(self) -> None:
        from skidpad.recording.channels.mcap_files import Losses

        self.losses = Losses()

    def messages(self):
        from skidpad.recording.channels.mcap_files import Message

        for channel, item in self.rows:
            yield Message(channel, item.t, item)


def drive(world: World, eyes: tuple[Eyes, ...], duration: float, with_truth: bool = True) -> Listed:
    """Everything that `eyes` report in `duration` seconds, each 0.1 s."""
    rows: list = []
    for k in range(round(duration / STEP) + 1):
        t = k * STEP
        rows += [(i, seen(world, e, t)) for i, e in enumerate(eyes)]
        if with_truth:
            ego, objects = world.at(t)
            rows.append((None, truth(t, tuple(ego), objects, world.mu)))
    return Listed(tuple(e.name for e in eyes), rows)
