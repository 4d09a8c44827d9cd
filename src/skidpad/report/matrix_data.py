"""What the matrix report works on: results in canonical order, names for people, published cells."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import polars as pl

from skidpad.evidence.statistics import Rate, event_rate
from skidpad.recording.campaigns import CampaignFolder
from skidpad.recording.matrix import MATRIX, MatrixEntry, Metrics
from skidpad.recording.results import schema
from skidpad.report.campaign import CampaignView
from skidpad.report.published import Source, published, published_matrix

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
class Matrix(CampaignView[MatrixEntry]):
    """A campaign over configurations and weathers."""

    columns = MATRIX
    common = ("profile", "grip", "range", "version")

    @property
    def results(self) -> pl.DataFrame:
        """Every run; what an older version did not count is derived where it can be, else null."""
        found = self.folder.results
        kinds = schema(Metrics)
        gone = [name for name in kinds if name not in found.columns]
        known = {
            "crashes_vehicle": pl.col("collisions_vehicle"),
            "road_departures": pl.col("collisions_static") + pl.col("wrong_way"),
        }
        null = {name: pl.lit(None, kinds[name]) for name in gone}
        return found.with_columns(**(null | {k: v for k, v in known.items() if k in gone}))

    @cached_property
    def configs(self) -> list[str]:
        """Drivers, published ones first."""
        return _known_first(self.results["config"], CONFIGS)

    @cached_property
    def weathers(self) -> list[str]:
        """Weathers, published ones first."""
        return _known_first(self.results["weather"], WEATHERS)

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
        return rate_by_seed(self.cell(config, weather), column)

    def mean(self, column: str, config: str, weather: str | None = None) -> float | None:
        """Mean over the runs of a cell."""
        values = self.cell(config, weather)[column].drop_nulls()
        return float(values.mean()) if len(values) else None  # type: ignore[arg-type]

    @cached_property
    def duration(self) -> float:
        """Simulated seconds of the longest run."""
        return max(self.finished["duration_s"].drop_nulls().to_list(), default=0.0)

    @property
    def subtitle(self) -> str:
        """One sentence: what was driven."""
        levels = " and ".join(sorted(self.results["sensors"].unique().to_list()))
        return (
            f"{len(self.configs)} configurations in {len(self.weathers)} weathers, "
            f"{self.results['seed'].n_unique()} runs per cell, on {self.values('map')}, "
            f"sensors as {levels}."
        )


def rate_by_seed(runs: pl.DataFrame, column: str) -> Rate | None:
    """Events per run. Runs of one seed share their traffic, so seeds are what the interval is over."""
    known = runs.drop_nulls(column)
    if not len(known):
        return None
    seeds = known.group_by("seed", maintain_order=True).agg(pl.col(column).sum(), drives=pl.len())
    return event_rate(seeds[column].to_list(), seeds["drives"].cast(pl.Float64).to_list())


def load_matrix(folder: Path) -> Matrix:
    """The campaign in a folder; FileError when it holds no results."""
    found = Matrix(CampaignFolder(folder, MatrixEntry))
    assert len(found.results)
    return found


def _known_first(values: pl.Series, known: dict[str, str]) -> list[str]:
    there = values.unique().to_list()
    return [v for v in known if v in there] + sorted(v for v in there if v not in known)


def config_title(config: str) -> str:
    """Name of a driver for people."""
    return CONFIGS.get(config, config)


def weather_title(weather: str) -> str:
    """Name of a weather for people."""
    return WEATHERS.get(weather, weather)


@cache
def published_cells() -> dict[tuple[str, str], dict[str, float | None]]:
    """The published value of each column, by configuration and weather."""
    return {(row["config"], row["weather"]): row for row in published_matrix().to_dicts()}


def published_value(column: str, config: str, weather: str) -> float | None:
    """The published value of one cell; None where there is none."""
    return published_cells().get((config, weather), {}).get(column)


PRELIMINARY = (
    ("collisions", "prelim_total_collisions", "final_collisions"),
    ("lane invasions", "prelim_lane_invasions", "final_lane_invasions"),
    ("radar FPR, %", "prelim_fpr_pct", "final_fpr_pct"),
    ("radar FNR, %", "prelim_fnr_pct", "final_fnr_pct"),
    ("dropout, %", "prelim_dropout_pct", "final_dropout_pct"),
)


def published_preliminary() -> list[tuple[str, float, float]]:
    """(quantity, preliminary, final) as means over the runs that both published scripts share."""
    means = published(Source.PRELIMINARY).select(pl.selectors.numeric().mean()).row(0, named=True)
    return [(label, means[before], means[after]) for label, before, after in PRELIMINARY]
