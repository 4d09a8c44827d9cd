"""Vehicles that traffic actions bring: how they come, follow their lanes and each other, and go."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import cos, hypot, inf
from random import Random
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Flags
from skidpad.core.setup import ActorCommand
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.scenarios.movement.measures import between
from skidpad.scenarios.movement.network import Place
from skidpad.scenarios.places.spots import Disc, Region, Spots, along, spot_at, spots_of
from skidpad.scenarios.scene import Actor, Scene
from skidpad.simulation.world.traffic.idm import B_COMFORT, Character, idm

LOOK = 80.0  # m ahead within which somebody may be followed; assumption
BESIDE = 10.0  # m of the way to another that a bend may hide; assumption
# kept free before and behind who appears, besides what comfortable braking takes; assumptions
ROOM_MIN, ROOM_TIME = 4.0, 1.0  # m, s of the speed of the one behind
AGAIN = 1.0  # s between looks for places, where fewer are there than should be
END = 3.0  # m before the end of a road where traffic leaves it
V_UNKNOWN = 50.0 / 3.6  # m/s where neither the file nor the map says a speed; assumption


class Speeds(NamedTuple):
    """The speeds in m/s with which vehicles come; None: the lane's limit."""

    low: float | None = None
    high: float | None = None

    def draw(self, rng: Random, map: RoadMap, point: LanePoint) -> float:
        """Draws the speed in m/s of a vehicle that appears at a place; without limits that of the lane."""
        if self.low is not None and self.high is not None:
            return rng.uniform(self.low, self.high)
        limit = map.limit(point)
        return V_UNKNOWN if limit is None else limit


class Pool:
    """Vehicles of one traffic action, drawn and placed by the run's seed and the traffic's name."""

    def __init__(self, name: str, cars: tuple[str, ...], speeds: Speeds, scene: Scene) -> None:
        self.cars, self.speeds = cars, speeds
        self.rng = Random(f"{scene.seed}/{name}/{','.join(cars[:1])}")
        self.spots = spots_of(scene.network.map)

    def there(self, scene: Scene) -> list[Actor]:
        """Returns the vehicles of the flow that are in the world."""
        return [a for a in (scene.actors[n] for n in self.cars) if a.present]

    def bring(self, scene: Scene, spots: Spots) -> bool:
        """Puts a spare vehicle at a free spot; False where no vehicle is spare or no spot is free."""
        away = [n for n in self.cars if not scene.actors[n].present]
        if not away or len(spots.x) == 0:
            return False
        actor = scene.actors[self.rng.choice(away)]
        k = self.rng.randrange(len(spots.x))
        map = scene.network.map
        wanted = self.speeds.draw(self.rng, map, map.at(int(spots.lane[k]), float(spots.s[k])))
        v = min(wanted, actor.entity.performance.v_max)
        free = _free(scene, spots, v, actor.entity.box.length)
        if not free[k]:
            found = np.flatnonzero(free)
            if len(found) == 0:
                return False
            k = int(self.rng.choice(found.tolist()))
        point = map.at(int(spots.lane[k]), float(spots.s[k]))
        actor.put(scene.network, Place(point.pose, point), v)
        scene.cruising[actor.name] = v
        return True


def vanish(scene: Scene, actor: Actor) -> None:
    """Takes a vehicle of traffic out of the world, free to come again."""
    scene.cruising.pop(actor.name, None)
    actor.present = False
    actor.word = ActorCommand(actor.name, present=False)


def _free(scene: Scene, spots: Spots, v: float, length: float) -> Flags:
    """Returns (N,) spots where a body `length` m long may appear at v m/s without hard braking of others."""
    mask = np.ones(len(spots.x), np.bool_)
    for actor in scene.actors.values():
        if actor.present:
            other = _speed(scene, actor)
            lengths = 0.5 * (length + actor.entity.box.length)
            mask &= spots.free(actor, lengths + _room(v, other), lengths + _room(other, v))
    return mask


def _room(v_behind: float, v_ahead: float) -> float:
    """Returns the gap in m that a vehicle at `v_behind` needs to one at `v_ahead` (m/s)."""
    closing = max(v_behind - v_ahead, 0.0)
    return ROOM_MIN + ROOM_TIME * v_behind + closing**2 / (2.0 * B_COMFORT)


def _speed(scene: Scene, actor: Actor) -> float:
    """Returns the speed in m/s; that of a vehicle that has just appeared is not measured yet."""
    return actor.guide.v if actor.name in scene.cruising else actor.v


class Sourcing:
    """A source under way: one vehicle after the other, as the rate has it and there is room."""

    def __init__(self, name: str, pool: Pool, region: Disc, rate: float) -> None:
        self.name, self.pool, self.region, self.rate = name, pool, region, rate
        self.stopped = False
        self.due: float | None = None

    def step(self, scene: Scene) -> bool:
        """Lets vehicles come until it is stopped; True then."""
        if self.stopped:
            return True
        self.due = scene.t if self.due is None else self.due
        if self.rate <= 0.0 or scene.t < self.due - 1e-9:
            return False
        if self.pool.bring(scene, self._spots(scene)):
            self.due += 1.0 / self.rate
        return False

    def _spots(self, scene: Scene) -> Spots:
        """Returns the spots within the radius; the lane of the place itself where none is so near."""
        spots = self.pool.spots
        near = spots.where(self.region.inside(scene, spots))
        lane = self.region.centre.place(scene).lane
        return near if len(near.x) or lane is None else spot_at(scene.network.map, lane)


class Sinking:
    """A sink under way: it takes vehicles of traffic, never entities of the file."""

    def __init__(self, name: str, region: Disc, rate: float) -> None:
        self.name, self.region, self.rate = name, region, rate
        self.stopped = False
        self.due = 0.0

    def step(self, scene: Scene) -> bool:
        """Takes vehicles out until it is stopped; True then."""
        if self.stopped:
            return True
        pose = self.region.centre.place(scene).pose
        for actor in [scene.actors[n] for n in scene.cruising]:
            if self.rate <= 0.0 or scene.t < self.due - 1e-9:
                break
            if hypot(actor.pose.x - pose.x, actor.pose.y - pose.y) <= self.region.radius:
                vanish(scene, actor)
                self.due = scene.t + 1.0 / self.rate
        return False


@dataclass(frozen=True, slots=True)
class Directions:
    """Weights of travelling as an entity looks, and against it."""

    entity: str
    same: float
    opposite: float

    def draw_mask(self, rng: Random, scene: Scene, spots: Spots) -> Flags:
        """Returns the mask of the spots in the direction of one draw: same as the entity's or opposite."""
        same = rng.random() * (self.same + self.opposite) < self.same
        mask = along(scene.actors[self.entity].pose, spots)
        return mask if same else ~mask


class Filling:
    """A swarm or an area under way: as many vehicles as there should be, and there is room for.

    first: where they appear at the begin; later: where others appear for those that left `first`;
    None: nobody does, and the action is over at once.
    """

    def __init__(
        self, name: str, pool: Pool, first: Region, later: Region | None,
        directions: Directions | None = None,
    ) -> None:  # fmt: skip
        self.name, self.pool, self.first, self.later = name, pool, first, later
        self.directions = directions
        self.stopped = False
        self.due: float | None = None

    def step(self, scene: Scene) -> bool:
        """Keeps the number of vehicles until it is stopped; True then, or at once without `later`."""
        if self.stopped:
            return True
        if self.due is None:
            self._fill(scene, self.first)
        elif self.later is not None:
            self._release(scene)
            if scene.t >= self.due - 1e-9:
                self._fill(scene, self.later)
        return self.later is None

    def _fill(self, scene: Scene, region: Region) -> None:
        """Adds missing vehicles to the scene at free spots of the region, and sets the next such moment."""
        self.due = scene.t + AGAIN
        spots = self.pool.spots
        spots = spots.where(region.inside(scene, spots))
        for _ in range(len(self.pool.cars) - len(self.pool.there(scene))):
            some = spots
            if self.directions is not None:
                some = spots.where(self.directions.draw_mask(self.pool.rng, scene, spots))
            self.pool.bring(scene, some)

    def _release(self, scene: Scene) -> None:
        """Removes the vehicles that are on no road or have left the first region."""
        for actor in self.pool.there(scene):
            base = actor.guide.base
            if base is None or not self._stays(scene, spot_at(scene.network.map, base)):
                vanish(scene, actor)

    def _stays(self, scene: Scene, spot: Spots) -> bool:
        """Returns whether the spot lies in the first region."""
        return bool(self.first.inside(scene, spot)[0])


def drive(scene: Scene) -> None:
    """Moves all vehicles of traffic for one step: along their lanes, behind others, out at a road's end.

    Source: the Intelligent Driver Model of `simulation.world.traffic.idm`.
    """
    for name in list(scene.cruising):
        actor = scene.actors[name]
        if actor.word is not None and actor.word.place is not None:
            continue  # it has just appeared, and drives from the next step on
        guide = actor.guide
        if guide.base is None or scene.network.ahead(guide.base, END, guide.roads) is None:
            vanish(scene, actor)
            continue
        gap, v_lead = lead_of(scene, actor)
        a = float(idm(guide.v, scene.cruising[name], gap, v_lead, Character()))
        v = max(guide.v + a * scene.dt, 0.0)
        guide.v, guide.a = v, (v - guide.v) / scene.dt


def lead_of(scene: Scene, actor: Actor) -> tuple[float, float]:
    """Returns gap in m and speed in m/s of the vehicle ahead in the lane; inf where there is none."""
    base = actor.guide.base
    assert base is not None
    for distance, other in sorted(_near(scene, actor), key=lambda found: found[0]):
        place = scene.network.ahead(base, distance, actor.guide.roads)
        if place is None:
            continue
        forward, left = between(place.pose, other.pose.x, other.pose.y)
        if abs(left) < 0.5 * place.width and abs(forward) < BESIDE:
            v = _speed(scene, other)
            lengths = 0.5 * (actor.entity.box.length + other.entity.box.length)
            return max(distance - lengths, 0.0), v * cos(other.pose.yaw - place.heading)
    return inf, 0.0


def _near(scene: Scene, actor: Actor) -> Iterable[tuple[float, Actor]]:
    """Yields (distance in m, actor) for solid actors in front of this one and within `LOOK` m in x and y."""
    for other in scene.actors.values():
        if other is actor or not other.present or other.entity.is_ghost:
            continue
        x, y = other.pose.x, other.pose.y
        if abs(x - actor.pose.x) > LOOK or abs(y - actor.pose.y) > LOOK:
            continue
        if between(actor.pose, x, y)[0] > 0.0:
            yield hypot(x - actor.pose.x, y - actor.pose.y), other
