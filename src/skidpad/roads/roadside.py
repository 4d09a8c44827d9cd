"""What stands beside the road: read by sensors (scene) and by the engine (collision segments)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray


class BarrierKind(IntEnum):
    """Kinds of obstacles along a road."""

    GUARDRAIL = 0
    WALL = 1
    KERB = 2
    FENCE = 3


@dataclass(frozen=True, slots=True)
class Barrier:
    """A linear obstacle along a polyline."""

    kind: BarrierKind
    points: NDArray[np.float64]  # (k, 3) foot line
    height: float  # m


class Shape(IntEnum):
    """What fills a box; a camera and a ray see the shape, contacts and object lists the box."""

    BOX = 0
    BLOCK = 1  # a building with rows of windows and a flat roof
    HOUSE = 2  # one with windows and a gable roof along its length
    POST = 3  # round
    CROWN = 4  # of a broad-leaved tree
    CONE = 5  # of a conifer
    LAMP = 6  # a lantern, which shines at night
    HEDGE = 7
    WOOD = 8  # the edge of a wood
    SHELTER = 9  # of a bus stop
    CAR = 10  # parked
    FENCE = 11
    SIGN = 12  # a plate whose variant is its number of corners


UNPAINTED = (150, 140, 130)  # of buildings, whose colour no file says


@dataclass(frozen=True, slots=True)
class Box:
    """A building, a gantry leg or beam, a pole, a sign plate: an upright box."""

    label: int  # SemanticClass
    x: float
    y: float
    z: float  # foot
    yaw: float
    length: float
    width: float
    height: float
    solid: bool = True  # hit by vehicles
    rgb: tuple[int, int, int] = (128, 128, 128)
    shape: Shape = Shape.BOX  # of generated scenery; boxes of a file are boxes
    variant: int = 0  # of the shape: which windows, which roof


@dataclass(frozen=True, slots=True)
class SignalHead:
    """A traffic light's head with three lamps, top down red, yellow, green."""

    signal: int  # OpenDRIVE signal id
    x: float
    y: float
    z: float  # centre of the middle lamp
    heading: float  # of the traffic that looks at it
    lamp_diameter: float = 0.3


@dataclass(frozen=True, slots=True)
class ParkingSpace:
    """A place for one parked car."""

    x: float
    y: float
    z: float
    yaw: float
    length: float
    width: float


@dataclass(frozen=True, slots=True)
class Bridge:
    """A stretch of a road that leads over a bridge."""

    road: int  # OpenDRIVE id
    s_from: float  # m along the road
    s_to: float
    lanes: tuple[int, int] | None = None  # least and greatest lane id; None: all


@dataclass(frozen=True, slots=True)
class Roadside:
    """All of it for one map."""

    barriers: tuple[Barrier, ...] = ()
    boxes: tuple[Box, ...] = ()
    heads: tuple[SignalHead, ...] = ()
    crosswalks: tuple[NDArray[np.float64], ...] = ()  # (k, 3) polygons
    parking: tuple[ParkingSpace, ...] = ()
    bridges: tuple[Bridge, ...] = ()
