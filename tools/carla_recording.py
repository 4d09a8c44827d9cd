"""Reads recordings of CARLA's, writes each packet again and says which have the same bytes.

    PYTHONPATH=src python tools/carla_recording.py srunner/metrics/data/*.log

Recordings by an Unreal server are in the repository of ScenarioRunner.
"""

from __future__ import annotations

import sys
from collections import Counter
from pathlib import Path

from skidpad.simulation.carla_server.recording import packets
from skidpad.simulation.carla_server.recording.packets import LogFrame, Packet


def write_again(packet: int, frame: LogFrame) -> bytes | None:
    """Returns a packet of a frame as this package writes it; None for one that it does not write."""
    if packet == Packet.FRAME_START:
        start = packets.pack_start(frame.number, frame.elapsed)
        return start[: packets.DURATION_AT] + packets.pack_duration(frame.duration) + start[-8:]
    if packet == Packet.FRAME_END:
        return packets.pack_end()
    if packet == Packet.EVENT_ADD:
        return packets.pack_added(frame.added)
    if packet == Packet.PLATFORM_TIME and frame.platform_time is not None:
        return packets.pack_platform_time(frame.platform_time)
    if packet in packets.RECORDS:
        return packets.pack_records(Packet(packet), frame.records[packet].tolist())
    return None


def compare(path: Path) -> None:
    """Prints what a recording holds, and per kind of packet how many there are and come back equal."""
    data = path.read_bytes()
    head, read = packets.read_log(path.name, data)
    frames = list(read)
    at, k = len(packets.pack_head(head.map, head.date)), -1
    assert data[:at] == packets.pack_head(head.map, head.date)
    found, same = Counter[str](), Counter[str]()
    while at < len(data):
        packet, size = packets._HEAD.unpack_from(data, at)
        k += packet == Packet.FRAME_START
        name = Packet(packet).name if packet in list(Packet) else f"packet {packet}"
        end = at + packets._HEAD.size + size
        found[name] += 1
        same[name] += write_again(packet, frames[k]) == data[at:end]
        at = end
    actors = Counter(packets.Kind(a.kind).name for frame in frames for a in frame.added)
    print(
        f"{path.name}: {head.map}, {len(frames)} frames of {frames[-1].elapsed:.1f} s, {dict(actors)}"
    )
    for name, number in found.items():
        print(f"  {name}: {number}, the same bytes {same[name]}")


if __name__ == "__main__":
    for path in sys.argv[1:]:
        compare(Path(path))
