"""Replaying: who was recorded appears, goes the recorded way, and is then free again."""

from __future__ import annotations

import json
from math import hypot
from pathlib import Path

import pytest

from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.recording.replayer import CarlaRecording
from skidpad.simulation.carla_server.served import Served

TICKS = 20
NAME = "drive.log"


def places(served: Served) -> dict[str, tuple[float, float]]:
    """Where each vehicle and walker is, by blueprint."""
    found = {}
    for actor in served.episode.actors:
        if actor.family.value in ("vehicle", "walker"):
            pose = served.episode.actors.pose(actor)
            found[actor.blueprint.id] = (pose.x, pose.y)
    return found


@pytest.fixture
def recorded(tmp_path: Path) -> list[dict[str, tuple[float, float]]]:
    """A recording of a hero, a car that vanishes half-way and a walker; what happened in it."""
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    episode = served.episode
    first, second, third = episode.map.spawn_points[:3]
    episode.spawn(Wanted("vehicle.tesla.model3", {"role_name": "hero"}), first)
    gone = episode.spawn(Wanted("vehicle.audi.tt", {}), second)
    episode.spawn(Wanted("walker.pedestrian.0001", {}), third)
    episode.moving.fleet.states.vx[:] = 8.0
    served.recorder.start(NAME, episode.map.name, served.clock)
    seen = []
    for k in range(TICKS):
        if k == TICKS // 2:
            episode.destroy(gone.id)
        served.tick()
        seen.append(places(served))
    served.recorder.stop()
    return seen


def replay(served: Served, begin: float = 0.0, duration: float = 0.0) -> CarlaRecording:
    """Begin a replay; what is replayed."""
    source = served.recorder.recording(NAME)
    served.replayer.start(served.episode, source, begin, duration, 0)
    return source


def test_a_fresh_world_shows_what_was_recorded(recorded, tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    replay(served)
    for k in range(1, TICKS):
        served.tick()
        now = places(served)
        assert now.keys() == recorded[k].keys(), k
        for id, place in now.items():
            assert place == pytest.approx(recorded[k][id], abs=2e-3), (k, id)
    (car,) = served.episode.vehicles
    assert served.episode.moving.rows.simulated[0]  # physics has it again, at the speed that it had
    x, y = places(served)[car.type.title]
    served.tick()
    now_x, now_y = places(served)[car.type.title]
    assert hypot(now_x - x, now_y - y) == pytest.approx(0.05 * 8.0, rel=0.2)


def test_a_part_from_the_end_at_double_speed(recorded, tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    served.replayer.time_factor = 2.0
    replay(served, begin=-0.4)
    for k in (13, 15, 17):
        served.tick()
        assert places(served)["vehicle.tesla.model3"] == pytest.approx(
            recorded[k]["vehicle.tesla.model3"], abs=2e-3
        )


def test_the_hero_can_be_left_out(recorded, tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    served.replayer.ignore_hero = True
    replay(served)
    served.tick()
    assert "vehicle.tesla.model3" not in places(served)
    assert "vehicle.audi.tt" in places(served)
    served.replayer.stop(keep_actors=False)
    assert list(places(served)) == ["walker.pedestrian.0001"]  # the other car vanished in it


def test_living_actors_play_themselves(recorded, tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    replay(served)
    ids = [a.id for a in served.episode.actors]
    source = served.recorder.recording(NAME)
    renamed = dict(zip(source.kinds, sorted(ids)[-3:], strict=True))
    again = CarlaRecording(
        source.map,
        source.times,
        [{renamed[id]: p for id, p in tick.items()} for tick in source.poses],
        {renamed[id]: kind for id, kind in source.kinds.items()},
    )
    served.replayer.start(served.episode, again, 0.0, 0.0, 0)
    served.tick()
    assert [a.id for a in served.episode.actors] == ids


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
def test_other_files_are_refused(served: Served, tmp_path: Path, lines: list[str]) -> None:
    assert all(json.loads(line) is not None for line in lines)
    (tmp_path / NAME).write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(CallError, match=r"drive\.log"):
        served.recorder.recording(NAME)
