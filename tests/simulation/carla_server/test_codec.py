from __future__ import annotations

import random
from typing import Any

import msgpack
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.simulation.carla_server.protocol import codec
from skidpad.simulation.carla_server.protocol.codec import Decoder, ProtocolError, Request


def decoded(data: bytes) -> list[Request]:
    return list(Decoder().feed(data))


def test_metadata_says_whether_the_client_waits() -> None:
    waits = msgpack.packb([0, 7, "version", [[False]]])
    ignores = msgpack.packb([0, 8, "apply_control_to_vehicle", [[True], 5, [0.0]]])
    assert decoded(waits + ignores) == [
        Request(7, "version", [], True),
        Request(8, "apply_control_to_vehicle", [5, [0.0]], False),
    ]


def test_text_and_bytes_travel_as_different_types() -> None:
    packed = msgpack.unpackb(codec.answer(1, ["text", b"bytes"]))
    assert packed == [1, 1, None, ["text", b"bytes"]]


@given(cut=st.lists(st.integers(1, 40), max_size=20))
def test_requests_arrive_whole_however_the_stream_is_cut(cut: list[int]) -> None:
    stream = b"".join(
        msgpack.packb([0, i, "method", [[False], "x" * i, [1.5, None, True]]]) for i in range(12)
    )
    decoder, found = Decoder(), []
    for size in [*cut, len(stream)]:
        found += list(decoder.feed(stream[:size]))
        stream = stream[size:]
    assert [r.msgid for r in found] == list(range(12))


@given(st.binary(max_size=400))
def test_any_bytes_give_requests_or_a_protocol_error(data: bytes) -> None:
    try:
        requests = decoded(data)
    except ProtocolError:
        return
    assert all(isinstance(r, Request) for r in requests)


def test_mutated_requests_never_raise_anything_else() -> None:
    rng = random.Random(5)
    good = msgpack.packb([0, 3, "spawn_actor", [[False], [1, "vehicle.a", []], [[1.0] * 3] * 2]])
    outcomes = set()
    for _ in range(3000):
        bad = bytearray(good)
        for _ in range(rng.randint(1, 4)):
            bad[rng.randrange(len(bad))] = rng.randrange(256)
        try:
            decoded(bytes(bad))
            outcomes.add("request")
        except ProtocolError:
            outcomes.add("refused")
    assert outcomes == {"request", "refused"}


@pytest.mark.parametrize(
    "message",
    [
        17,
        "text",
        {},
        [],
        [0, 1, "m"],
        [1, 1, None, None],
        [0, -1, "m", []],
        [0, 2**32, "m", []],
        [0, 1, b"m", []],
        [0, 1, "m", {}],
        [True, 1, "m", []],
    ],
)
def test_other_messages_are_refused(message: Any) -> None:
    with pytest.raises(ProtocolError):
        decoded(msgpack.packb(message))


@pytest.mark.parametrize(
    "data",
    [
        b"\xdd\xff\xff\xff\xff",  # an array of 2^32 - 1
        b"\x91" * 100_000,  # arrays in arrays
        b"\xc7\x10\x01" + b"0" * 16,  # an extension type
    ],
)
def test_huge_or_deep_messages_are_refused_at_once(data: bytes) -> None:
    with pytest.raises(ProtocolError):
        decoded(data)


@pytest.mark.parametrize(
    "start",
    [
        b"\xdb\xff\xff\xff\xff",  # a text of 4 GiB
        b"\xc6\xff\xff\xff\xff",  # bytes of 4 GiB
        b"\x94\x00\x01\xa1m\xdc\xff\xff\xc6\x7f\xff\xff\xff",
    ],
)
def test_a_message_without_end_is_refused_at_the_limit(start: bytes) -> None:
    decoder = Decoder()

    def go_on() -> None:
        list(decoder.feed(start))
        for _ in range(codec.MAX_MESSAGE // 2**20 + 2):
            list(decoder.feed(b"0" * 2**20))

    with pytest.raises(ProtocolError):
        go_on()
