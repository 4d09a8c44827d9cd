"""What a monitored drive left in its folder, ready to be drawn."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import polars as pl
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.files.reading import convert_plain
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.indicators.catalogue import (
    AnyIndicator,
    Threshold,
    load_thresholds,
)
from skidpad.evidence.channels.timing import TIMES
from skidpad.recording.channels.indicators import read_indicators
from skidpad.recording.channels.monitored import SUMMARY, read_summary, read_timing
from skidpad.recording.hazards.records import HazardRecord, read_hazards
from skidpad.recording.hazards.searched import Searches, read_searches


@dataclass(frozen=True, slots=True)
class Trace:
    """One indicator of one channel or pair over the drive."""

    indicator: AnyIndicator
    subject: str
    t: Floats  # (k,) s
    value: Floats  # (k,), NaN: not evaluated
    violated: NDArray[np.bool_]  # (k,)


@dataclass(frozen=True, slots=True)
class MonitoredDrive:
    """One recording and what the monitor said of it."""

    name: str
    summary: dict[str, Any]  # monitor.json
    table: pl.DataFrame  # indicators.parquet
    records: tuple[HazardRecord, ...]
    timing: pl.DataFrame | None
    thresholds: dict[AnyIndicator, Threshold]
    searches: Searches = field(default_factory=dict)

    @property
    def channels(self) -> Sequence[str]:
        """Returns the channels in the order of the recording."""
        names: list[str] = self.summary["channels"]
        return names

    @property
    def context(self) -> dict[str, str]:
        """Returns the words that describe the drive, empty where the summary has none."""
        words: dict[str, str] = self.summary.get("context", {})
        return words

    def traces(self, indicator: AnyIndicator) -> list[Trace]:
        """Returns the indicator's course per channel or pair; empty where it was not computed."""
        rows = self.table.filter(pl.col("indicator") == indicator.value)
        return [
            Trace(
                indicator,
                str(subject),
                group["t"].to_numpy(),
                group["value"].fill_null(float("nan")).to_numpy(),
                group["violated"].to_numpy(),
            )
            for (subject,), group in rows.group_by("subject", maintain_order=True)
        ]


class _Named(msgspec.Struct):
    name: str


class _Event(msgspec.Struct):
    name: HazardType
    t_start: float
    t_end: float


class _Audit(msgspec.Struct):
    indicator: str
    subject: str
    claim: str | None
    threshold: float | None
    violation_events: int
    violation_cycles: int
    not_evaluated_cycles: int


class _Summary(msgspec.Struct):
    """What pages take from a drive's summary."""

    channels: list[str]
    cycles: int
    seconds: float
    rules: str
    forms: str
    losses: dict[str, bool | int | dict[str, int]]
    unusable: dict[str, dict[str, int]]
    brief_objects: dict[str, int]
    undecided_cycles: dict[str, int]
    hazards: list[_Event]
    violations: list[_Named]
    indicators: list[_Audit]
    identifier: str = "rules"
    context: dict[str, str] = {}


def load_drive(folder: Path) -> MonitoredDrive:
    """Reads the output folder of `skidpad monitor`; InputError when it is none that can be shown."""
    summary = read_summary(folder)
    convert_plain(summary, _Summary, str(folder / SUMMARY))
    return MonitoredDrive(
        name=folder.name,
        summary=summary,
        table=read_indicators(folder),
        records=tuple(read_hazards(folder)),
        timing=read_timing(folder, TIMES),
        thresholds=load_thresholds(),
        searches=read_searches(folder),
    )
