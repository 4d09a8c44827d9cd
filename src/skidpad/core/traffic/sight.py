"""What a human driver sees: the view that a driver model is given instead of sensor data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import LightState


class RoadLook(str, Enum):
    """What the road surface looks like from the driver's seat; its friction cannot be seen."""

    DRY = "dry"
    WET = "wet"
    FLOODED = "flooded"  # water stands on it
    SNOW = "snow"
    ICE = "ice"


class SeenActors(NamedTuple):
    """The n road users in sight, as arrays of shape (n,); world frame, SI."""

    actor: NDArray[np.int64]  # index, the same while it stays in the world
    kind: NDArray[np.uint8]  # ActorKind
    x: Floats  # centre of the footprint
    y: Floats
    z: Floats
    yaw: Floats
    vx: Floats  # as perceived: closing too slow to be noticed reads as following at equal speed
    vy: Floats
    length: Floats
    width: Floats
    braking: NDArray[np.bool_]  # brake lamps are on


@dataclass(frozen=True, slots=True)
class DriverView:
    """One tick of a human driver's view.

    The own car's motion is felt at once. Everything else is what was in line of sight and range
    `age` seconds ago: the driver's reaction time.
    """

    tick: int
    pose: Pose  # own car, now
    speed: float  # m/s along the body, now
    yaw_rate: float  # rad/s, now
    age: float  # s, of all that follows
    actors: SeenActors
    lights: Mapping[int, LightState]  # by signal id, of the heads in sight
    road: RoadLook
    visibility: float  # m at which the lamps and outlines of others are seen
