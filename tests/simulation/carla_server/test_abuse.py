"""Clients that misbehave on real sockets: the server answers or hangs up, stays up, stays small."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import msgpack
import pytest

from skidpad.simulation.carla_server import server as module
from skidpad.simulation.carla_server.options import ServerOptions
from skidpad.simulation.carla_server.protocol import streams
from skidpad.simulation.carla_server.server import CarlaServer, Ports

Scene = Callable[[CarlaServer, Ports], Awaitable[None]]


def played(scene: Scene, tmp_path: Path) -> CarlaServer:
    """Run `scene` against a server in this process."""

    async def run() -> CarlaServer:
        server = CarlaServer(ServerOptions(port=0, data_dir=tmp_path))
        ports = await server.open()
        try:
            await asyncio.wait_for(scene(server, ports), 60.0)
        finally:
            server.close()
        return server

    return asyncio.run(run())


class Caller:
    """A bare client."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.reader, self.writer = reader, writer
        self._unpacker = msgpack.Unpacker(raw=False)

    @classmethod
    async def connect(cls, port: int) -> Caller:
        return cls(*await asyncio.open_connection("127.0.0.1", port))

    async def call(self, method: str, *arguments: Any) -> Any:
        self.writer.write(msgpack.packb([0, 1, method, [[False], *arguments]]))
        while True:
            for message in self._unpacker:
                return message
            data = await self.reader.read(65536)
            if not data:
                raise ConnectionError
            self._unpacker.feed(data)


async def is_up(ports: Ports) -> None:
    caller = await Caller.connect(ports.rpc)
    assert (await caller.call("version"))[3] == [[1, "0.9.16"]]
    caller.writer.close()


def test_garbage_closes_that_client_only(tmp_path: Path) -> None:
    async def scene(_: CarlaServer, ports: Ports) -> None:
        good = await Caller.connect(ports.rpc)
        rng = random.Random(1)
        for _ in range(60):
            bad = await Caller.connect(ports.rpc)
            bad.writer.write(b"\xc1" + rng.randbytes(rng.randint(0, 300)))
            assert await bad.reader.read() == b""
            bad.writer.close()
        assert (await good.call("version"))[3] == [[1, "0.9.16"]]

    played(scene, tmp_path)


def test_clients_that_vanish_mid_message_leave_nothing(tmp_path: Path) -> None:
    async def scene(server: CarlaServer, ports: Ports) -> None:
        request = msgpack.packb([0, 1, "get_actor_definitions", [[False]]])
        for cut in range(1, len(request)):
            caller = await Caller.connect(ports.rpc)
            caller.writer.write(request[:cut])
            await caller.writer.drain()
            caller.writer.transport.abort()
        await is_up(ports)
        await asyncio.sleep(0.2)
        assert len(server._clients) <= 1

    played(scene, tmp_path)


def test_a_client_that_never_reads_is_bounded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "MAX_UNREAD", 2_000_000)

    async def scene(server: CarlaServer, ports: Ports) -> None:
        caller = await Caller.connect(ports.rpc)
        request = msgpack.packb([0, 1, "get_actor_definitions", [[False]]])
        caller.writer.write(request * 400)
        await asyncio.sleep(1.0)
        held = [c._transport.get_write_buffer_size() for c in server._clients if c._transport]
        assert sum(held) <= 4_000_000
        await is_up(ports)
        caller.writer.transport.abort()

    played(scene, tmp_path)


def test_streams_are_bounded_in_number_and_in_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(streams, "MAX_CONNECTIONS", 50)
    monkeypatch.setattr(streams, "MAX_PENDING", 100_000)

    async def scene(server: CarlaServer, ports: Ports) -> None:
        deaf = []
        for _ in range(120):
            _, writer = await asyncio.open_connection("127.0.0.1", ports.streaming)
            writer.write((1).to_bytes(4, "little"))
            deaf.append(writer)
        await asyncio.sleep(0.3)
        assert len(server.hub._listeners[1]) <= 50
        for _ in range(40):
            server.hub.publish(1, b"0" * 90_000)
            await asyncio.sleep(0)
        pending = [t.get_write_buffer_size() for t in server.hub._listeners[1]]
        assert max(pending) <= 190_000
        for writer in deaf:
            writer.transport.abort()
        await asyncio.sleep(0.3)
        assert server.hub._listeners[1] == []
        await is_up(ports)

    played(scene, tmp_path)


def test_unknown_streams_are_hung_up(tmp_path: Path) -> None:
    async def scene(_: CarlaServer, ports: Ports) -> None:
        reader, writer = await asyncio.open_connection("127.0.0.1", ports.streaming)
        writer.write((999_999).to_bytes(4, "little"))
        assert await reader.read() == b""
        writer.close()

    played(scene, tmp_path)


def test_a_long_life_does_not_grow(tmp_path: Path) -> None:
    """Spawn, drive, listen, destroy, reload, again and again: every table ends as it began."""

    async def scene(server: CarlaServer, ports: Ports) -> None:
        caller = await Caller.connect(ports.rpc)
        settings = [True, False, [True, 0.05], True, 0.01, 10, 0.0, True, 3e3, 2e3, True]
        await caller.call("set_episode_settings", settings)
        points = (await caller.call("get_map_info"))[3][0][1][1]
        begin = len(server.served.episode.actors)
        for turn in range(30):
            ids = []
            for point in points[: 5 + turn % 3]:
                answer = (await caller.call("spawn_actor", [0, "vehicle.audi.tt", []], point))[3]
                assert answer[0][0] == 1, answer
                ids.append(answer[0][1][0])
            for id in ids[:2]:
                sensor = [0, "sensor.other.imu", []]
                where = [[0.0, 0.0, 1.0], [0.0, 0.0, 0.0]]
                await caller.call("spawn_actor_with_parent", sensor, where, id, 0, "")
            for _ in range(5):
                await caller.call("tick_cue")
            if turn % 10 == 9:
                await caller.call("load_new_episode", "", False, 0)
            else:
                for id in ids:
                    assert (await caller.call("destroy_actor", id))[3] == [[1, True]]
            episode = server.served.episode
            assert len(episode.actors) == episode.rows.count == begin
            assert len(episode.vehicles) == 0
            assert not episode.sensors._sensors
            assert server.hub._open == {1}
        caller.writer.close()

    played(scene, tmp_path)


def test_a_dead_vehicles_box_is_answered(tmp_path: Path) -> None:
    """An error here would abort the Traffic Manager's thread in the client."""

    async def scene(_: CarlaServer, ports: Ports) -> None:
        caller = await Caller.connect(ports.rpc)
        points = (await caller.call("get_map_info"))[3][0][1][1]
        spawned = await caller.call("spawn_actor", [0, "vehicle.audi.tt", []], points[0])
        id = spawned[3][0][1][0]
        alive = await caller.call("get_actor_bounding_box", id)
        await caller.call("destroy_actor", id)
        assert (await caller.call("get_actor_bounding_box", id))[3] == alive[3]
        assert (await caller.call("get_actor_bounding_box", 12345))[3][0][0] == 1
        for port in ("x", -1, 2**40, None):
            for method in ("is_traffic_manager_running", "get_traffic_manager_running"):
                assert (await caller.call(method, port))[3][0][0] == 1

    played(scene, tmp_path)


@pytest.mark.parametrize("name", ["../../etc/passwd", "/etc/passwd", "..\\x", "", "..", "a\x00b"])
def test_files_stay_in_the_data_folder(tmp_path: Path, name: str) -> None:
    async def scene(server: CarlaServer, ports: Ports) -> None:
        caller = await Caller.connect(ports.rpc)
        await caller.call("start_recorder", name, False)
        await caller.call("stop_recorder")
        assert (await caller.call("request_file", name))[3][0][0] in (0, 1)

    folder = tmp_path / "data"
    folder.mkdir()
    played(scene, folder)
    assert {p.name for p in tmp_path.iterdir()} == {"data"}
    assert all(p.name in {"passwd", "x"} for p in folder.iterdir())
