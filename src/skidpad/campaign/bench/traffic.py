"""How background drivers get along with each other in a weather: contacts, speed, changes of lane."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.campaign.bench.traffic_watch import TrafficCounts, Watch
from skidpad.campaign.driving.run_setup import stage_of
from skidpad.core.courses import Roads
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.setup import DT
from skidpad.core.vocabulary import TrafficStart
from skidpad.evidence.statistics import Interval, poisson_interval
from skidpad.physics.presets import find_weather
from skidpad.simulation.world.stage import build_world
from skidpad.simulation.world.touch import EGO
from skidpad.simulation.world.world import World

DRIVE = 500.0  # s from one seed
FIRST_SEED = 900_000  # nothing else is driven from here on (decision X-8)


@dataclass(slots=True)
class TrafficRow:
    """What was seen in one weather; the one in the ego's car is one of the background."""

    weather: str
    km: float = 0.0
    hours: float = 0.0  # of all vehicles together
    contacts: int = 0  # among vehicles
    static: int = 0  # with what stands beside the road
    put_back: int = 0  # stuck or astray
    changes: int = 0  # of lane
    seen: TrafficCounts = field(default_factory=TrafficCounts)

    @property
    def per_100_km(self) -> float:
        """Contacts among vehicles per 100 km."""
        return 100.0 * self.contacts / self.km

    @property
    def interval(self) -> Interval:
        """Returns the exact 95 % interval of contacts per 100 km."""
        return poisson_interval(self.contacts, self.km / 100.0)

    @property
    def mean_speed_kmh(self) -> float:
        """Returns the mean speed over vehicles and time; 0 before any."""
        return self.km / self.hours if self.hours else 0.0


def measure(asked: TrafficBench, weather: str) -> TrafficRow:
    """Drives seed after seed until the vehicles have covered `asked.km`; returns what was counted."""
    row, seed = TrafficRow(weather), FIRST_SEED
    while row.km < asked.km:
        world = background_world(asked, weather, seed)
        _drive(row, world, DRIVE, asked.km, Watch(world, row.seen, weather, seed))
        seed += 1
    return row


def measure_drive(asked: TrafficBench, weather: str, seed: int, seconds: float) -> TrafficRow:
    """Drives one seed for `seconds` s, whatever the distance; returns what was counted."""
    row, world = TrafficRow(weather), background_world(asked, weather, seed)
    _drive(row, world, seconds, np.inf, Watch(world, row.seen, weather, seed))
    return row


def background_world(asked: TrafficBench, weather: str, seed: int) -> World:
    """Returns a world as runs have it, with a background driver in the ego's car."""
    roads = Roads(map=asked.map, traffic=TrafficStart.RANDOM, vehicles=asked.vehicles - 1)
    settings = load_profile(
        "recommended", {"drivers": not asked.careless, "headways": asked.headways}
    )
    spec = RunSpec(course=roads, weather=find_weather(weather), settings=settings)
    world = build_world(stage_of(spec).setup, seed)
    assert world.traffic is not None
    place = world.placed[EGO]
    world.traffic.engage(EGO, int(place["lane"]), float(place["s"]))
    return world


def _drive(row: TrafficRow, world: World, seconds: float, km: float, watch: Watch) -> None:
    """Steps the world for `seconds` s or until the row has `km` km; adds what happened to the row."""
    assert world.traffic is not None
    drivers = world.traffic.drivers.state
    before = drivers["change"].copy()
    for _ in range(round(seconds / DT)):
        world.step()
        watch.look()
        there = world.states.present
        speed = np.hypot(world.states.vx, world.states.vy)[there]
        row.km += float(speed.sum()) * DT / 1000.0
        row.hours += speed.size * DT / 3600.0
        _count(
            row,
            [c.actor for c in world.events.contacts] + [c.other for c in world.events.background],
        )
        row.put_back += len(world.events.put_back)
        row.changes += int((drivers["change"] < before).sum())
        before = drivers["change"].copy()
        if row.km >= km:
            break
    watch.end()


def _count(row: TrafficRow, touched: Iterable[int]) -> None:
    """Adds the contacts to the row; an index below 0 is something static."""
    for other in touched:
        row.contacts += other >= 0
        row.static += other < 0
