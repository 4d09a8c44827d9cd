"""What the matrix report works on: results in canonical order, names for people, published cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import polars as pl

from skidpad.core.errors import FileError
from skidpad.core.vocabulary import Outcome
from skidpad.evidence.statistics import Rate, event_rate
from skidpad.recording.results import read_results
from skidpad.report.published import Source, published, published_matrix

PublishedCell = dict[str, float | None]

FAILED = [Outcome.AGENT_ERROR.value, Outcome.CRASHED.value, Outcome.TIMEOUT.value]
CONFIGS = {
    "0": "0 · baseline, no ADAS",
    "1": "1 · ACC",
    "2": "2 · ACC + lane centring",
    "3": "3 · + light assist, resume",
    "4": "4 · + 80 km/h limiter",
}
WEATHERS = {
    "clear-sunrise": "Clear Sky - Sunrise",
    "clear-noon": "Clear Sky - Noon",
    "clear-night": "Clear Sky - Night",
    "rain-sunrise": "Heavy Rain - Sunrise",
    "rain-noon": "Heavy Rain - Noon",
    "rain-night": "Heavy Rain - Night",
}


@dataclass(frozen=True)
class Matrix:
    """A campaign's results."""

    results: pl.DataFrame

    @cached_property
    def finished(self) -> pl.DataFrame:
        """Runs that count in denominators (decision L-7)."""
        return self.results.filter(~pl.col("outcome").is_in(FAILED))

    @cached_property
    def configs(self) -> list[str]:
        """Drivers, published ones first."""
        there = self.results["config"].unique().to_list()
        return [c for c in CONFIGS if c in there] + sorted(c for c in there if c not in CONFIGS)

    @cached_property
    def weathers(self) -> list[str]:
        """Weathers, published ones first."""
        there = self.results["weather"].unique().to_list()
        return [w for w in WEATHERS if w in there] + sorted(w for w in there if w not in WEATHERS)

    @cached_property
    def same_weather(self) -> list[tuple[str, list[str]]]:
        """(configuration, weathers) whose drives are the same for every seed (decision M-1)."""
        groups: list[tuple[str, list[str]]] = []
        for config in self.configs:
            by_drives: dict[tuple[str, ...], list[str]] = {}
            for weather in self.weathers:
                hashes = self.cell(config, weather).sort("seed")["log_hash"].to_list()
                if hashes and None not in hashes:
                    by_drives.setdefault(tuple(hashes), []).append(weather)
            groups += [(config, ws) for ws in by_drives.values() if len(ws) > 1]
        return groups

    @cached_property
    def counted(self) -> pl.DataFrame:
        """Finished runs, each drive once."""
        return self.finished.unique(
            ["config", "seed", "log_hash"], keep="first", maintain_order=True
        )

    def cell(self, config: str, weather: str | None = None) -> pl.DataFrame:
        """Finished runs of one cell, or of a configuration with each drive once."""
        if weather is None:
            return self.counted.filter(pl.col("config") == config)
        return self.finished.filter((pl.col("config") == config) & (pl.col("weather") == weather))

    def rate(self, column: str, config: str, weather: str | None = None) -> Rate | None:
        """Events per run of a cell; None without finished runs."""
        counts = self.cell(config, weather)[column].drop_nulls()
        return event_rate(counts.to_list()) if len(counts) else None

    def mean(self, column: str, config: str, weather: str | None = None) -> float | None:
        """Mean over the runs of a cell."""
        values = self.cell(config, weather)[column].drop_nulls()
        return float(values.mean()) if len(values) else None  # type: ignore[arg-type]

    @cached_property
    def duration(self) -> float:
        """Simulated seconds of the longest run."""
        seconds = self.finished["duration_s"].drop_nulls().to_list()
        return max(seconds, default=0.0)

    @property
    def subtitle(self) -> str:
        """One sentence: what was driven."""
        r = self.results
        levels = " and ".join(sorted(r["sensors"].unique().to_list()))
        return (
            f"{len(self.configs)} configurations in {len(self.weathers)} weathers, "
            f"{r['seed'].n_unique()} runs per cell, on {', '.join(sorted(r['map'].unique().to_list()))}, "
            f"sensors as {levels}."
        )

    def facts(self) -> list[tuple[str, str]]:
        """What all runs have in common."""
        r = self.results
        return [
            (name, ", ".join(sorted(map(str, r[column].unique().to_list()))))
            for name, column in (
                ("profile", "profile"),
                ("grip", "grip"),
                ("range", "range"),
                ("version", "version"),
            )
        ]


def load_matrix(folder: Path) -> Matrix:
    """The results in a campaign's folder; FileError when there are none."""
    results = read_results(folder)
    if not len(results):
        raise FileError(f"{folder} holds no finished run yet")
    return Matrix(results)


def config_title(config: str) -> str:
    """Name of a driver for people."""
    return CONFIGS.get(config, config)


def weather_title(weather: str) -> str:
    """Name of a weather for people."""
    return WEATHERS.get(weather, weather)


def groups_of(names: Sequence[str]) -> list[str]:
    """Short labels for axes."""
    return [n.replace("-", "\n", 1) for n in names]


@cache
def published_cells() -> dict[tuple[str, str], PublishedCell]:
    """The published value of each column, by configuration and weather."""
    return {(row["config"], row["weather"]): row for row in published_matrix().to_dicts()}


PRELIMINARY = (
    ("collisions", "prelim_total_collisions", "final_collisions"),
    ("lane invasions", "prelim_lane_invasions", "final_lane_invasions"),
    ("radar FPR, %", "prelim_fpr_pct", "final_fpr_pct"),
    ("radar FNR, %", "prelim_fnr_pct", "final_fnr_pct"),
    ("dropout, %", "prelim_dropout_pct", "final_dropout_pct"),
)


def published_preliminary() -> list[tuple[str, float, float]]:
    """(quantity, preliminary, final) as means over the runs that both published scripts share."""
    table = published(Source.PRELIMINARY)
    return [
        (label, _mean(table, before), _mean(table, after)) for label, before, after in PRELIMINARY
    ]


def _mean(table: pl.DataFrame, column: str) -> float:
    return float(table[column].mean())  # type: ignore[arg-type]
