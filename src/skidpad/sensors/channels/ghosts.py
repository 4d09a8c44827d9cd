"""Objects that a channel reports and that are not there."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.maths.randomness import stream
from skidpad.core.vocabulary import SemanticClass

NEAREST, FARTHEST = 8.0, 40.0  # m from the ego
CLASSES = (SemanticClass.CAR, SemanticClass.PEDESTRIAN)
SIZES = {SemanticClass.CAR: (4.5, 1.9), SemanticClass.PEDESTRIAN: (0.5, 0.6)}  # m


@dataclass(frozen=True, slots=True, kw_only=True)
class GhostSettings:
    """How often ghosts appear and how long they stay."""

    rate: float  # 1/h
    life: float  # s, mean of an exponential distribution

    def scale(self, factor: float) -> GhostSettings:
        """Returns the settings with ghosts `factor` times as often."""
        return replace(self, rate=factor * self.rate)


@dataclass(slots=True)
class _Ghost:
    x: float  # m, world: a ghost stands, like the roadside objects that cause it
    y: float
    heading: float
    label: SemanticClass
    left: float  # s


class Ghosts:
    """Ghosts of one channel; their places depend on the ego's, not on the world."""

    def __init__(self, settings: GhostSettings, channel: str, seed: int, dt: float) -> None:
        self.settings, self.dt = settings, dt
        self._rng = stream(seed, f"{channel}/objects/ghosts")
        self.alive: list[_Ghost] = []

    def update(self, pose: tuple[float, float, float]) -> tuple[Floats, NDArray[np.int64]]:
        """Returns (m, 5) x, y, heading, length, width in the ego's frame, and (m,) classes, a cycle on.

        pose: x, y in m and yaw in rad of the ego. To be called once per cycle.
        """
        chance, distance, bearing, turn, kind, life = self._rng.random(6).tolist()
        for ghost in self.alive:
            ghost.left -= self.dt
        self.alive = [g for g in self.alive if g.left > 0.0]
        if chance < self.settings.rate / 3600.0 * self.dt:
            r = NEAREST + distance * (FARTHEST - NEAREST)
            a = pose[2] + (bearing - 0.5) * pi  # in front of the ego
            self.alive.append(
                _Ghost(
                    pose[0] + r * cos(a),
                    pose[1] + r * sin(a),
                    2.0 * pi * turn,
                    CLASSES[int(kind * len(CLASSES))],
                    -self.settings.life * float(np.log1p(-life)),
                )
            )
        c, s = cos(pose[2]), sin(pose[2])
        rows = [
            (
                c * (g.x - pose[0]) + s * (g.y - pose[1]),
                -s * (g.x - pose[0]) + c * (g.y - pose[1]),
                (g.heading - pose[2] + pi) % (2.0 * pi) - pi,
                *SIZES[g.label],
            )
            for g in self.alive
        ]
        labels = np.array([g.label for g in self.alive], dtype=np.int64)
        return np.array(rows, dtype=np.float64).reshape(-1, 5), labels
