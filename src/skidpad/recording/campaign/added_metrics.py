"""Metrics that installed packages add: they say themselves what they are, so rows are read without them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import msgspec

from skidpad.recording.files import read_json, write_bytes

METRICS_FILE = "added_metrics.json"  # in a run's folder
SIZE_MAX = 2**20  # bytes


class AddedMetric(msgspec.Struct, frozen=True):
    """The value of one metric in one run, and what the metric is."""

    name: str  # of its column, with the unit at its end
    title: str  # a few words for tables
    units: str  # its unit in words
    value: float | None = None  # None: there was nothing to measure


def write_added_metrics(folder: Path, added: Sequence[AddedMetric]) -> None:
    """Writes the metrics of a run into its folder; nothing where there are none."""
    if added:
        write_bytes(folder / METRICS_FILE, msgspec.json.encode(added))


def read_added_metrics(folder: Path) -> tuple[AddedMetric, ...]:
    """Returns the metrics that packages added to a run as it was driven; () where there are none."""
    return read_json(folder / METRICS_FILE, tuple[AddedMetric, ...], SIZE_MAX) or ()
