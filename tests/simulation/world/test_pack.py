"""The pack stays around the ego, and whoever leaves it comes back where no sensor sees him enter."""

from __future__ import annotations

import numpy as np
import pytest

from skidpad.core.courses import Roads
from skidpad.core.errors import ConfigError
from skidpad.core.run import RunSpec
from skidpad.core.setup import ActorSetup, LanePosition, Setup, TrafficSetup
from skidpad.core.simulator import BackendChoice, BackendKind
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control, SensorLevel, TrafficStart
from skidpad.core.weather import Weather
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.stage import build_world
from skidpad.simulation.world.touch import EGO
from skidpad.simulation.world.traffic.pack import RADIUS, UNSEEN, Pack
from skidpad.simulation.world.world import World

JUMP = 10.0  # m in one tick, more than anybody drives


def packed(map: str, vehicles: int = 20, seed: int = 3) -> World:
    start = load_map(map).ego_start
    assert isinstance(start, LanePosition)
    ego = ActorSetup(name="ego", type=EGO_TYPE, place=start, driver=Control.SCRIPTED)
    traffic = TrafficSetup(
        mode=TrafficStart.PACK, vehicles=vehicles, slow_in_weather=True, variety=True
    )
    setup = Setup(
        map=map, weather=Weather(), specs=(), ego=ego, traffic=traffic, level=SensorLevel.OBJECTS
    )
    return build_world(setup, seed)


def pack_of(world: World) -> Pack:
    assert world.traffic is not None
    return Pack(world.traffic.net, world.placed[EGO], world.traffic.places.lane)


def engaged(world: World, factor: float) -> None:
    """A driver of the background sits in the ego's car."""
    assert world.traffic is not None
    place = world.placed[EGO]
    world.traffic.engage(EGO, int(place["lane"]), float(place["s"]), factor)


@pytest.mark.parametrize("map", ["figure8", "motorway"])
def test_everybody_begins_within_the_pack(map: str) -> None:
    world = packed(map)
    pack = pack_of(world)
    there = np.flatnonzero(world.states.present)[1:]
    assert len(there) == 20
    away = [pack.away(int(world.placed["lane"][i]), float(world.placed["s"][i])) for i in there]
    assert all(a is not None and abs(a) <= RADIUS for a in away)
    assert sum(a is not None and a > 0.0 for a in away) == 15


def test_the_way_ahead_is_measured_along_the_road() -> None:
    map = load_map("figure8")
    assert map.ego_start is not None
    start, pack = map.place(map.ego_start), pack_of(packed("figure8"))
    for distance in (0.0, 40.0, 120.0, 249.0, -60.0, -240.0):
        place = map.ahead(start, distance)
        assert place is not None
        assert pack.away(place.lane, place.s) == pytest.approx(distance, abs=1.0)
    beyond = map.ahead(start, 300.0)
    assert beyond is not None
    assert pack.away(beyond.lane, beyond.s) is None


@pytest.mark.parametrize(("factor", "least"), [(1.3, 16), (0.0, 8)])
def test_who_leaves_enters_out_of_sight_at_speed(factor: float, least: int) -> None:
    """A fast ego leaves them behind; from one that stands they drive away."""
    world = packed("figure8")
    if factor:
        engaged(world, factor)
    else:
        world.command(EGO, VehicleCommand(brake=1.0))
    s = world.states
    entered, kept = 0, []
    for tick in range(1800):
        x, y = s.x.copy(), s.y.copy()
        world.step()
        moved = np.hypot(s.x - x, s.y - y) > JUMP
        for i in np.flatnonzero(moved):
            assert np.hypot(x[i] - s.x[0], y[i] - s.y[0]) > UNSEEN - JUMP
            assert np.hypot(s.x[i] - s.x[0], s.y[i] - s.y[0]) > UNSEEN - JUMP
            assert np.hypot(s.vx[i], s.vy[i]) > 5.0
            entered += 1
        if tick % 20 == 10 and tick > 200:
            pack = pack_of(world)
            there = [pack.away(int(p["lane"]), float(p["s"])) is not None for p in world.placed[1:]]
            kept.append(sum(there))
    assert entered >= 2
    assert np.mean(kept) >= least
    assert world.events.background == ()


def test_more_than_the_published_places_enter_when_there_is_room() -> None:
    world = packed("figure8", vehicles=24)
    world.command(EGO, VehicleCommand(brake=1.0))
    assert world.states.present.sum() == 21
    for _ in range(400):
        world.step()
    assert world.states.present.sum() > 21


def test_a_carla_server_keeps_no_pack() -> None:
    carla = BackendChoice(backend=BackendKind.CARLA)
    with pytest.raises(ConfigError, match="pack"):
        RunSpec(course=Roads(traffic=TrafficStart.PACK), backend=carla)
