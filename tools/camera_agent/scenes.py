"""Scenes to learn from: the ego anywhere about its lane, others anywhere around it, in clear weather.

Places are drawn, not driven, so that states from which a driver must recover are as frequent as good
ones; that is what DAgger (Ross, Gordon and Bagnell, AISTATS 2011) collects by driving.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, hypot, pi, sin

import numpy as np
from numpy.typing import NDArray

from skidpad.campaign.dataset import label_of
from skidpad.core.states import ActorStates, ActorTable
from skidpad.physics.presets import preset
from skidpad.physics.types import EGO_TYPE, vehicle_types
from skidpad.roads.bundled import load_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.sensors.suite import PixelSettings, PixelSuite
from skidpad.stack.camera.codes import AHEAD, Label
from skidpad.stack.camera.eyes import CAMERAS, images_of

MAPS = ("straight", "figure8", "town")  # the motorway is held out
SHARES = (0.35, 0.5, 0.15)
WEATHERS = ("clear-noon", "rain_0", "clear-sunrise")
OTHERS = 7
SCENES_PER_CAST = 60  # with the same vehicles
OFFSET, HEADING = 0.55, 0.05  # deviations from the lane's middle in m and its direction in rad
WILD, WILD_OFFSET, WILD_HEADING = 0.25, 1.5, 0.15  # share of scenes far from it, uniform
A_SPREAD = 2.0  # m/s^2, deviation of the ego's acceleration, which pitches it
LEAD_SHARE, LEAD_NEAR, LEAD_FAR = 0.65, 1.0, 85.0  # m, bumper to bumper
SPUN = 0.12  # share of others that stand in any direction
FAR_BEHIND, FAR_AHEAD = 15.0, 90.0  # m


@dataclass(frozen=True, slots=True)
class Sample:
    """One scene."""

    images: tuple[NDArray[np.uint8], ...]
    label: Label


def samples(n: int, seed: int) -> Iterator[Sample]:
    """n scenes; maps and vehicles change every few."""
    rng = np.random.default_rng(seed)
    made = 0
    while made < n:
        map = load_map(str(rng.choice(MAPS, p=SHARES)))
        weather = preset(str(rng.choice(WEATHERS)))
        table = _cast(rng)
        suite = PixelSuite(
            map, table, CAMERAS, weather, PixelSettings(seed=int(rng.integers(1 << 30)))
        )
        for tick in range(SCENES_PER_CAST):
            scene = _scene(map, table, rng)
            if scene is None:
                continue
            states, place = scene
            seen = suite.observe(tick, states, {}, rng.random(len(table)) < 0.3)
            label = label_of(map, table, states, place)
            if label is None:
                continue
            images = tuple(image.copy() for image in images_of(seen.images))
            yield Sample(images, label)
            made += 1
            if made == n:
                return


def _cast(rng: np.random.Generator) -> ActorTable:
    """The ego and others of random types and paint."""
    kinds = vehicle_types()
    names = sorted(kinds)
    types = [EGO_TYPE, *(str(rng.choice(names)) for _ in range(OTHERS))]
    chosen = [kinds[t] for t in types]
    return ActorTable(
        tuple(f"vehicle-{i}" for i in range(len(types))),
        tuple(types),
        np.array([t.actor_kind for t in chosen], dtype=np.uint8),
        np.array([t.length for t in chosen]),
        np.array([t.width for t in chosen]),
        np.array([t.height for t in chosen]),
        rng.integers(0, 256, (len(types), 3)).astype(np.uint8),
    )


def _scene(
    map: RoadMap, table: ActorTable, rng: np.random.Generator
) -> tuple[ActorStates, LanePoint] | None:
    """Everybody's place, and where on its lane the ego is; None at a road's end."""
    driving = np.isin(map.lanes.kind, (LaneKind.DRIVING, LaneKind.RAMP))
    rows = np.flatnonzero(driving[map.samples.lane])
    row = int(rng.choice(rows))
    lane = int(map.samples.lane[row])
    place = map.at(lane, float(map.samples.s[row]))
    if map.ahead(place, AHEAD[-1]) is None:
        return None
    states = ActorStates.empty(len(table))
    wild = rng.random() < WILD
    offset = rng.uniform(-WILD_OFFSET, WILD_OFFSET) if wild else rng.normal(0.0, OFFSET)
    turn = rng.uniform(-WILD_HEADING, WILD_HEADING) if wild else rng.normal(0.0, HEADING)
    a = float(np.clip(rng.normal(0.0, A_SPREAD), -9.0, 4.0))
    _put(states, 0, place, offset, turn)
    states.pitch[0] = -float(map.samples.grade[row]) - 0.0035 * a
    states.roll[0] = float(map.samples.bank[row]) + rng.normal(0.0, 0.005)
    for i in range(1, len(table)):
        _other(map, table, states, place, i, rng)
    return states, place


def _other(
    map: RoadMap, table: ActorTable, states: ActorStates, place: LanePoint, i: int,
    rng: np.random.Generator,
) -> None:  # fmt: skip
    """One of the others: the first is often the lead; those that would touch the ego stay away."""
    if i > 1 and rng.random() < 0.3:
        return
    if i == 1:
        if rng.random() > LEAD_SHARE:
            return
        gap = LEAD_NEAR * (LEAD_FAR / LEAD_NEAR) ** rng.random()
        if rng.random() < 0.5:
            gap = rng.uniform(LEAD_NEAR, LEAD_FAR)
        distance = gap + 0.5 * float(table.length[0] + table.length[i])
        side, spread = 0, 0.3
    else:
        distance, side = rng.uniform(-FAR_BEHIND, FAR_AHEAD), int(rng.choice((-1, 1, -2, 2)))
        spread = 0.3 if rng.random() < 0.7 else 1.2
    point: LanePoint | None = place
    for _ in range(abs(side)):
        point = None if point is None else (map.left(point) if side > 0 else map.right(point))
    if point is None:
        return
    point = map.ahead(point, distance) if distance >= 0.0 else map.behind(point, -distance)
    if point is None:
        return
    turn = rng.uniform(-pi, pi) if rng.random() < SPUN else rng.normal(0.0, 0.04)
    _put(states, i, point, rng.normal(0.0, spread), turn)
    reach = 0.5 * (hypot(table.length[0], table.width[0]) + hypot(table.length[i], table.width[i]))
    near = hypot(states.x[i] - states.x[0], states.y[i] - states.y[0])
    if near < (
        reach if abs(side) > 0 and spread > 0.5 else 0.5 * (table.length[0] + table.length[i])
    ):
        states.present[i] = side != 0 and near > 0.5 * (table.width[0] + table.width[i]) + 0.6


def _put(states: ActorStates, i: int, point: LanePoint, offset: float, turn: float) -> None:
    c, s = cos(point.heading), sin(point.heading)
    states.x[i], states.y[i] = point.x - offset * s, point.y + offset * c
    states.z[i], states.yaw[i] = point.z, point.heading + turn
    states.present[i] = True
