"""What the reports of all campaigns say alike: facts, runs that are missing, definitions, provenance."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Generic

import msgspec
import numpy as np
import polars as pl

from skidpad import __version__
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.recording.campaigns import CampaignFolder
from skidpad.recording.ledger import E
from skidpad.recording.results import definitions_of
from skidpad.report.page import Block, Code, Definitions, Text

NAMED = 5  # runs
CLOCKS = {
    "wall_s": ("wall time", "s"),
    "cpu_s": ("processor time", "s"),
    "rtf": ("real-time factor", ""),
}
UNITS = {
    "_m": "m",
    "_m2": "m²",
    "_s": "s",
    "_kmh": "km/h",
    "_km": "km",
    "_pct": "%",
    "_deg": "deg",
    "_deg_s": "deg/s",
}


@dataclass(frozen=True)
class Metric:
    """A column of results."""

    name: str
    unit: str
    meaning: str


def metrics_of(rows: type[Any]) -> list[Metric]:
    """The metrics of a class of rows; units stand in the names (A-252)."""
    return [
        Metric(name, unit_of(name), f"{meaning} ({source})")
        for name, meaning, source in definitions_of(rows)
    ]


def unit_of(name: str) -> str:
    """Unit by the longest suffix that is one."""
    ends = [end for end in UNITS if name.endswith(end)]
    return UNITS[max(ends, key=len)] if ends else ""


@dataclass(frozen=True)
class CampaignView(Generic[E]):
    """A campaign as a report looks at it; each kind of campaign says what its rows are."""

    metrics: ClassVar[type[Any]]
    run_key: ClassVar[tuple[str, ...]]  # columns that tell runs apart
    common: ClassVar[tuple[str, ...]]  # columns that are facts of the whole campaign

    folder: CampaignFolder[E]

    @property
    def results(self) -> pl.DataFrame:
        """Every run."""
        return self.folder.results

    @cached_property
    def finished(self) -> pl.DataFrame:
        """Runs that count in denominators (decision L-7)."""
        return self.results.filter(~pl.col("outcome").is_in(NOT_RUN))

    @cached_property
    def run_names(self) -> dict[tuple[Any, ...], str]:
        """Names of the runs by what tells them apart."""
        return self.folder.names(*self.run_key)

    def values(self, column: str) -> str:
        """All values of a column, for people."""
        return ", ".join(sorted(map(str, self.results[column].unique().to_list())))

    def facts(self) -> list[tuple[str, str]]:
        """What all runs have in common."""
        return [(column, self.values(column)) for column in self.common]

    def missing(self) -> list[Block]:
        """A warning that names runs without a result."""
        gone = self.results.filter(pl.col("outcome").is_in(NOT_RUN))
        if not len(gone):
            return []
        named = gone.select(*self.run_key, "outcome").head(NAMED).rows()
        names = "; ".join(" ".join(map(str, row)) for row in named)
        text = f"{len(gone)} of {len(self.results)} runs did not finish ({names}); "
        return [Text(text + "they are in no denominator.", tone="warning")]

    def definitions(self) -> Definitions:
        """Every metric."""
        return Definitions([(m.name, m.unit, m.meaning) for m in metrics_of(self.metrics)])

    def provenance(self, results_hash: str) -> list[Block]:
        """Versions, machines, times, and what all runs have in common."""
        lines = [
            f"Skidpad {__version__}, results hash {results_hash}.",
            f"Machine fingerprints: {', '.join(self.folder.fingerprints) or 'none'}.",
            *self._times(),
        ]
        text = msgspec.json.format(
            msgspec.json.encode(self.folder.configuration).decode(), indent=2
        )
        title = "Resolved configuration common to all runs"
        return [Text(" ".join(lines)), Code(title, text)]

    def _times(self) -> list[str]:
        timing = self.folder.timing.filter(pl.col("wall_s") > 0.0)
        if not len(timing):
            return []
        parts = [
            f"{name} median {np.median(timing[c]):.2f} {unit}".rstrip()
            for c, (name, unit) in CLOCKS.items()
            if c in timing.columns
        ]
        if "rtf" in timing.columns:
            parts.append(f"least {min(timing['rtf']):.1f}")
        return [f"Per run: {', '.join(parts)}."]
