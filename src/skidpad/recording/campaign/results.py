"""The results of a campaign: one typed row per run, sorted, in results.parquet.

What the columns are is said by two dataclasses for each kind of campaign: which run a row is about,
and what its log says; units stand in the names (A-252). Wall times go to timing.parquet, outside
every hash (decision X-1). Null means "there was none".
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import MISSING, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, Generic, TypeVar

import polars as pl

from skidpad.core.errors import FileError
from skidpad.recording.campaign.added_metrics import AddedMetric
from skidpad.recording.files import (
    content_hash,
    read_parquet,
    require_columns,
    write_csv,
    write_parquet,
)

RESULTS, TIMING = "results.parquet", "timing.parquet"
FINGERPRINT = "fingerprint"  # of the processor and libraries that drove a row; outside the hash
TYPES: dict[str, Any] = {"int": pl.Int64, "float": pl.Float64, "str": pl.String, "bool": pl.Boolean}
K = TypeVar("K")
M = TypeVar("M")


def metric(meaning: str, source: str) -> Any:
    """Returns the field of a results column: its meaning, and which requirement or decision asks for it."""
    return field(default=None, metadata={"meaning": meaning, "source": source})


@dataclass(frozen=True, slots=True, kw_only=True)
class Timing:
    """How long a run took on the wall; outside every hash (A-246, A-261)."""

    wall_s: float  # s, on the wall
    cpu_s: float = 0.0  # s, of the processor; 0: unknown, the run ended its process
    rtf: float | None = None  # simulated per wall time
    rtf_below_0_9_pct: float | None = None  # ticks slower than that, those of a block by its mean
    quick_pct: float | None = None  # ticks that were driven in compiled blocks
    why_not_quick: str | None = None  # the first reason where none were
    story_table_pct: float | None = None  # ticks of a story that a kernel played as a table
    why_no_story_table: str | None = None  # the first thing in it that no table can hold


@dataclass(frozen=True, slots=True)
class Columns(Generic[K, M]):
    """The columns of one kind of campaign."""

    key: type[K]  # which run, and how it ended
    metrics: type[M]
    sort: tuple[str, ...]  # columns of the key that tell runs apart

    def table(self, rows: Iterable[tuple[K, M | None]]) -> pl.DataFrame:
        """Returns one row per run in canonical order; no metrics: nulls."""
        flat = [_plain(self.key, key) | _plain(self.metrics, metrics) for key, metrics in rows]
        return pl.DataFrame(flat, schema=schema(self.key, self.metrics)).sort(self.sort)

    def write(
        self,
        folder: Path,
        rows: Sequence[tuple[K, M | None]],
        timing: Sequence[Timing] = (),
        csv: bool = False,
        fingerprints: Sequence[str] = (),
        added: Sequence[Sequence[AddedMetric]] = (),
    ) -> str:
        """Writes results.parquet, and timing.parquet with a line for each row; returns the hash.

        fingerprints: of each row, where it was driven. added: of each row, what packages measured.
        csv: also as CSV files.
        """
        beside = [pl.Series(FINGERPRINT, fingerprints, dtype=pl.String)] * bool(fingerprints)
        for name in dict.fromkeys(metric.name for row in added for metric in row):
            values = [next((m.value for m in row if m.name == name), None) for row in added]
            beside.append(pl.Series(name, values, dtype=pl.Float64))
        keys = pl.DataFrame([_plain(self.key, key) for key, _ in rows], schema=schema(self.key))
        sorted_beside = keys.with_columns(beside).sort(self.sort)
        table = self.table(rows).with_columns(sorted_beside[series.name] for series in beside)
        names = {name: kind for name, kind in schema(self.key).items() if name in self.sort}
        walls = [
            {name: getattr(key, name) for name in names} | asdict(wall)
            for (key, _), wall in zip(rows, timing, strict=False)
        ]
        walls_table = pl.DataFrame(walls, schema=names | schema(Timing)).sort(self.sort)
        for name, content in ((RESULTS, table), (TIMING, walls_table)):
            write_parquet(folder / name, content)
            if csv:
                write_csv((folder / name).with_suffix(".csv"), content)
        return self.hash(table)

    def check_table(self, table: pl.DataFrame, path: Path) -> pl.DataFrame:
        """Returns the table with every column; FileError when it is one of another kind.

        Metrics of versions that did not have them yet are null, factors their default.
        """
        known = {f.name: f.default for f in fields(self.key) if f.default is not MISSING}  # type: ignore[arg-type]
        kinds = {n: k for n, k in schema(self.key).items() if n in known} | schema(self.metrics)
        table = table.with_columns(
            pl.lit(known.get(name), kind).alias(name)
            for name, kind in kinds.items()
            if name not in table.columns
        )
        return require_columns(table, schema(self.key, self.metrics), path)

    def hash(self, table: pl.DataFrame) -> str:
        """Returns the content hash (X-1) of results, whatever the order of rows and where they were run."""
        return content_hash([table.drop(FINGERPRINT, strict=False).sort(self.sort)])


def _plain(kind: type[Any], row: Any) -> dict[str, Any]:
    """Returns a row's values by the fields of `kind`; empty for None."""
    return {} if row is None else {f.name: getattr(row, f.name) for f in fields(kind)}


def schema(*rows: type[Any]) -> dict[str, Any]:
    """Returns the Polars types of the fields of these row classes, in order."""
    return {
        f.name: TYPES.get(str(f.type).split(" |")[0], pl.String)  # the others are enums of words
        for row in rows
        for f in fields(row)
    }


def read_results(folder: Path, columns: Columns[Any, Any] | None = None) -> pl.DataFrame:
    """Returns results.parquet of a campaign; FileError when there is none, or it has other columns."""
    if (folder / "ledger.jsonl").is_file() and not (folder / RESULTS).is_file():
        raise FileError(f"{folder} holds a campaign that is not finished: finish it with --resume")
    table = read_parquet(folder / RESULTS)[0]
    return table if columns is None else columns.check_table(table, folder / RESULTS)


def definitions_of(rows: type[Any]) -> list[tuple[str, str, str]]:
    """Returns (column, meaning, source) of every metric of a class of rows."""
    return [(f.name, f.metadata["meaning"], f.metadata["source"]) for f in fields(rows)]
