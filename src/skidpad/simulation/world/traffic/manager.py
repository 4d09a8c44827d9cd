"""All background drivers of a run: set up once, decided in one kernel call per tick."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import cache, partial
from math import hypot, inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.geometry import Pose, mps_from_kmh
from skidpad.core.maths.constants import G
from skidpad.core.maths.randomness import stream, stream_key
from skidpad.core.setup import TrafficSetup
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import ActorKind, TrafficStart
from skidpad.physics.types import VehicleType
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.rows import Member, Shape
from skidpad.simulation.world.traffic.care import Care, speed_to_stop_within
from skidpad.simulation.world.traffic.idm import A_CURVE, A_MAX, T_HEADWAY
from skidpad.simulation.world.traffic.mobil import B_SAFE, GAP_CLEAR
from skidpad.simulation.world.traffic.occupancy import occupancy
from skidpad.simulation.world.traffic.outlook import PREVIEW_STEP, desired_speed
from skidpad.simulation.world.traffic.pack import RADIUS, UNSEEN, Pack
from skidpad.simulation.world.traffic.path import PATH, begin, straight_path
from skidpad.simulation.world.traffic.places import FreePlaces
from skidpad.simulation.world.traffic.spacing import (
    LEAST_TIME,
    claims,
    is_crossing_free,
    room,
    seconds_to_others,
)
from skidpad.simulation.world.traffic.state import TRAIT, drivers
from skidpad.simulation.world.traffic.streets import candidates_of, network_of, streets_of
from skidpad.simulation.world.traffic.variety import vary

AIR_DENSITY = 1.204  # kg/m^3 at 20 C
STUCK_TIME = 10.0  # s, decision M-7
PUT_BACK_NEAREST = 100.0  # m from the ego, decision M-7
PUT_BACK_SPEED = 0.8  # of the desired speed there
NOSE = 5.0  # m from a car's middle to where it stands before a line
BUBBLE = 500.0  # m, random traffic lives within this distance of the ego
KEPT = 1.2 * BUBBLE  # m from the ego, beyond which it is moved on
CHECK_PERIOD = 20  # ticks between two looks at wrecks and the bubble
Claimed = Callable[[], Places]  # of `claims`, made at the first call


class Reason(Enum):
    """Why a vehicle is put somewhere."""

    ENTERS = "enters"  # it was not there before
    WRECK = "wreck"  # stuck or astray (decision M-7)
    FAR = "far"  # it left the surroundings of the ego


@dataclass(frozen=True, slots=True)
class Move:
    """A vehicle that is to be put somewhere."""

    actor: int
    pose: Pose
    v: float
    reason: Reason


class Area(NamedTuple):
    """Where somebody may be put: m from the ego, and on which samples."""

    nearest: float
    farthest: float
    among: NDArray[np.intp] | None = None  # None: anywhere


class Traffic:
    """Drivers of those actors that have one."""

    def __init__(self, map: RoadMap, setup: TrafficSetup, seed: int, care: Care) -> None:
        self.net, self.setup, self.seed, self.care = network_of(map), setup, seed, care
        self.sees_patches = setup.sees_patches and care.on
        self.drivers, self.occupancy = drivers(0), occupancy(0, 0)
        self.streets = streets_of(map)
        if self.sees_patches:  # an own copy: other runs of this process share the map's
            self.net = self.net._replace(point=self.net.point.copy())
            self.streets = self.streets._replace(net=self.net)
        self.places = FreePlaces(
            map, self.net, candidates_of(map), stream(seed, "traffic", "places")
        )
        self.row: dict[int, int] = {}  # by id
        self._way = np.full(PATH, -1, dtype=np.int32)  # room for a way through the map
        self.waiting: list[int] = []  # ids of those who enter when there is room
        self.kept_back: set[int] = set()  # ids of those who do so once they are called

    def change_streams(self, seed: int) -> None:
        """Draws choices and places of drivers from other streams from now on; who they are stays."""
        self.seed, self.places.rng = seed, stream(seed, "traffic", "places")
        for id, row in self.row.items():
            self.drivers.state["key"][row] = stream_key(seed, "traffic", "driver", id)

    def see_patches(self, shares: Floats) -> None:
        """Lets drivers know what patches leave of the friction, (N,) at the map's samples.

        They look at limits and bends every PREVIEW_STEP m: a share counts that far to both sides.
        """
        lane = np.repeat(np.arange(len(self.net.lane)), self.net.lane["size"])
        found = shares.copy()
        for shift in range(1, int(PREVIEW_STEP) + 1):
            same = lane[shift:] == lane[:-shift]
            found[shift:] = np.where(
                same, np.minimum(found[shift:], shares[:-shift]), found[shift:]
            )
            found[:-shift] = np.where(
                same, np.minimum(found[:-shift], shares[shift:]), found[:-shift]
            )
        self.net.point["patch"] = np.minimum(found, 1.0)

    def arrange(self, members: Sequence[Member], source: Mapping[int, int]) -> None:
        """Carries the drivers over to other rows; source: old row by new row of those that were there.

        New ones get traits of their vehicle, varied where the set-up says so, and are inactive.
        """
        old, ids = self.drivers, [m.id for m in members]
        self.drivers = drivers(len(ids))
        self.drivers.state["key"] = [stream_key(self.seed, "traffic", "driver", id) for id in ids]
        self.drivers.trait[:] = _traits([m.actor.body for m in members])
        if self.setup.variety:
            vary(self.drivers.trait, ids, self.seed, self.setup.stratum, self.setup.headways)
        for new, before in source.items():
            for column, was in zip(self.drivers[:3], old[:3], strict=True):
                column[new] = was[before]
        self.occupancy = occupancy(len(self.net.lane), len(ids))
        walkers = np.flatnonzero([m.kind is ActorKind.PEDESTRIAN for m in members])
        self.streets = self.streets._replace(walkers=walkers)
        self.row = {id: i for i, id in enumerate(ids)}
        self.waiting = [id for id in self.waiting if id in self.row]
        self.kept_back.intersection_update(self.row)

    @property
    def free_choice(self) -> bool:
        """Whether drivers draw branches instead of taking the straightest."""
        return self.setup.mode is TrafficStart.RANDOM

    def engage(self, i: int, lane: int, s: float, factor: float = 1.0) -> None:
        """Lets actor i drive itself from here on, along `lane` from s m on.

        factor: multiplies its desired speed over the limit.
        """
        me, row = self.drivers.state[i], self.net.lane[lane]
        begin(self.drivers.path[i], lane)
        me["active"] = True
        me["at"] = row["first"] + int((row["size"] - 1) * s / row["length"])
        me["s"] = s
        self.drivers.trait["factor"][i] *= factor
        limit = self.setup.initial_limit_kmh
        me["cap"] = np.inf if limit is None else mps_from_kmh(limit)

    def await_room(self, id: int, factor: float) -> None:
        """Lets an actor enter as soon as there is a free place near the ego (A-209)."""
        self.drivers.trait["factor"][self.row[id]] *= factor
        self.waiting.append(id)

    def keep_back(self, id: int, factor: float) -> None:
        """Lets an actor wait for `call` before it waits for room."""
        self.drivers.trait["factor"][self.row[id]] *= factor
        self.kept_back.add(id)

    def call(self, id: int) -> bool:
        """Returns whether an actor was kept back; if so, it enters as soon as there is a free place."""
        if id not in self.kept_back:
            return False
        self.kept_back.remove(id)
        self.waiting.append(id)
        return True

    def release(self, i: int) -> None:
        """Ends the driving of actor i, which is moved by commands from here on."""
        self.drivers.state["active"][i] = False

    def moves(self, states: ActorStates, placed: Places, tick: int) -> Iterator[Move]:
        """Yields vehicles to put somewhere in this tick; apply each before asking for the next.

        Only every CHECK_PERIOD ticks. Drivers of those that are yielded are set to their new place already.
        """
        if tick % CHECK_PERIOD:
            return
        driver = self.drivers.state
        claimed = cache(partial(claims, placed, self.drivers))  # most ticks need none
        if self.setup.put_wrecks_back:
            wrecks = np.flatnonzero(driver["active"] & (driver["stuck"] > STUCK_TIME))
            for i in wrecks.tolist():
                yield from self._claim_place(
                    i, states, claimed, Area(PUT_BACK_NEAREST, np.inf), Reason.WRECK
                )
        if self.free_choice:
            yield from self._keep_bubble(states, claimed)
        elif self.setup.mode is TrafficStart.PACK and placed["lane"][0] >= 0:
            yield from self._keep_pack(states, claimed, Pack(self.net, placed[0], self.places.lane))
        elif self.waiting:
            yield from self._let_in(states, claimed, Area(UNSEEN, BUBBLE))

    def limits(self) -> tuple[float, float]:
        """Returns m from the ego and s without motion: up to them all vehicles stay where they are.

        At present `moves` has nothing to yield while no vehicle that drives is farther away, or stands for
        longer. -1 m where some wait for room.
        """
        stuck = STUCK_TIME if self.setup.put_wrecks_back else inf
        if self.waiting:
            return -1.0, stuck
        if self.free_choice:
            return KEPT, stuck
        return (UNSEEN if self.setup.mode is TrafficStart.PACK else inf), stuck

    def _keep_pack(self, states: ActorStates, claimed: Claimed, pack: Pack) -> Iterator[Move]:
        """Yields the moves that bring waiting and lost vehicles to entrances around the ego's pack."""

        def area(*sides: bool) -> Area:
            found = [pack.entrances(self.places.candidates, ahead) for ahead in sides]
            return Area(UNSEEN, RADIUS, np.concatenate(found))

        if self.waiting:
            yield from self._let_in(states, claimed, area(True, False))
        for i, ahead in pack.lost(self.drivers, states):
            yield from self._claim_place(i, states, claimed, area(ahead), Reason.FAR)

    def _let_in(self, states: ActorStates, claimed: Claimed, area: Area) -> Iterator[Move]:
        """Yields the moves by which waiting vehicles enter the area where there is room."""
        for id in list(self.waiting):
            for move in self._claim_place(self.row[id], states, claimed, area, Reason.ENTERS):
                self.waiting.remove(id)
                self.drivers.state["active"][move.actor] = True
                yield move

    def _keep_bubble(self, states: ActorStates, claimed: Claimed) -> Iterator[Move]:
        """Yields the moves that bring waiting and distant vehicles into the bubble around the ego."""
        area = Area(UNSEEN, BUBBLE)
        yield from self._let_in(states, claimed, area)
        x, y = float(states.x[0]), float(states.y[0])
        driving = self.drivers.state["active"] & states.present
        for i in np.flatnonzero(driving).tolist():
            if hypot(states.x[i] - x, states.y[i] - y) > KEPT and self._is_alone(
                i, states, claimed
            ):
                yield from self._claim_place(i, states, claimed, area, Reason.FAR)

    def _claim_place(
        self, i: int, states: ActorStates, claimed: Claimed, area: Area, reason: Reason
    ) -> Iterator[Move]:
        """Yields the move of vehicle i to a free place in the area, and claims it; none if none is free."""
        at = self.places.draw(
            states,
            area.nearest,
            area.farthest,
            lambda at, d: self._has_room(i, at, d, states, claimed),
            area.among,
        )
        if at is None:
            return
        point, me = self.net.point[at], self.drivers.state[i]
        v = self._speed_at(i, at)
        begin(self.drivers.path[i], self.places.lane[at])
        me["at"], me["s"] = at, point["s"]
        me["change"] = me["cap"] = np.inf
        me["trim"] = me["stuck"] = me["v_desired"] = 0.0
        all_claims = claimed()
        for row in (
            all_claims[i],
            all_claims[i + len(all_claims) // 2],
        ):  # who is put next looks there
            row["lane"], row["s"], row["speed"] = self.places.lane[at], point["s"], v
            row["present"] = True
        pose = Pose(
            float(point["x"]),
            float(point["y"]),
            float(self.places.z[at]),
            yaw=float(point["heading"]),
        )
        yield Move(i, pose, v, reason)

    def _is_alone(self, i: int, states: ActorStates, claimed: Claimed) -> bool:
        """Returns whether all others are LEAST_TIME s or more from vehicle i: none would see it vanish."""
        v = float(np.hypot(states.vx[i], states.vy[i]))
        found = claimed()
        rows = found[[i, i + len(found) // 2]]
        return all(
            seconds_to_others(self.net, found, int(row["lane"]), float(row["s"]), v, i)
            >= LEAST_TIME
            for row in rows[rows["lane"] >= 0]
        )

    def _has_room(
        self, i: int, at: int, d: NDArray[np.float64], states: ActorStates, claimed: Claimed
    ) -> bool:
        """Returns whether vehicle i can be put on sample `at`, d (n,) m from every actor."""
        v = self._speed_at(i, at)
        if (states.present & (d < room(self.care, v, states))).any():
            return False
        lane, s = int(self.places.lane[at]), float(self.net.point["s"][at])
        return (
            is_crossing_free(self.streets, claimed(), lane, s, i)
            and seconds_to_others(self.net, claimed(), lane, s, v, i) >= LEAST_TIME
        )

    def _speed_at(self, i: int, at: int) -> float:
        """Returns the m/s at which driver i passes sample `at`: as traffic does there."""
        point, trait = self.net.point[at], self.drivers.trait[i]
        share = 1.0 if self.setup.mode is TrafficStart.PACK else PUT_BACK_SPEED
        v = share * float(point["limit"] * trait["factor"])
        if not self.care.on:
            return v
        me = drivers(1).state[0]
        me["at"], me["s"] = at, point["s"]
        straight_path(self.net, int(self.places.lane[at]), self._way)
        v = min(v, float(desired_speed(self.net, me, trait, self._way, v, self.care)))
        return speed_to_stop_within(self.care, self._way_to_line(at), v)

    def _way_to_line(self, at: int) -> float:
        """Returns the m from sample `at` to where one may have to wait for others.

        inf where its lane leads to no such place.
        """
        lane, entry = int(self.places.lane[at]), self.streets.entry
        if not entry["size"][self.net.lane["ahead"][lane]]:
            return inf
        return max(float(entry["line"][lane] - self.net.point["s"][at]) - NOSE, 0.0)


def _traits(bodies: Sequence[VehicleType | Shape]) -> NDArray[np.void]:
    """Returns the traits (n,) of the drivers, with what they know of their vehicles."""
    traits = np.zeros(len(bodies), dtype=TRAIT)
    traits["factor"] = 1.0
    traits["headway"] = traits["headway_town"] = T_HEADWAY
    traits["a_max"] = A_MAX
    traits["a_curve"] = A_CURVE
    traits["room"] = GAP_CLEAR
    traits["imposed"] = B_SAFE
    traits["eager"] = 1.0
    for trait, t in zip(traits, bodies, strict=True):
        if isinstance(t, Shape):
            continue
        trait["wheelbase"] = t.wheelbase
        trait["steer_angle"] = t.steer_max
        trait["understeer"] = t.understeer
        trait["a_drive"] = t.a_drive
        trait["carried"] = t.weight_driven
        trait["p_drive"] = t.power / t.mass
        trait["a_brake"] = t.a_brake
        trait["engine_drag"] = t.engine_drag
        trait["drag"] = 0.5 * AIR_DENSITY * t.drag_area / t.mass
        trait["rolling"] = t.rolling_resistance * G + t.engine_drag
    return traits
