"""Replaying: who was recorded appears, goes the recorded way, and is then free again."""

from __future__ import annotations

from dataclasses import replace
from math import hypot
from pathlib import Path

import pytest

from skidpad.core.geometry import Pose
from skidpad.core.vocabulary import LightState
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.methods.recording import start_recorder
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol.rpc import CallError
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.recording import packets
from skidpad.simulation.carla_server.recording.packets import Packet
from skidpad.simulation.carla_server.recording.replayer import CarlaRecording
from skidpad.simulation.carla_server.served import Served
from skidpad.simulation.carla_server.vehicles.control import Control

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
    served.recorder.start(NAME, episode.map.name)
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
    own = {a.blueprint.id: a.id for a in served.episode.actors}
    renamed = {
        id: own[a.blueprint]
        for id, a in source.kinds.items()
        if not a.blueprint.startswith("traffic")
    }
    kinds = {renamed[id]: source.kinds[id] for id in renamed}
    for frame in source.frames:
        rows = frame.records[Packet.POSITION].copy()
        rows["id"] = [renamed[id] for id in rows["id"].tolist()]
        frame.records[Packet.POSITION] = rows
    served.replayer.start(served.episode, replace(source, kinds=kinds), 0.0, 0.0, 0)
    served.tick()
    assert [a.id for a in served.episode.actors] == ids


def test_lights_controls_lamps_and_weather_are_played(tmp_path: Path) -> None:
    options = ServerOptions(data_dir=tmp_path, map="town")
    served = Served(options, StreamHub())
    episode = served.episode
    car = episode.spawn(Wanted("vehicle.tesla.model3", {}), episode.map.spawn_points[0])
    vehicle, lights = episode.vehicles.of(car.id), episode.moving.lights
    ids = [id for id, _ in episode.posts]
    rain, shown = [0.0, 80.0, *episode.sky.pack()[2:]], []
    served.recorder.start(NAME, episode.map.name)
    for k in range(TICKS):
        if k == TICKS // 2:
            lights.set_state(episode.posts.light(ids[0]), LightState.OFF)
            vehicle.control, vehicle.lights = Control(brake=0.5, steer=0.1), 0x9
            episode.sky.apply(rain)
        served.tick()
        shown.append([episode.posts.light(id).state for id in ids])
    served.recorder.stop()
    assert shown[0] != shown[-1]

    served = Served(options, StreamHub())
    episode = served.episode
    for light in episode.moving.lights.lights:
        light.show(LightState.UNKNOWN)
    dry = episode.sky.pack()
    replay(served)
    for k in range(1, TICKS):
        served.tick()
        now = [post.light.state for _, post in episode.posts]
        assert now == shown[k], k
        (vehicle,) = episode.vehicles
        late = k >= TICKS // 2
        assert episode.sky.pack() == pytest.approx(rain if late else dry)
        assert vehicle.lights == (0x9 if late else 0)
        if k < TICKS - 1:
            assert vehicle.control.brake == (0.5 if late else 0.0)
            assert vehicle.control.steer == pytest.approx(0.1 if late else 0.0)
    assert vehicle.control == Control()  # no driver any more


@pytest.mark.parametrize("ignore", [True, False])
def test_the_spectator_goes_its_recorded_way_if_asked(tmp_path: Path, ignore: bool) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    served.episode.spectator.pose = Pose(1.0, 2.0, 3.0)
    served.recorder.start(NAME, served.episode.map.name)
    served.tick()
    served.tick()
    served.episode.spectator.pose = Pose(9.0, 9.0, 9.0)
    served.recorder.stop()
    served.replayer.ignore_spectator = ignore
    replay(served)
    pose = served.episode.spectator.pose
    assert (pose.x, pose.y, pose.z) == pytest.approx((9.0, 9.0, 9.0) if ignore else (1.0, 2.0, 3.0))


def test_attributes_that_are_not_offered_leave_out_their_actor(recorded, tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    source = served.recorder.recording(NAME)
    foreign = ((0, "use_wheelchair", "true"),)
    kinds = {
        id: replace(a, attributes=foreign) if a.blueprint.startswith("walker") else a
        for id, a in source.kinds.items()
    }
    served.replayer.start(served.episode, replace(source, kinds=kinds), 0.0, 0.0, 0)
    served.tick()
    assert places(served).keys() == {"vehicle.tesla.model3", "vehicle.audi.tt"}


def test_a_replay_that_cannot_begin_leaves_the_server_ticking(
    recorded, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())

    def fail(*_: object) -> None:
        raise CallError("no actors today")

    monkeypatch.setattr(served.episode, "place", fail)
    with pytest.raises(CallError):
        replay(served)
    served.tick()


@pytest.mark.parametrize("name", ["", "."])
def test_a_recording_that_is_refused_leaves_the_replay_running(
    recorded, tmp_path: Path, name: str
) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    replay(served)
    with pytest.raises(CallError):
        start_recorder(served, name)
    for _ in range(3):
        served.tick()
    car = "vehicle.tesla.model3"
    assert places(served)[car] == pytest.approx(recorded[3][car], abs=2e-3)
    assert not served.episode.moving.rows.simulated.any()
    start_recorder(served, "other.log")
    assert served.episode.moving.rows.simulated.all()


@pytest.mark.parametrize("frozen", [True, False])
def test_lights_stand_still_after_a_replay_where_they_did_before(
    tmp_path: Path, frozen: bool
) -> None:
    options = ServerOptions(data_dir=tmp_path, map="town")
    served = Served(options, StreamHub())
    served.episode.moving.lights.frozen = frozen
    served.recorder.start(NAME, served.episode.map.name)
    served.tick()
    served.tick()
    served.recorder.stop()

    served = Served(options, StreamHub())
    groups = served.episode.moving.lights.groups.values()
    for group in groups:
        group.frozen = not frozen
    replay(served)
    assert {group.frozen for group in groups} == {frozen}
    served.replayer.stop(keep_actors=True)
    assert {group.frozen for group in groups} == {not frozen}


def test_a_load_ends_the_recording(tmp_path: Path) -> None:
    served = Served(ServerOptions(data_dir=tmp_path), StreamHub())
    served.recorder.start(NAME, served.episode.map.name)
    served.tick()
    served.load("", reset_settings=False)
    served.tick()
    assert "Frames: 1\n" in served.recorder.summary(NAME)


@pytest.mark.parametrize(
    ("frames", "words"),
    [
        ([], "no frames"),
        ([(1, 0.0), (3, 0.0)], "times do not grow"),
        ([(1, 0.0), (3, float("nan"))], "frame 3 its time is nan; allowed is -1e\\+12 to 1e\\+12"),
        ([(1, 0.0), (3, float("inf"))], "frame 3 its time is inf"),
        ([(1, 0.0), (2, 0.05)], "frame 2 POSITION place is inf; allowed is -1e\\+12 to 1e\\+12"),
    ],
)
def test_what_cannot_be_replayed_is_refused(
    served: Served, tmp_path: Path, frames: list[tuple[int, float]], words: str
) -> None:
    data = packets.pack_head("figure8", 0)
    for number, elapsed in frames:
        x = float("inf") if number == 2 else 0.0
        row = (7, (x, 0.0, 0.0), (0.0, 0.0, 0.0))
        data += packets.pack_start(number, elapsed)
        data += packets.pack_records(Packet.POSITION, [row]) + packets.pack_end()
    (tmp_path / NAME).write_bytes(data)
    with pytest.raises(CallError, match=rf"drive\.log .*{words}"):
        served.recorder.recording(NAME)
