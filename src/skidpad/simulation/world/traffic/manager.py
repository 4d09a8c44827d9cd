"""All background drivers of a run: set up once, decided in one kernel call per tick."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import hypot

import numpy as np
from numpy.typing import NDArray

from skidpad.core.constants import G
from skidpad.core.geometry import Pose, mps_from_kmh
from skidpad.core.randomness import stream, stream_key
from skidpad.core.setup import TrafficSetup
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import ActorKind, TrafficStart
from skidpad.physics.types import VehicleType
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.rows import Member, Shape
from skidpad.simulation.world.traffic.driver import drive_all
from skidpad.simulation.world.traffic.idm import A_CURVE, A_MAX, T_HEADWAY
from skidpad.simulation.world.traffic.network import Network, network
from skidpad.simulation.world.traffic.occupancy import Places, occupancy
from skidpad.simulation.world.traffic.path import begin
from skidpad.simulation.world.traffic.places import FreePlaces
from skidpad.simulation.world.traffic.priority import bake_priority
from skidpad.simulation.world.traffic.state import TRAIT, View, drivers
from skidpad.simulation.world.traffic.variety import vary

KERB = 0.5  # m beside the road from which a pedestrian in motion counts as on the zebra
AIR_DENSITY = 1.204  # kg/m^3 at 20 C
STUCK_TIME = 10.0  # s, decision M-7
PUT_BACK_NEAREST = 100.0  # m from the ego, decision M-7
PUT_BACK_SPEED = 0.8  # of the desired speed there
BUBBLE = 500.0  # m, random traffic lives within this distance of the ego
BUBBLE_NEAREST = 150.0  # m, respawns stay out of the ego's sight
CHECK_PERIOD = 20  # ticks between two looks at wrecks and the bubble


@lru_cache(maxsize=8)
def network_of(map: RoadMap) -> Network:
    """The drivers' view of a map, made once per process."""
    return network(map.samples, map.lanes, map.signals)


@lru_cache(maxsize=8)
def priority_of(
    map: RoadMap,
) -> tuple[NDArray[np.void], NDArray[np.void], NDArray[np.void], NDArray[np.float64]]:
    """Right of way on a map, baked once per process."""
    return bake_priority(map.samples, map.lanes, map.signals, map.roadside)


@dataclass(frozen=True, slots=True)
class Move:
    """A vehicle that is to be put somewhere: entering, respawned, or a wreck put back."""

    actor: int
    pose: Pose
    v: float
    wreck: bool


class Traffic:
    """Drivers of those actors that have one."""

    def __init__(
        self, map: RoadMap, setup: TrafficSetup, seed: int, dt: float, grip: float
    ) -> None:
        """grip: friction over dry, in (0, 1]."""
        self.net, self.setup, self.seed, self.dt = network_of(map), setup, seed, dt
        self.caution = grip if setup.slow_in_weather else 1.0
        self.drivers, self.occupancy = drivers(0), occupancy(0, 0)
        self.walkers = np.empty(0, dtype=np.intp)  # to whom drivers yield at zebras
        self.entry, self.conflict, self.zebra, self.zebras = priority_of(map)
        self.places = FreePlaces(map, self.net, stream(seed, "traffic", "places"))
        self.row: dict[int, int] = {}  # by id
        self.waiting: list[int] = []  # ids of those who enter when there is room

    def arrange(self, members: Sequence[Member], source: Mapping[int, int]) -> None:
        """The actors have other rows; source: old row by new row of those who were there."""
        old, ids = self.drivers, [m.id for m in members]
        self.drivers = drivers(len(ids))
        self.drivers.state["key"] = [stream_key(self.seed, "traffic", "driver", id) for id in ids]
        self.drivers.trait[:] = _traits([m.actor.body for m in members], self.caution)
        if self.setup.variety:
            vary(self.drivers.trait, ids, self.seed)
        for new, before in source.items():
            for column, was in zip(self.drivers, old, strict=True):
                column[new] = was[before]
        self.occupancy = occupancy(len(self.net.lane), len(ids))
        self.walkers = np.flatnonzero([m.kind is ActorKind.PEDESTRIAN for m in members])
        self.row = {id: i for i, id in enumerate(ids)}
        self.waiting = [id for id in self.waiting if id in self.row]

    def engage(self, i: int, lane: int, s: float, factor: float = 1.0) -> None:
        """Actor i drives itself from here on, along `lane`."""
        me, row = self.drivers.state[i], self.net.lane[lane]
        begin(self.drivers.path[i], lane)
        me["active"] = True
        me["at"] = row["first"] + int((row["size"] - 1) * s / row["length"])
        me["s"] = s
        self.drivers.trait["factor"][i] *= factor
        limit = self.setup.initial_limit_kmh
        me["cap"] = np.inf if limit is None else mps_from_kmh(limit)

    def await_room(self, id: int, factor: float) -> None:
        """An actor enters as soon as there is a free place near the ego (A-209)."""
        self.drivers.trait["factor"][self.row[id]] *= factor
        self.waiting.append(id)

    def release(self, i: int) -> None:
        """Actor i is moved by commands from here on."""
        self.drivers.state["active"][i] = False

    def decide(
        self, placed: Places, lights: NDArray[np.uint8], tick: int, commands: NDArray[np.float64]
    ) -> None:
        """Write the commands of all driven actors for the coming step."""
        free_choice = self.setup.mode is TrafficStart.RANDOM
        view = View(
            self.net, self.occupancy, placed, lights, tick, self.dt, free_choice,
            self.entry, self.conflict, self.zebra, self._busy(placed),
        )  # fmt: skip
        drive_all(view, self.drivers, commands)

    def _busy(self, placed: Places) -> NDArray[np.bool_]:
        """(Z,) zebras on which somebody walks, or steps from the kerb."""
        who = placed[self.walkers]
        if not len(who) or not len(self.zebras):
            return np.zeros(len(self.zebras), dtype=np.bool_)
        x, y, h, half_l, half_w = self.zebras.T[:, :, None]
        dx, dy = who["x"] - x, who["y"] - y
        along, across = np.cos(h) * dx + np.sin(h) * dy, -np.sin(h) * dx + np.cos(h) * dy
        moving = who["present"] & (np.hypot(who["vx"], who["vy"]) > 0.1)
        on = (np.abs(along) < half_l + KERB) & (np.abs(across) < half_w) & moving
        busy: NDArray[np.bool_] = on.any(axis=1)
        return busy

    def moves(self, states: ActorStates, tick: int) -> Iterator[Move]:
        """Vehicles to put somewhere in this tick; apply each before asking for the next."""
        if tick % CHECK_PERIOD:
            return
        driver = self.drivers.state
        if self.setup.put_wrecks_back:
            wrecks = np.flatnonzero(driver["active"] & (driver["stuck"] > STUCK_TIME))
            for i in wrecks.tolist():
                yield from self._put(i, states, PUT_BACK_NEAREST, np.inf, True)
        if self.setup.mode is TrafficStart.RANDOM:
            yield from self._keep_bubble(states)

    def _keep_bubble(self, states: ActorStates) -> Iterator[Move]:
        for id in list(self.waiting):
            for move in self._put(self.row[id], states, BUBBLE_NEAREST, BUBBLE, False):
                self.waiting.remove(id)
                self.drivers.state["active"][move.actor] = True
                yield move
        x, y = float(states.x[0]), float(states.y[0])
        driving = self.drivers.state["active"] & states.present
        for i in np.flatnonzero(driving).tolist():
            if hypot(states.x[i] - x, states.y[i] - y) > 1.2 * BUBBLE:
                yield from self._put(i, states, BUBBLE_NEAREST, BUBBLE, False)

    def _put(
        self, i: int, states: ActorStates, nearest: float, farthest: float, wreck: bool
    ) -> Iterator[Move]:
        at = self.places.draw(states, nearest, farthest)
        if at is None:
            return
        point, me = self.net.point[at], self.drivers.state[i]
        begin(self.drivers.path[i], self.places.lane[at])
        me["at"], me["s"] = at, point["s"]
        me["change"] = me["cap"] = np.inf
        me["trim"] = me["stuck"] = me["v_desired"] = 0.0
        pose = Pose(
            float(point["x"]),
            float(point["y"]),
            float(self.places.z[at]),
            yaw=float(point["heading"]),
        )
        v = PUT_BACK_SPEED * float(point["limit"] * self.drivers.trait["factor"][i])
        yield Move(i, pose, v, wreck)


def _traits(bodies: Sequence[VehicleType | Shape], caution: float) -> NDArray[np.void]:
    """Drivers know their vehicles; `caution` in (0, 1] slows those who mind the weather."""
    traits = np.zeros(len(bodies), dtype=TRAIT)
    traits["factor"] = _speed_choice(caution)
    traits["headway"] = T_HEADWAY / caution
    traits["a_max"] = A_MAX
    traits["a_curve"] = A_CURVE * caution
    for trait, t in zip(traits, bodies, strict=True):
        if isinstance(t, Shape):
            continue
        trait["wheelbase"] = t.wheelbase
        trait["steer_angle"] = t.steer_max
        trait["understeer"] = t.understeer
        trait["a_drive"] = t.a_drive
        trait["p_drive"] = t.power / t.mass
        trait["a_brake"] = t.a_brake
        trait["drag"] = 0.5 * AIR_DENSITY * t.drag_area / t.mass
        trait["rolling"] = t.rolling_resistance * G + t.engine_drag
    return traits


def _speed_choice(grip: float) -> float:
    """Desired speed on a road with this friction over that on a dry one.

    Source: SUMO's friction-dependent speed factor, vehicle class car.
    """
    if grip >= 1.0:
        return 1.0
    return -0.3491 * grip * grip + 0.8922 * grip + 0.4493
