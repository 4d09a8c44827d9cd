"""Replaying: who was recorded appears, goes the recorded way, and is then free again."""

from __future__ import annotations

import json
from math import hypot
from pathlib import Path

import pytest

from skidpad.simulation.carla_server.replayer import Recording
from skidpad.simulation.carla_server.rpc import CallError
from skidpad.simulation.carla_server.spawning import spawn
from skidpad.simulation.carla_server.streams import StreamHub
from skidpad.simulation.carla_server.world import ServerOptions, World

TICKS = 20
NAME = "drive.log"


def places(world: World) -> dict[str, tuple[float, float]]:
    """Where each vehicle and walker is, by blueprint."""
    found = {}
    for actor in world.actors:
        if actor.family.value in ("vehicle", "walker"):
            pose = world.pose(actor)
            found[actor.blueprint.id] = (pose.x, pose.y)
    return found


@pytest.fixture
def recorded(tmp_path: Path) -> list[dict[str, tuple[float, float]]]:
    """A recording of a hero, a car that vanishes half-way and a walker; what happened in it."""
    world = World(ServerOptions(data_dir=tmp_path), StreamHub())
    first, second, third = world.map.spawn_points[:3]
    spawn(world, [0, "vehicle.tesla.model3", [["role_name", 4, "hero"]]], first)
    gone = spawn(world, [0, "vehicle.audi.tt", []], second)
    spawn(world, [0, "walker.pedestrian.0001", []], third)
    world.vehicles.fleet.states.vx[:] = 8.0
    world.recorder.start(NAME, world)
    seen = []
    for k in range(TICKS):
        if k == TICKS // 2:
            world.destroy(gone.id)
        world.tick()
        seen.append(places(world))
    world.recorder.stop()
    return seen


def replay(world: World, begin: float = 0.0, duration: float = 0.0) -> Recording:
    """Begin a replay; what is replayed."""
    source = world.recorder.recording(NAME)
    world.replayer.start(world, source, begin, duration, 0)
    return source


def test_a_fresh_world_shows_what_was_recorded(recorded, tmp_path: Path) -> None:
    world = World(ServerOptions(data_dir=tmp_path), StreamHub())
    replay(world)
    for k in range(1, TICKS):
        world.tick()
        now = places(world)
        assert now.keys() == recorded[k].keys(), k
        for id, place in now.items():
            assert place == pytest.approx(recorded[k][id], abs=2e-3), (k, id)
    (car,) = world.vehicles.members
    assert car.simulated  # physics has it again, at the speed that it had
    x, y = places(world)[car.type.title]
    world.tick()
    now_x, now_y = places(world)[car.type.title]
    assert hypot(now_x - x, now_y - y) == pytest.approx(0.05 * 8.0, rel=0.2)


def test_a_part_from_the_end_at_double_speed(recorded, tmp_path: Path) -> None:
    world = World(ServerOptions(data_dir=tmp_path), StreamHub())
    world.replayer.time_factor = 2.0
    replay(world, begin=-0.4)
    for k in (13, 15, 17):
        world.tick()
        assert places(world)["vehicle.tesla.model3"] == pytest.approx(
            recorded[k]["vehicle.tesla.model3"], abs=2e-3
        )


def test_the_hero_can_be_left_out(recorded, tmp_path: Path) -> None:
    world = World(ServerOptions(data_dir=tmp_path), StreamHub())
    world.replayer.ignore_hero = True
    replay(world)
    world.tick()
    assert "vehicle.tesla.model3" not in places(world)
    assert "vehicle.audi.tt" in places(world)
    world.replayer.stop(world, keep_actors=False)
    assert list(places(world)) == ["walker.pedestrian.0001"]  # the other car vanished in it


def test_living_actors_play_themselves(recorded, tmp_path: Path) -> None:
    world = World(ServerOptions(data_dir=tmp_path), StreamHub())
    replay(world)
    ids = [a.id for a in world.actors]
    source = world.recorder.recording(NAME)
    renamed = dict(zip(source.kinds, sorted(ids)[-3:], strict=True))
    again = Recording(
        source.map,
        source.times,
        [{renamed[id]: p for id, p in tick.items()} for tick in source.poses],
        {renamed[id]: kind for id, kind in source.kinds.items()},
    )
    world.replayer.start(world, again, 0.0, 0.0, 0)
    world.tick()
    assert [a.id for a in world.actors] == ids


@pytest.mark.parametrize(
    "lines",
    [
        ['{"map": "figure8", "format": 1}', "[1, 0.0, [], []]"],
        ['{"map": "figure8", "format": 2}'],
        ['{"map": "figure8", "format": 2}', "[1, 0.0, [], [], 7]"],
        ['{"map": "figure8", "format": 2}', "[1, 0.0, [[1, [0, 0], [0, 0, 0]]], [], []]"],
        ['{"map": "figure8", "format": 2}', "[1, 0.0, [], [], []]", "[2, 0.0, [], [], []]"],
        ['{"map": "figure8", "format": 2}', '[1, 0.0, [], [], [[1, "vehicle.audi.tt", [2]]]]'],
        ['{"map": "figure8", "format": 2}', "[1, 0.0, [[1, [NaN, 0, 0], [0, 0, 0]]], [], []]"],
        ["[]", "[1, 0.0, [], [], []]"],
    ],
)
def test_other_files_are_refused(world: World, tmp_path: Path, lines: list[str]) -> None:
    assert all(json.loads(line) is not None for line in lines)
    (tmp_path / NAME).write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(CallError, match=r"drive\.log"):
        world.recorder.recording(NAME)
