"""Two cameras, a radar, and cars of one size at given places."""

from __future__ import annotations

from math import radians

import numpy as np

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality, RadarSpec
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind

ROOF = CameraSpec("roof", Modality.DEPTH, 800, 600, 90.0, Pose(1.5, 0.0, 2.4))
BUMPER = CameraSpec("bumper", Modality.DEPTH, 400, 300, 100.0, Pose(2.3, 0, 0.4, pitch=radians(20)))
RADAR = RadarSpec("radar", Pose(2.0, 0.0, 1.0))


def world(*others, ego=(0.0, 0.0, 0.0)):
    """Cars of 4.5 x 1.8 x 1.5 m at (x, y, z, yaw), behind the ego at index 0."""
    places = np.array([(*ego, 0.0), *others], dtype=float)
    n = len(places)
    states = ActorStates.empty(n)
    states.x[:], states.y[:], states.z[:], states.yaw[:] = places.T
    states.present[:] = True
    table = ActorTable(
        names=tuple(f"a{i}" for i in range(n)),
        types=("car",) * n,
        kind=np.full(n, ActorKind.CAR, dtype=np.uint8),
        length=np.full(n, 4.5),
        width=np.full(n, 1.8),
        height=np.full(n, 1.5),
        rgb=np.zeros((n, 3), dtype=np.uint8),
    )
    return table, states
