"""Channels through the monitor, recorded or driving now, and what it leaves in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from itertools import chain, islice
from pathlib import Path
from typing import TextIO

import polars as pl

from skidpad.core.channels import Context, Cycle
from skidpad.core.errors import FileError, OutputError
from skidpad.evidence.channels.indicators.panel import no_lap
from skidpad.evidence.channels.monitor import Monitor, MonitorSettings
from skidpad.evidence.channels.recorder import CycleEvidence
from skidpad.evidence.channels.summary import Watched, columns, summarise_drive
from skidpad.evidence.channels.timing import MODULES
from skidpad.recording.channels.cycles import cycles
from skidpad.recording.channels.indicators import FILE as INDICATORS
from skidpad.recording.channels.indicators import IndicatorLog
from skidpad.recording.channels.mcap_files import ChannelSource, Losses, Message
from skidpad.recording.channels.monitored import (
    SUMMARY,
    TIMING,
    read_summary,
    write_summary,
    write_timing,
)
from skidpad.recording.folders import ResultKind, prepare_files, require_kind
from skidpad.recording.hazards.records import INDEX_FILE, TEXT_FILE, HazardWriter

FILES = (INDICATORS, TEXT_FILE, INDEX_FILE, TIMING, SUMMARY)
WARM_CYCLES = 20
Clock = Callable[[], int]  # ns


class Timer:
    """Takes the time per part of a cycle (C-232)."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.rows: list[dict[str, float]] = []

    def begin(self, cycle: Cycle) -> None:
        """Starts the measurements of a cycle."""
        objects = sum(len(f.objects) for f in cycle.frames if f is not None)
        self.rows.append({"cycle": cycle.k, "objects": objects, "writing": 0.0})
        self.last = self.clock()

    def lap(self, name: str) -> None:
        """Notes the ms since the last lap as those of the part `name`."""
        now = self.clock()
        self.rows[-1][name] = (now - self.last) / 1e6
        self.last = self.clock()

    def end(self) -> None:
        """Ends a cycle that is judged and written; does nothing here."""

    def table(self) -> pl.DataFrame:
        """Returns the ms per part and cycle; total: all parts but the writing (DC-65)."""
        return pl.DataFrame(self.rows).with_columns(total=pl.sum_horizontal("prepare", *MODULES))


def watch(
    source: ChannelSource,
    folder: Path,
    settings: MonitorSettings,
    timer: Timer | None = None,
    alarms: Alarms | None = None,
) -> Watched:
    """Monitors `source`; writes indicators, hazards, a summary, and times if given a timer.

    With `alarms` each cycle is judged as it comes; else times are taken of warm code. FileError for
    a recording without a cycle.
    """
    monitor = Monitor(source.channels, settings)
    log = IndicatorLog(columns(monitor))
    seen: list[float] = []
    with HazardWriter(folder) as writer:
        stream = cycles(_ContextTap(source, monitor))
        for cycle in _warmed_up(stream, monitor) if timer and alarms is None else stream:
            seen.append(cycle.t)
            if timer:
                timer.begin(cycle)
            evidence = monitor.update(cycle, timer.lap if timer else no_lap)
            log.add(cycle.k, cycle.t, evidence.readings.values)
            for record in monitor.records():
                writer.write(record)
            if alarms is not None:
                alarms.see(monitor, evidence)
            if timer:
                timer.lap("writing")
                timer.end()
        for record in monitor.finish():
            writer.write(record)
    if not seen:
        raise FileError("the recording holds no cycle that can be evaluated")
    found = summarise_drive(monitor, source.losses, seen[-1] - seen[0], len(seen))
    log.write(folder)
    write_summary(folder, found.summary)
    if timer:
        write_timing(folder, timer.table())
    return found


def watch_whole(
    source: ChannelSource,
    folder: Path,
    settings: MonitorSettings,
    timer: Timer | None = None,
    recording: str = "",
    alarms: Alarms | None = None,
) -> Watched:
    """Monitors as `watch` does, in `folder` when all is complete; else the folder stays as it was.

    recording: hash of what is watched. OutputError when the folder holds a result of another kind or
    of another recording.
    """
    require_kind(folder, ResultKind.MONITORED)
    earlier = read_summary(folder).get("recording", "") if (folder / SUMMARY).exists() else ""
    if earlier and recording and earlier != recording:
        raise OutputError(
            f"{folder} holds what was found in another recording; choose another --out"
        )
    with prepare_files(folder, FILES) as part:
        found = watch(source, part, settings, timer, alarms)
        if recording:
            write_summary(part, found.summary | {"recording": recording})
        return found


class Alarms:
    """Writes each hazard to a stream when it begins, during the drive: one line of JSON, flushed."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def see(self, monitor: Monitor, evidence: CycleEvidence) -> None:
        """Writes the hazards that began in a judged cycle."""
        k, t = evidence.cycle.k, evidence.cycle.t
        for hazard in evidence.fired:
            if monitor.hazards.open[hazard].t_start == t:
                row = {"cycle": k, "t": round(t, 3), "hazard": hazard.value}
                self.stream.write(json.dumps(row) + "\n")
                self.stream.flush()


def _warmed_up(stream: Iterator[Cycle], like: Monitor) -> Iterator[Cycle]:
    """Returns the same cycles, after the first WARM_CYCLES went through another monitor."""
    head = list(islice(stream, WARM_CYCLES))
    spare = Monitor(like.channels, like.settings)
    for cycle in head:
        spare.update(cycle)
    return chain(head, stream)


class _ContextTap:
    """Passes messages on; context of the drive goes to the monitor too, for its records only."""

    def __init__(self, source: ChannelSource, monitor: Monitor) -> None:
        self.source, self.monitor = source, monitor
        self.channels = source.channels

    @property
    def losses(self) -> Losses:
        """Returns the losses that the source has counted."""
        return self.source.losses

    def messages(self) -> Iterator[Message]:
        """Yields the messages of the source; passes the entries of each context to the monitor."""
        for message in self.source.messages():
            if isinstance(message.item, Context):
                self.monitor.note(message.item.entries)
            yield message
