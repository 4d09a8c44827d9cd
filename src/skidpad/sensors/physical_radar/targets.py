"""How strongly things return a radar's wave: radar cross sections by class and aspect, as data.

Vehicles: 3GPP TR 38.901 Release 19, table 7.9.2.1-5 (vehicle with several scattering points, mean
11.25 dBsm over all directions), a vehicle of 5.0 x 2.0 x 1.6 m (TR 37.885, type 2). Pedestrians: table
7.9.2.1-1, human. Both were read in `getSigmaRCS.m` (NIST) and in `parameters.py` of Sionna RT; the
report covers 0.5 to 100 GHz. Larger and smaller faces return in proportion to their area, bicycles
return what pedestrians do, all else that stands returns its area: assumptions, as is a guardrail whose
posts stand 4 m apart and return 1 m^2 for each metre of height.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorTable
from skidpad.core.vocabulary import ActorKind
from skidpad.roads.roadside import Roadside

FRONT, LEFT, BACK, RIGHT = range(4)  # sides, counter-clockwise from the front
# by side: phi_center deg, phi_3dB deg, theta_center deg, theta_3dB deg, G_max dBsm, sigma_max dB
LOBES = np.array(
    [
        [0.0, 40.54, 71.75, 29.13, 14.99, 14.91],
        [90.0, 26.90, 79.70, 44.42, 20.60, 20.52],
        [180.0, 36.32, 79.65, 36.73, 13.90, 13.82],
        [270.0, 26.90, 79.70, 44.42, 20.60, 20.52],
    ]
)
LOBE_SIZE = (5.0, 2.0, 1.6)  # m, of the vehicle that the lobes are of
VEHICLE_SPREAD = 3.41  # dB, standard deviation of sigma_S, log-normal with mean 1
HUMAN, HUMAN_SPREAD = -1.37, 3.94  # dBsm, dB
MIDDLE = 0.8  # m, highest middle of a face that returns: a tall vehicle returns from its frame
POST_GAP, POST = 4.0, 1.0  # m between posts of a rail, m^2 per m of height
PEOPLE = (ActorKind.PEDESTRIAN, ActorKind.BICYCLE)


class Sites(NamedTuple):
    """Points that stand and return; arrays (n,)."""

    x: Floats
    y: Floats
    z: Floats
    section: Floats  # m^2
    nx: Floats  # of the face's normal; 0, 0: it returns to all sides
    ny: Floats


class Targets(NamedTuple):
    """What each actor returns; arrays (n,)."""

    lobed: NDArray[np.bool_]  # by the lobes of vehicles
    area: Floats  # (n, 4) of each side over that of the lobes' vehicle; of others: m^2
    spread: Floats  # dB
    rise: Floats  # m, of the point over the road


def targets_of(table: ActorTable) -> Targets:
    """Returns what the actors of a run return."""
    kinds = [ActorKind(k) for k in table.kind]
    people = np.array([k in PEOPLE for k in kinds])
    lobed = np.array([k not in (*PEOPLE, ActorKind.PROP) for k in kinds])
    across, along = table.width * table.height, table.length * table.height
    area = np.column_stack([across, along, across, along])
    length, width, height = LOBE_SIZE
    area[lobed] /= np.array([width, length, width, length]) * height
    area[people] = 10.0 ** (HUMAN / 10.0)
    spread = np.where(people, HUMAN_SPREAD, VEHICLE_SPREAD)
    return Targets(lobed, area, spread, np.minimum(table.height / 2.0, MIDDLE))


def sites_of(roadside: Roadside) -> Sites:
    """Returns the posts of all barriers and the sides of all boxes beside a road."""
    rows: list[tuple[float, ...]] = []
    for barrier in roadside.barriers:
        steps = np.hypot(*np.diff(barrier.points[:, :2], axis=0).T)
        at = np.concatenate([[0.0], np.cumsum(steps)])
        for s in np.arange(0.0, at[-1], POST_GAP):
            x, y, z = (float(np.interp(s, at, column)) for column in barrier.points.T)
            rows.append((x, y, z + barrier.height / 2.0, POST * barrier.height, 0.0, 0.0))
    for box in roadside.boxes:
        for side in range(4):
            half, wide = (box.length, box.width) if side % 2 == 0 else (box.width, box.length)
            turn = box.yaw + side * np.pi / 2.0
            nx, ny = float(np.cos(turn)), float(np.sin(turn))
            x, y = box.x + nx * half / 2.0, box.y + ny * half / 2.0
            rows.append((x, y, box.z + box.height / 2.0, wide * box.height, nx, ny))
    return Sites(*np.array(rows, dtype=np.float64).reshape(-1, 6).T.copy())
