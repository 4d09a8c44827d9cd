"""What the hub does to its listeners, without a network."""

from __future__ import annotations

import asyncio
from typing import Any

from skidpad.simulation.carla_server.protocol import streams
from skidpad.simulation.carla_server.protocol.streams import (
    EPISODE_STREAM,
    TOKEN,
    StreamHub,
    canonical,
)


class Wire:
    """A transport that remembers."""

    def __init__(self) -> None:
        self.sent: list[bytes] = []
        self.closed = False

    def write(self, data: bytes) -> None:
        self.sent.append(data)

    def close(self) -> None:
        self.closed = True

    def is_closing(self) -> bool:
        return self.closed

    def get_write_buffer_size(self) -> int:
        return 0


def listener(hub: StreamHub, stream: int) -> Any:
    wire: Any = Wire()
    hub.subscribe(stream, wire)
    return wire


def test_each_episode_of_a_client_has_its_own_id_for_the_same_snapshots() -> None:
    hub = StreamHub()
    ids = [TOKEN.unpack(hub.episode_token())[0] for _ in range(3)]
    assert len(set(ids)) == 3
    assert {canonical(i) for i in ids} == {EPISODE_STREAM}
    assert all(hub.exists(i) for i in ids)


def test_held_listeners_get_the_newest_message_later(monkeypatch: Any) -> None:
    monkeypatch.setattr(streams, "HOLD", 0.01)

    async def play() -> tuple[Any, Any]:
        hub = StreamHub()
        old = listener(hub, EPISODE_STREAM)
        hub.hold(EPISODE_STREAM)
        new = listener(hub, EPISODE_STREAM)
        for text in (b"one", b"two"):
            hub.publish(EPISODE_STREAM, text)
        assert old.sent == []
        assert len(new.sent) == 2
        await asyncio.sleep(0.05)
        hub.publish(EPISODE_STREAM, b"three")
        return old, new

    old, new = asyncio.run(play())
    assert [m[4:] for m in old.sent] == [b"two", b"three"]
    assert [m[4:] for m in new.sent] == [b"one", b"two", b"three"]


def test_listeners_of_a_closed_stream_may_hang_up_first(monkeypatch: Any) -> None:
    monkeypatch.setattr(streams, "GRACE", 0.01)

    async def play() -> tuple[bool, bool]:
        hub = StreamHub()
        stream = hub.create()
        wire = listener(hub, stream)
        hub.close(stream)
        at_once = wire.closed
        hub.publish(stream, b"late")
        await asyncio.sleep(0.05)
        assert wire.sent == []
        return at_once, wire.closed

    assert asyncio.run(play()) == (False, True)


def test_who_asks_for_a_stream_that_ended_is_kept_waiting() -> None:
    """Hung up on, the client would connect again at once and for ever."""

    async def play() -> tuple[bool, bool]:
        hub = StreamHub()
        stream = hub.create()
        hub.close(stream)
        return listener(hub, stream).closed, listener(hub, stream + 1).closed

    assert asyncio.run(play()) == (False, True)


def test_a_tick_waits_for_streams_on_their_way_but_not_for_ever(monkeypatch: Any) -> None:
    monkeypatch.setattr(streams, "PATIENCE", 0.03)

    async def play() -> list[str]:
        hub, said = StreamHub(), []
        one, two = hub.create(), hub.create()
        hub.announce(one)
        hub.announce(two)
        hub.when_complete(lambda: said.append("go"))
        listener(hub, one)
        await asyncio.sleep(0.005)
        said.append("one is missing" if not hub.complete else "complete")
        listener(hub, two)
        await asyncio.sleep(0.005)
        hub.announce(two)
        hub.when_complete(lambda: said.append("in vain"))
        await asyncio.sleep(0.06)
        return said

    assert asyncio.run(play()) == ["one is missing", "go", "in vain"]


def test_a_client_cleans_up_when_it_left_the_stream_of_a_sensor_that_is_destroyed() -> None:
    async def play() -> list[bool]:
        hub, seen = StreamHub(), []
        stopped, heard = hub.create(), hub.create()
        wire, _ = listener(hub, stopped), listener(hub, heard)
        hub.close(heard)  # destroyed while it is heard: nothing was stopped
        seen.append(hub.is_client_cleaning_up())
        hub.release(stopped, wire)  # stopped, and alive
        seen.append(hub.is_client_cleaning_up())
        hub.close(stopped)
        seen.append(hub.is_client_cleaning_up())
        return seen

    assert asyncio.run(play()) == [False, False, True]


def test_cleaning_up_ends_after_a_moment(monkeypatch: Any) -> None:
    monkeypatch.setattr(streams, "GRACE", 0.01)

    async def play() -> bool:
        hub = StreamHub()
        stream = hub.create()
        hub.release(stream, listener(hub, stream))
        hub.close(stream)
        await asyncio.sleep(0.03)
        return hub.is_client_cleaning_up()

    assert not asyncio.run(play())
