"""One recording through the monitor, and what it leaves in a folder."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from itertools import chain, islice
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from skidpad.core.channels import Context, Cycle
from skidpad.core.errors import ConfigError, FileError
from skidpad.core.vocabulary import HazardType
from skidpad.evidence.channels.hazards import Profile, load_rules
from skidpad.evidence.channels.identifier.model import Identify, Model
from skidpad.evidence.channels.indicators.catalogue import (
    Bound,
    Indicator,
    Threshold,
)
from skidpad.evidence.channels.indicators.layout import Place
from skidpad.evidence.channels.indicators.panel import no_lap
from skidpad.evidence.channels.indicators.settings import IndicatorSettings
from skidpad.evidence.channels.monitor import Monitor, drive_events
from skidpad.evidence.channels.timefilter import Event
from skidpad.recording.channels import ChannelSource, Losses, Message
from skidpad.recording.cycles import cycles
from skidpad.recording.files import write_bytes, write_parquet
from skidpad.recording.hazards import HazardWriter
from skidpad.recording.indicators import Column, IndicatorLog

SUMMARY = "monitor.json"
TIMING = "timing.parquet"
WARM_CYCLES = 20
BUDGET_MS = 25.0  # C-006, C-233
MODULES = ("comfort", "similarity", "motion_prediction", "risk", "hazards")
Clock = Callable[[], int]  # ns


@dataclass(slots=True)
class Watched:
    """What a monitored recording showed."""

    channels: tuple[str, ...]
    cycles: int
    hours: float
    hazards: dict[HazardType, int]  # events
    violations: dict[Place, int]  # events
    timing: pl.DataFrame | None = None
    summary: dict[str, Any] = field(default_factory=dict)


def watch(
    source: ChannelSource,
    folder: Path,
    *,
    settings: IndicatorSettings,
    profile: Profile,
    thresholds: dict[Indicator, Threshold],
    rules_file: Path | None = None,
    clock: Clock | None = None,
    identify: Identify = Identify.RULES,
    model: Model | None = None,
) -> Watched:
    """Monitor `source`; writes indicators, hazards, a summary, and timings if given a `clock`."""
    if identify is not Identify.RULES and model is None:
        raise ConfigError(f"--identifier {identify.value} needs a trained model")
    monitor = Monitor(
        source.channels,
        settings=settings,
        profile=profile,
        rules=load_rules(profile, rules_file),
        thresholds=thresholds,
        identify=identify,
        detectors=model.identifier() if model else None,
    )
    log = IndicatorLog(_columns(monitor))
    timer = _Timer(clock) if clock else None
    first: Cycle | None = None
    last: Cycle | None = None
    with HazardWriter(folder) as writer:
        stream = cycles(_ContextTap(source, monitor))
        if timer:
            stream = _warmed_up(stream, monitor)
        for cycle in stream:
            first, last = first or cycle, cycle
            if timer:
                timer.begin(cycle)
            evidence = monitor.update(cycle, timer.lap if timer else no_lap)
            log.add(cycle.k, cycle.t, evidence.readings.values)
            for record in monitor.records():
                writer.write(record)
            if timer:
                timer.lap("writing")
        for record in monitor.finish():
            writer.write(record)
    if first is None or last is None:
        raise FileError("the recording holds no cycle that can be evaluated")
    log.write(folder)
    return _finished(monitor, source, folder, last.t - first.t, len(log._k), timer)


def _warmed_up(stream: Iterator[Cycle], like: Monitor) -> Iterator[Cycle]:
    """The same cycles, after the first ones went through another monitor: times are of warm code."""
    head = list(islice(stream, WARM_CYCLES))
    spare = Monitor(
        like.channels,
        settings=like.settings,
        profile=like.profile,
        identify=like.identify,
        detectors=like.learned.detectors if like.learned else None,
    )
    for cycle in head:
        spare.update(cycle)
    return chain(head, stream)


class _ContextTap:
    """Passes messages on; words about the drive go to the monitor, for its records only."""

    def __init__(self, source: ChannelSource, monitor: Monitor) -> None:
        self.source, self.monitor = source, monitor
        self.channels = source.channels

    @property
    def losses(self) -> Losses:
        return self.source.losses

    def messages(self) -> Iterator[Message]:
        for message in self.source.messages():
            if isinstance(message.item, Context):
                self.monitor.note(message.item.entries)
            yield message


def _columns(monitor: Monitor) -> list[Column]:
    return [
        Column(
            indicator.value,
            subject,
            monitor.thresholds[indicator].threshold,
            monitor.thresholds[indicator].bound is Bound.UPPER,
            monitor.thresholds[indicator].claim,
        )
        for indicator, subject in monitor.layout.places
    ]


def _finished(
    monitor: Monitor,
    source: ChannelSource,
    folder: Path,
    seconds: float,
    n: int,
    timer: _Timer | None,
) -> Watched:
    hazards, violations = drive_events(monitor)
    found = Watched(
        channels=monitor.channels,
        cycles=n,
        hours=seconds / 3600.0,
        hazards=_counted([e.key for e in hazards]),
        violations=_counted([e.key for e in violations]),
    )
    found.summary = {
        "channels": list(monitor.channels),
        "cycles": n,
        "seconds": round(seconds, 3),
        "rules": monitor.profile.value,
        "forms": monitor.settings.form.value,
        "identifier": monitor.identify.value,
        "losses": asdict(source.losses),
        "unusable": monitor.unusable.as_dict(),
        "hazards": [_event(e, e.key.value) for e in hazards],
        "brief_objects": dict(monitor.ghosts.brief),  # a cue for ghosts (C-130)
        "context": monitor.context,
        "undecided_cycles": {h.value: c for h, c in monitor.undecided.items()},
        "indicators": _audit(monitor, found),
        "violations": [_event(e, e.key[0].value, e.key[1]) for e in violations],
    }
    write_bytes(folder / SUMMARY, json.dumps(found.summary, indent=1, allow_nan=False).encode())
    if timer:
        found.timing = timer.table()
        write_parquet(folder / TIMING, found.timing)
    return found


def _audit(monitor: Monitor, found: Watched) -> list[dict[str, Any]]:
    """Per indicator and subject: claim, threshold, violations and cycles without a value (C-17)."""
    missing, beyond = monitor.not_evaluated, monitor.violation_cycles
    return [
        {
            "indicator": place.indicator.value,
            "subject": place.subject,
            "claim": monitor.thresholds[place.indicator].claim,
            "threshold": monitor.thresholds[place.indicator].threshold,
            "violation_events": found.violations.get(place, 0),
            "violation_cycles": beyond[place],
            "not_evaluated_cycles": missing[place],
        }
        for place in monitor.layout.places
    ]


def _event(event: Event[Any], name: str, subject: str | None = None) -> dict[str, Any]:
    extreme = None if event.extreme != event.extreme else event.extreme
    row = {
        "name": name,
        "t_start": round(event.t_start, 3),
        "t_end": round(event.t_end, 3),
        "count": event.count,
        "extreme": extreme,
    }
    return row | ({"subject": subject} if subject else {})


def _counted(keys: list[Any]) -> dict[Any, int]:
    return {key: keys.count(key) for key in dict.fromkeys(keys)}


class _Timer:
    """Time per part of a cycle, by a clock that the caller brings (C-232)."""

    def __init__(self, clock: Clock) -> None:
        self.clock = clock
        self.rows: list[dict[str, float]] = []

    def begin(self, cycle: Cycle) -> None:
        objects = sum(len(f.objects) for f in cycle.frames if f is not None)
        self.rows.append({"cycle": cycle.k, "objects": objects, "writing": 0.0})
        self.last = self.clock()

    def lap(self, name: str) -> None:
        now = self.clock()
        self.rows[-1][f"{name}"] = (now - self.last) / 1e6
        self.last = self.clock()

    def table(self) -> pl.DataFrame:
        """Milliseconds per module and cycle; total = all parts but the writing (DC-65)."""
        table = pl.DataFrame(self.rows)
        return table.with_columns(total=pl.sum_horizontal("prepare", *MODULES))


def timing_statistics(timing: pl.DataFrame) -> pl.DataFrame:
    """The table of C-233: per module mean, extremes, deviation and shares against its threshold.

    Threshold of the total: 25 ms; of a module: its own maximum. "Within 90 %" is 0.9 T <= t <= T
    (C-234, DC-64).
    """
    rows = []
    for module in ("total", "prepare", *MODULES, "writing"):
        t = timing[module].to_numpy()
        limit = BUDGET_MS if module == "total" else float(t.max())
        rows.append(
            {
                "module": module,
                "mean_ms": float(t.mean()),
                "max_ms": float(t.max()),
                "min_ms": float(t.min()),
                "std_ms": float(t.std()),
                "p999_ms": float(np.percentile(t, 99.9)),
                "breaches_pct": float(100.0 * (t > limit).mean()),
                "within_90_pct": float(100.0 * ((t >= 0.9 * limit) & (t <= limit)).mean()),
                "under_50_pct": float(100.0 * (t < 0.5 * limit).mean()),
            }
        )
    return pl.DataFrame(rows)


def time_by_objects(timing: pl.DataFrame) -> pl.DataFrame:
    """Mean time per module against the number of objects of all channels (C-238)."""
    return (
        timing.group_by("objects")
        .agg(pl.len().alias("cycles"), pl.col("total", *MODULES).mean())
        .sort("objects")
    )
