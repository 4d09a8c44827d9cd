"""What casts shadows: boxes of vehicles, and of what stands beside the road."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates, ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.roads.roadside import Box, Shape

DENSE = {Shape.CROWN: 0.85, Shape.CONE: 0.95, Shape.FENCE: 0.4, Shape.SHELTER: 0.6}  # others: 1


class Bodies(NamedTuple):
    """What casts shadows: boxes, arrays of shape (n,)."""

    x: Floats
    y: Floats
    z: Floats
    yaw: Floats
    length: Floats
    width: Floats
    height: Floats
    present: NDArray[np.bool_]
    lift: Floats  # m of the lower side above the ground
    round: NDArray[np.bool_]  # the crown of a tree: a disc throws its shadow
    dense: Floats  # share of the sun's light that does not pass through


def bodies_of(table: ActorTable, states: ActorStates) -> Bodies:
    """Returns the boxes of all actors but props."""
    present = states.present & (table.kind != ActorKind.PROP)
    return Bodies(
        states.x, states.y, states.z, states.yaw, table.length, table.width, table.height, present,
        np.zeros(len(table)), np.zeros(len(table), dtype=np.bool_), np.ones(len(table)),
    )  # fmt: skip


def join_bodies(*parts: Bodies) -> Bodies:
    """Returns the bodies of all parts as one table."""
    return Bodies(*(np.concatenate(field) for field in zip(*parts, strict=True)))


def standing(boxes: Sequence[Box]) -> Bodies:
    """Returns what stands beside the road as bodies.

    What stands on a post or a stem throws its shadow from there; other things over a road throw none.
    """

    def each(name: str) -> Floats:
        return np.array([getattr(b, name) for b in boxes], dtype=np.float64)

    foot: dict[tuple[float, float], float] = {}
    places = [(round(b.x, 1), round(b.y, 1)) for b in boxes]
    for place, box in zip(places, boxes, strict=True):
        foot[place] = min(box.z, foot.get(place, box.z))
    lift = [box.z - foot[place] for place, box in zip(places, boxes, strict=True)]
    return Bodies(
        each("x"), each("y"), each("z"), each("yaw"), each("length"), each("width"),
        each("height"), np.ones(len(boxes), dtype=np.bool_), np.array(lift, dtype=np.float64),
        np.array([b.shape in (Shape.CROWN, Shape.CONE) for b in boxes], dtype=np.bool_),
        np.array([DENSE.get(b.shape, 1.0) for b in boxes], dtype=np.float64),
    )  # fmt: skip
