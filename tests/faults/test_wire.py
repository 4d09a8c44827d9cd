"""What a client sends costs the server about as much memory as it has bytes."""

import random
import tracemalloc

import pytest

msgpack = pytest.importorskip("msgpack", reason="needs the extra server")

from skidpad.simulation.carla_server.protocol.codec import Decoder, ProtocolError, Request  # noqa: E402

ARRAY_32 = b"\xdd"


def peak(data):
    """Bytes of memory at most while these bytes are decoded."""
    decoder = Decoder()
    tracemalloc.start()
    try:
        list(decoder.feed(data))
    except ProtocolError:
        pass
    finally:
        taken = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return taken


def test_heads_of_arrays_that_never_come_take_no_memory():
    nested = (ARRAY_32 + (99_000).to_bytes(4, "big")) * 500
    assert peak(nested) < 100_000
    assert peak(b"\xde\xff\xff" * 800) < 100_000


def test_requests_arrive_whole_however_they_are_cut():
    requests = [[0, k, f"method {k}", [[False], k, ["a" * k, {"b": 1.5}]]] for k in range(40)]
    data, rng = b"".join(map(msgpack.packb, requests)), random.Random(1)
    for _ in range(20):
        decoder, got, rest = Decoder(), [], data
        while rest:
            n = rng.randint(1, 300)
            got += decoder.feed(rest[:n])
            rest = rest[n:]
        assert got == [
            Request(k, f"method {k}", [k, ["a" * k, {"b": 1.5}]], True) for k in range(40)
        ]


def test_any_bytes_are_requests_or_a_protocol_error():
    good, rng = msgpack.packb([0, 1, "get_world", [[False], 1, "x", [1.0, 2.0]]]), random.Random(4)
    for _ in range(3000):
        data = bytearray(good * 3)
        for _ in range(rng.randint(1, 4)):
            data[rng.randrange(len(data))] = rng.randrange(256)
        assert peak(bytes(data)) < 10_000_000
