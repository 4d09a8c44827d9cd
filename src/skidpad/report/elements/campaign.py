"""What the reports of all campaigns say alike: facts, runs that are missing, definitions, provenance."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Generic

import msgspec
import polars as pl

from skidpad import __version__
from skidpad.core.text.wording import count_text
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.ledger import E
from skidpad.recording.campaign.quantities import ENDINGS, NAMES, unit_of
from skidpad.recording.campaign.results import Columns, definitions_of
from skidpad.recording.fingerprint import reach_text
from skidpad.recording.run.log import RunLog
from skidpad.recording.run.log_files import read_log
from skidpad.report.elements.page import Block, Code, Definitions, Text, words
from skidpad.roads.bundled import kept_map
from skidpad.roads.queries import RoadMap

NAMED = 5  # runs
CLOCKS = {
    "wall_s": ("wall time", " s"),
    "cpu_s": ("processor time", " s"),
    "rtf": ("real-time factor", ""),
}


@dataclass(frozen=True)
class Metric:
    """A column of results with title and unit."""

    name: str
    unit: str
    meaning: str

    @property
    def title(self) -> str:
        """Returns the name of the metric's quantity, else its column's name in words, without the unit."""
        if self.name in NAMES:
            return NAMES[self.name]
        ending = next((end for end in ENDINGS if self.name.endswith(end)), "")
        return re.sub(r"(\d) (\d)", r"\1.\2", words(self.name.removesuffix(ending)))

    @property
    def heading(self) -> str:
        """Returns the metric's title with its unit, as "speed, km/h"."""
        if self.unit and self.title.endswith((" per 100", f" per 100 {self.unit}")):
            return f"{self.title.removesuffix(self.unit).strip()} {self.unit}"
        return f"{self.title}, {self.unit}" if self.unit else self.title


def metrics_of(rows: type[Any]) -> list[Metric]:
    """Returns the metrics that a class of rows defines; units are those of the names (A-252)."""
    return [
        Metric(name, unit_of(name), f"{meaning} ({source})")
        for name, meaning, source in definitions_of(rows)
    ]


@dataclass(frozen=True)
class CampaignView(Generic[E]):
    """A campaign as a report looks at it; each kind of campaign says what its rows are."""

    columns: ClassVar[Columns[Any, Any]]
    common: ClassVar[tuple[str, ...]]  # columns that are facts of the whole campaign

    folder: CampaignFolder[E]

    @property
    def results(self) -> pl.DataFrame:
        """Results of every run of the campaign."""
        return self.folder.results

    @cached_property
    def finished(self) -> pl.DataFrame:
        """Returns the runs that have a result: those that denominators count (decision L-7)."""
        return self.results.filter(~pl.col("outcome").is_in(NOT_RUN))

    @cached_property
    def _run_names(self) -> dict[tuple[Any, ...], str]:
        """Returns the name of each run by its values in the sort columns."""
        return self.folder.names(*self.columns.sort)

    def names(self, runs: pl.DataFrame) -> list[str | None]:
        """Returns the names of these runs; None for one that the ledger does not know."""
        return [self._run_names.get(key) for key in runs.select(self.columns.sort).rows()]

    def log(self, folder: Path) -> tuple[RunLog, RoadMap]:
        """Returns the log in a run's folder, and the map on which it was driven."""
        log = read_log(folder)
        return log, kept_map(self.folder.path, log.header.map, log.header.map_hash)

    def values(self, column: str) -> str:
        """Returns the different values of a column, sorted, as text with commas."""
        return ", ".join(sorted(map(str, self.results[column].unique().to_list())))

    def facts(self) -> list[tuple[str, str]]:
        """Returns the columns that describe the whole campaign, each with its values as text."""
        return [(column, self.values(column)) for column in self.common]

    def missing(self) -> list[Block]:
        """Returns a warning that names runs without a result; empty where all have one."""
        gone = self.results.filter(pl.col("outcome").is_in(NOT_RUN))
        if not len(gone):
            return []
        named = gone.select(*self.columns.sort, "outcome").head(NAMED).rows()
        names = "; ".join(" ".join(str(v) for v in r if not isinstance(v, bool)) for r in named)
        text = f"{len(gone)} of {count_text(len(self.results), 'run')} did not finish ({names}); "
        return [Text(text + "no denominator counts them.", tone="warning")]

    @cached_property
    def metrics(self) -> list[Metric]:
        """Returns all metrics of the rows, last those that packages added."""
        added = {m.name: m for entry in self.folder.entries for m in entry.added}
        own = metrics_of(self.columns.metrics)
        return own + [Metric(m.name, m.units, m.title) for m in added.values()]

    def definitions(self) -> Definitions:
        """Returns the definition of every metric."""
        return Definitions([(m.name, m.unit, m.meaning) for m in self.metrics])

    def provenance(self) -> list[Block]:
        """Returns versions, machines and times as text, and the configuration common to all runs."""
        lines = [
            f"Skidpad {__version__}, results hash {self.columns.hash(self.results)}.",
            reach_text(self.folder.fingerprints),
            *self._times(),
        ]
        text = msgspec.json.format(
            msgspec.json.encode(self.folder.configuration).decode(), indent=2
        )
        title = "Resolved configuration common to all runs"
        return [Text(" ".join(lines)), Code(title, text)]

    @cached_property
    def processor_minutes(self) -> float:
        """Returns the processor time of all runs in min, 0 where none was measured."""
        timing = self.folder.timing
        if "cpu_s" not in timing.columns:
            return 0.0
        return float(timing["cpu_s"].drop_nulls().drop_nans().sum()) / 60.0

    def _times(self) -> list[str]:
        """Returns a sentence with median and least of each known clock per run; empty if none is known."""
        parts = []
        for column, (name, unit) in CLOCKS.items():
            if column in self.folder.timing.columns:
                known = self.folder.timing[column].drop_nulls().drop_nans()
                known = known.filter(known > 0.0)
                if len(known):
                    least, median = known.min(), known.median()
                    parts.append(f"{name} median {median:.2f}{unit}, least {least:.2f}{unit}")
        return [f"Per run: {'; '.join(parts)}."] if parts else []
