"""Readers of recordings of channels and of what a monitor left of them, for tests that damage them."""

from __future__ import annotations

from functools import cache
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from support.channel_worlds import Eyes, World, drive
from support.faults import mutation, small_files
from support.faults.message_mutation import mutated_messages
from support.faults.readers import BYTES_OR_JSON, BYTES_OR_TABLE, Reader


@cache
def recording() -> bytes:
    from skidpad.recording.channels.mcap_files import ChannelWriter

    world = World((0.0, 0.0, 0.0, 15.0, 0.0), np.array([(50.0, 3.5, 0, 15, 0), (-9, 0, 0, 16, 0)]))
    listed = drive(world, (Eyes("left", 0.03), Eyes("right", 0.03)), 0.3)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "a.mcap"
        with ChannelWriter(path, listed.channels) as writer:
            for channel, item in listed.rows:
                writer.add(item, channel)
        return path.read_bytes()


def read_recording(path: Path) -> object:
    """A recording through the whole monitor."""
    from skidpad.evidence.channels.monitor import MonitorSettings
    from skidpad.live.watch import watch
    from skidpad.recording.sources import open_channels

    out = path.parent / "watched"
    with np.errstate(all="ignore"):
        return watch(open_channels(path, truth=False), out, MonitorSettings())


@cache
def watched() -> dict[str, bytes]:
    from skidpad.evidence.channels.monitor import MonitorSettings
    from skidpad.live.watch import Timer, watch

    others = np.array([(-11.0, 0, 0, 15.5, 0), (50.0, 3.5, 0, 15, 0)])
    world = World((0.0, 0.0, 0.0, 15.0, 0.0), others)
    with TemporaryDirectory() as folder:
        out = Path(folder) / "out"
        eyes = (Eyes("lav", 0.03), Eyes("tfuse", 0.03, blind=(0,)))
        watch(drive(world, eyes, 12.0), out, MonitorSettings(), Timer(count(0, 1000).__next__))
        found = {p.name: p.read_bytes() for p in out.iterdir()}
    return found | {"hazards.txt": small_files.short_record(found["hazards.txt"])}


def read_indicators(path: Path) -> object:
    from skidpad.evidence.channels.case import evidence_lines
    from skidpad.recording.channels.indicators import read_indicators

    return list(evidence_lines(read_indicators(path.parent)))


def read_page(path: Path) -> object:
    """The page of a monitored drive, whose other files are whole."""
    from skidpad.report.channels.page import write_drive_report

    for name, content in watched().items():
        if name != path.name:
            (path.parent / name).write_bytes(content)
    with np.errstate(all="ignore"):
        return write_drive_report(path.parent)


def read_hazards(path: Path) -> object:
    from skidpad.recording.hazards.records import read_hazards
    from skidpad.scenarios.export.hazard_export import export_hazard

    return [export_hazard(r, path.parent / "scenarios") for r in read_hazards(path.parent)]


def list_hazards(path: Path) -> object:
    from skidpad.cli.channels.hazards import lines
    from skidpad.recording.hazards.records import read_index

    return list(lines(read_index(path.parent)))


READERS = {
    "recording": Reader(
        "a.mcap", lambda: [recording()], read_recording,
        (mutation.mutated, mutated_messages, mutated_messages)),
    "indicators": Reader(
        "indicators.parquet", lambda: [watched()["indicators.parquet"]], read_indicators, BYTES_OR_TABLE),
    "page": Reader(
        "monitor.json", lambda: [watched()["monitor.json"]], read_page, BYTES_OR_JSON, share=0.1, most=5000),
    "page-times": Reader(
        "timing.parquet", lambda: [watched()["timing.parquet"]], read_page, BYTES_OR_TABLE, share=0.1,
        most=5000),
    "hazards": Reader("hazards.txt", lambda: [watched()["hazards.txt"]], read_hazards),
    "index": Reader("hazards.jsonl", lambda: [watched()["hazards.jsonl"]], list_hazards, BYTES_OR_JSON),
}  # fmt: skip
