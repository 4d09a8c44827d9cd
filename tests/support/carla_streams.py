"""Streams of the CARLA server that keep what they are told."""

from __future__ import annotations

from skidpad.simulation.carla_server.protocol.streams import StreamHub


class Kept(StreamHub):
    """Keeps the payloads of all streams."""

    def __init__(self) -> None:
        super().__init__()
        self.told: dict[int, list[bytes]] = {}

    def has_listeners(self, stream: int) -> bool:
        return self.exists(stream)

    def publish(self, stream: int, *parts: bytes | memoryview) -> None:
        self.told.setdefault(stream, []).append(b"".join(bytes(p) for p in parts))
