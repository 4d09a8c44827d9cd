"""Upright boxes as arrays, so that a line is held against all of them at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.simulation.carla_server.actors.registry import Box
from skidpad.simulation.carla_server.protocol.wire import Vector


@dataclass(frozen=True, slots=True, eq=False)
class Boxes:
    """Boxes and whose they are, ready to be asked about many lines."""

    boxes: list[Box]
    owners: list[int]  # actors; 0: the map's
    pose: Floats  # (n, 4) x, y, z, yaw
    half: Floats  # (n, 3)

    @classmethod
    def of(cls, found: Iterable[tuple[int, Box]]) -> Boxes:
        """Makes boxes from pairs of owner and box."""
        pairs = list(found)
        pose = [(p.x, p.y, p.z, p.yaw) for _, (p, _) in pairs]
        half = [h for _, (_, h) in pairs]
        return cls(
            [box for _, box in pairs],
            [owner for owner, _ in pairs],
            np.array(pose).reshape(-1, 4),
            np.array(half).reshape(-1, 3),
        )

    def spans(self, start: Vector, way: Vector) -> tuple[Floats, Floats]:
        """Returns (n,) where start + t way enters each box and (n,) where it leaves it, as t (slab test).

        It misses those that it would leave before it enters; t may be negative.
        """
        c, s = np.cos(self.pose[:, 3]), np.sin(self.pose[:, 3])

        def turn_vector(v: Floats) -> Floats:
            return np.stack((v[:, 0] * c + v[:, 1] * s, v[:, 1] * c - v[:, 0] * s, v[:, 2]), axis=1)

        begin = turn_vector(np.array(start) - self.pose[:, :3])
        along = turn_vector(np.broadcast_to(np.array(way), begin.shape))
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        one, other = (-self.half - begin) / along, (self.half - begin) / along
        return np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
