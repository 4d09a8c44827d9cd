"""Metrics of runs as entries of a registry, to which installed packages add."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import isfinite

from skidpad.core.errors import ConfigError
from skidpad.core.objects.registry import Registry
from skidpad.core.text.told import describe_value
from skidpad.evidence.drive.collisions import find_crashes
from skidpad.evidence.drive.metrics import highway_roads, summarise
from skidpad.evidence.drive.prepared import Drive, MetricSettings, prepare
from skidpad.recording.campaign.added_metrics import AddedMetric
from skidpad.recording.campaign.matrix import Metrics
from skidpad.recording.campaign.results import definitions_of
from skidpad.recording.run.log import RunLog
from skidpad.roads.queries import RoadMap


@dataclass(frozen=True, slots=True)
class MetricType:
    """A number that says something about one run.

    Attributes:
        name: The name of its column; the unit stands at its end ("gap_m", "braking_pct").
        title: What it means, in a few words.
        units: The unit, for people.
        measure: `measure(drive, road_map)` returns the number, or None where there is none.
    """

    name: str
    title: str
    units: str
    measure: Callable[[Drive, RoadMap], float | None]


def _own_value(name: str, drive: Drive, road_map: RoadMap) -> float | None:
    """Returns one metric of a drive by its field name; None where it is not defined."""
    metrics = summarise(drive, find_crashes(drive), highway_roads(drive, road_map))
    value: float | None = getattr(metrics, name)
    return value


def _own_metrics() -> tuple[MetricType, ...]:
    """Returns the built-in metrics as entries of the registry."""
    return tuple(
        MetricType(name, meaning, "", partial(_own_value, name))
        for name, meaning, _ in definitions_of(Metrics)
    )


METRICS = Registry("metric", "skidpad.metrics", MetricType, _own_metrics)


def measure_added(
    log: RunLog, road_map: RoadMap, settings: MetricSettings | None = None
) -> tuple[AddedMetric, ...]:
    """Returns what the metrics of installed packages say of a run; ConfigError for one that fails.

    () without such metrics or with an empty log.
    """
    kinds = METRICS.foreign_entries()
    if not kinds or not len(log):
        return ()
    drive = prepare(log, road_map, settings)
    return tuple(
        AddedMetric(kind.name, kind.title, kind.units, _measure(kind, drive, road_map))
        for kind in kinds
    )


def _measure(kind: MetricType, drive: Drive, road_map: RoadMap) -> float | None:
    """Returns a metric's finite value or None; raises ConfigError if the code of its package fails."""
    try:
        value = kind.measure(drive, road_map)
        number = None if value is None else float(value)
    except Exception as error:  # code of a package: anything can happen
        raise ConfigError(
            f"metric {kind.name} fails: {describe_value(error)}; mend or remove its package"
        ) from error
    return number if number is not None and isfinite(number) else None
