"""What a campaign left in its folder, read back: results, timing, ledger, configuration, runs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Generic

import polars as pl

from skidpad.core.errors import FileError
from skidpad.core.files.names import inside
from skidpad.recording.campaign.ledger import (
    E,
    common_configuration,
    fingerprints,
    latest,
    read_ledger,
)
from skidpad.recording.campaign.results import TIMING, Timing, read_results, schema
from skidpad.recording.files import read_parquet, require_columns
from skidpad.recording.run.log_files import TICKS

RUNS, SNAPSHOTS = "runs", "snapshots"


@dataclass(frozen=True)
class CampaignFolder(Generic[E]):
    """A campaign's folder; `entry` is what the lines of its ledger are."""

    path: Path
    entry: type[E]

    @cached_property
    def results(self) -> pl.DataFrame:
        """Returns one row per run; FileError when there are none."""
        results = read_results(self.path)
        if not len(results):
            raise FileError(f"{self.path} holds no finished run yet")
        return results

    @cached_property
    def timing(self) -> pl.DataFrame:
        """Returns wall and processor time per run; columns of later versions may be missing."""
        times = read_parquet(self.path / TIMING)[0]
        known = {n: kind for n, kind in schema(Timing).items() if n in times.columns}
        return require_columns(times, known, self.path / TIMING)

    @cached_property
    def entries(self) -> list[E]:
        """Returns the newest entry of the ledger on each run, by name."""
        return latest(read_ledger(self.path, self.entry))

    @cached_property
    def fingerprints(self) -> list[str]:
        """Returns the fingerprints of the machines that drove the campaign, sorted."""
        return sorted(fingerprints(self.entries))

    @cached_property
    def configuration(self) -> dict[str, Any]:
        """Returns what all runs have in common."""
        return common_configuration(self.path)

    def names(self, *columns: str) -> dict[tuple[Any, ...], str]:
        """Returns the names of the runs by these columns of their keys."""
        return {tuple(getattr(e.key, c) for c in columns): e.run for e in self.entries}

    def log(self, run: str | None) -> Path | None:
        """Returns the folder of the log of the run of this name; None without a name or a log."""
        if run is None:
            return None
        folder = inside(self.path / RUNS, run)
        return folder if (folder / TICKS).is_file() else None


def last_snapshot(run: Path) -> Path | None:
    """Returns the last picture that was taken in a run; None where there is none."""

    def when(path: Path) -> tuple[int, str]:
        t = path.stem.rpartition("_")[2]
        return len(t), t

    return max((run / SNAPSHOTS).glob("*s.png"), key=when, default=None)


def snapshot(run: Path, t: float) -> Path | None:
    """Returns the picture that was taken in a run at `t` s; None where there is none."""
    return next(iter(sorted((run / SNAPSHOTS).glob(f"*_{t:07.2f}s.png"))), None)
