"""What the matrix report works on: results in canonical order, names for people, published cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import polars as pl

from skidpad.core.text.wording import capitalize_first, count_text, list_text
from skidpad.evidence.statistics import Rate, event_rate
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.matrix import MATRIX, MatrixEntry, Metrics
from skidpad.recording.campaign.results import schema
from skidpad.report.elements.campaign import CampaignView
from skidpad.report.published import Source, published_matrix, read_published

CONFIGS = {
    "0": "0 · baseline, no ADAS",
    "1": "1 · ACC",
    "2": "2 · ACC + lane centring",
    "3": "3 · + traffic-light assist, resume",
    "4": "4 · + 80 km/h limiter",
    "reference": "reference driver (a model)",
}
FUNCTIONS = {
    "0": "no assistance",
    "1": "ACC",
    "2": "ACC and lane centring",
    "3": "ACC, lane centring, traffic-light assist and resume",
    "4": "ACC, lane centring, traffic-light assist, resume and the 80 km/h limiter",
}
REFERENCE = "reference"  # a model of a human: no functions
IN_SENTENCES = {"reference": "the reference driver"}
BASELINE = "0"  # no driver at the pedals
MOTION = "motion_hash"  # of a drive: poses, contacts and commands
EVENTS, EVENT = "crashes", "crash"  # what headlines count (decision T-4): column, and one of them
FIRST = "first_s"  # time to the first intervention
INTERVENTIONS = "fatal_collisions"  # published under this name
WEATHERS = {
    "clear-sunrise": "Clear Sky - Sunrise",
    "clear-noon": "Clear Sky - Noon",
    "clear-night": "Clear Sky - Night",
    "rain-sunrise": "Heavy Rain - Sunrise",
    "rain-noon": "Heavy Rain - Noon",
    "rain-night": "Heavy Rain - Night",
}


SENSOR_LEVELS = {
    "objects": "sensors simulated from the boxes around objects, without images",
    "pixels": "sensors on camera images",
}


@dataclass(frozen=True, slots=True)
class WeatherGroup:
    """Weathers that are looked at together."""

    weathers: tuple[str, ...]

    @property
    def title(self) -> str:
        """Returns the heading of its column, as "Clear Sky: noon and night"."""
        first, *rest = (weather_title(w) for w in self.weathers)
        if not rest:
            return first
        kind, dash, _ = first.partition(" - ")
        if dash and all(title.startswith(kind + dash) for title in rest):
            return f"{kind}: {list_text([t.rpartition(dash)[2].lower() for t in (first, *rest)])}"
        return list_text([first, *rest])

    @property
    def name(self) -> str:
        """Returns its name within a sentence: `clear sky`, `icy_30`."""
        return (
            self.title.partition(" - ")[0].partition(":")[0].lower()
            if self.is_published
            else self.title
        )

    @property
    def is_published(self) -> bool:
        """Returns True when all of them are published weathers."""
        return all(w in WEATHERS for w in self.weathers)

    @property
    def short(self) -> str:
        """Returns its label on an axis."""
        kind, dash, first = self.weathers[0].partition("-")
        if not dash or not self.is_published:
            return "\n".join(self.weathers)
        return f"{kind}\n" + ", ".join([first, *(w.partition("-")[2] for w in self.weathers[1:])])


@dataclass(frozen=True)
class Matrix(CampaignView[MatrixEntry]):
    """A campaign over configurations and weathers."""

    columns = MATRIX
    common = ("profile", "grip", "range", "version")

    @property
    def results(self) -> pl.DataFrame:
        """Returns every run; what an older version did not count is derived where it can be, else null.

        With the columns EVENTS and FIRST.
        """
        found = self.folder.results
        kinds = schema(Metrics)
        gone = [name for name in kinds if name not in found.columns]
        known = {
            "crashes_vehicle": pl.col("collisions_vehicle"),
            "road_departures": pl.col("collisions_static") + pl.col("wrong_way"),
        }
        null = {name: pl.lit(None, kinds[name]) for name in gone}
        found = found.with_columns(**(null | {k: v for k, v in known.items() if k in gone}))
        graded = pl.col("serious_contacts") + pl.col("road_departures")
        return found.with_columns(
            pl.coalesce(graded, INTERVENTIONS).alias(EVENTS),
            pl.coalesce("first_intervention_s", "first_fatal_s").alias(FIRST),
        )

    @cached_property
    def has_grades(self) -> bool:
        """Returns True when contacts were graded by how hard they were, which older results were not."""
        return self.finished["serious_contacts"].null_count() == 0

    @cached_property
    def configs(self) -> list[str]:
        """Returns all configurations, the published ones first."""
        return _known_first(self.results["config"], CONFIGS)

    @cached_property
    def weathers(self) -> list[str]:
        """Returns all weathers, the published ones first."""
        return _known_first(self.results["weather"], WEATHERS)

    @cached_property
    def comparison_configs(self) -> list[str]:
        """Returns the configurations that comparisons and figures are about (decision T-5).

        With no driver at the pedals a run measures how often the car is put back, so the baseline is
        left out wherever there is another configuration.
        """
        return [c for c in self.configs if c != BASELINE] or self.configs

    @cached_property
    def weather_groups(self) -> list[WeatherGroup]:
        """Returns the weathers, those together that no configuration drives differently."""
        groups: list[list[str]] = []
        for weather in self.weathers:
            drives_alike = (
                g
                for g in groups
                if all(weather in self.weathers_like(c, g[0]) for c in self.configs)
            )
            group = next(drives_alike, None)
            if group is None:
                groups.append([weather])
            else:
                group.append(weather)
        return [WeatherGroup(tuple(g)) for g in groups]

    @cached_property
    def climates(self) -> list[WeatherGroup]:
        """Returns published weathers by what falls, over all times of day; every other one by itself."""
        kinds = dict(self.results.select("weather", "precipitation_kind").rows())
        groups: dict[str, list[str]] = {}
        for weather in self.weathers:
            groups.setdefault(kinds[weather] if weather in WEATHERS else weather, []).append(
                weather
            )
        return [WeatherGroup(tuple(g)) for g in groups.values()]

    def weathers_like(self, config: str, weather: str) -> list[str]:
        """Returns the weathers in which a configuration drives as in this one, in every shared seed."""
        return self._equal_weathers[config][weather]

    @cached_property
    def _equal_weathers(self) -> dict[str, dict[str, list[str]]]:
        """Returns by configuration and weather the weathers with the same drives in all shared seeds."""
        drives: dict[tuple[str, str], dict[int, str]] = {}
        columns = ("config", "weather", "seed", self.drive_column)
        for config, weather, seed, drive in self.finished.select(columns).rows():
            drives.setdefault((config, weather), {})[seed] = drive

        def alike(config: str, one: str, other: str) -> bool:
            a, b = drives.get((config, one), {}), drives.get((config, other), {})
            shared = a.keys() & b.keys()
            return one == other or (
                bool(shared) and all(a[s] is not None and a[s] == b[s] for s in shared)
            )

        return {
            c: {w: [o for o in self.weathers if alike(c, w, o)] for w in self.weathers}
            for c in self.configs
        }

    @cached_property
    def drive_column(self) -> str:
        """Returns the column in which equal values are one drive (decision T-3)."""
        there = self.results
        known = MOTION in there.columns and there[MOTION].null_count() < len(there)
        return MOTION if known else "log_hash"

    @cached_property
    def same_weather(self) -> list[tuple[str, list[str]]]:
        """Returns (configuration, weathers) with the same drives for every seed (decision M-1)."""
        groups = [(c, tuple(self.weathers_like(c, w))) for c in self.configs for w in self.weathers]
        return [(c, list(ws)) for c, ws in dict.fromkeys(groups) if len(ws) > 1]

    @cached_property
    def counted(self) -> pl.DataFrame:
        """Returns the finished runs, each drive once."""
        return self._once(self.finished)

    def cell(self, config: str, weather: str | None = None) -> pl.DataFrame:
        """Returns the finished runs of a cell; without a weather those of a configuration, each drive once.

        What drives alike in several weathers may have been driven in one of them only, so a cell
        has the seeds of all weathers like its own.
        """
        if weather is None:
            return self.counted.filter(pl.col("config") == config)
        known = weather in self._equal_weathers.get(config, {})
        like = self.weathers_like(config, weather) if known else [weather]
        runs = self.finished.filter(
            (pl.col("config") == config) & pl.col("weather").is_in(like)
        ).sort(pl.col("weather") != weather, "weather", "seed", "sensors")
        return runs.unique(["seed", "sensors"], keep="first", maintain_order=True).sort("seed")

    def within(self, config: str, group: WeatherGroup) -> pl.DataFrame:
        """Returns the finished runs of a configuration in a group of weathers, each drive once."""
        there = pl.col("weather").is_in(group.weathers) & (pl.col("config") == config)
        return self._once(self.finished.filter(there))

    def _once(self, runs: pl.DataFrame) -> pl.DataFrame:
        """Returns the runs without those that moved as another of their configuration and seed did."""
        keys = ["config", "seed", "sensors", self.drive_column]
        return runs.unique(keys, keep="first", maintain_order=True)

    def rate(self, column: str, config: str, weather: str | None = None) -> Rate | None:
        """Returns the events of `column` per run of a cell; None without finished runs."""
        return rate_by_seed(self.cell(config, weather), column)

    @cached_property
    def seeds(self) -> int:
        """Returns the number of different seeds over all cells."""
        return self.results["seed"].n_unique()

    @cached_property
    def duration(self) -> float:
        """Returns the simulated time of the longest finished run in s, 0 without one."""
        return max(self.finished["duration_s"].drop_nulls().to_list(), default=0.0)

    @property
    def subtitle(self) -> str:
        """Returns a sentence or two on what was driven."""
        levels = " and ".join(
            SENSOR_LEVELS.get(level, f"sensors as {level}")
            for level in sorted(self.results["sensors"].unique().to_list())
        )
        groups = self.weather_groups
        alike = ""
        if 1 < len(groups) < len(self.weathers):
            names = "; ".join(g.title for g in groups if len(g.weathers) > 1)
            alike = f" Weathers that gave the same drives count once ({names})."
        return (
            f"{capitalize_first(config_list(self.configs))} in "
            f"{count_text(len(self.weathers), 'weather')}, {count_text(self.seeds, 'seed')} of each, "
            f"on {self.values('map')}, {levels}.{alike}"
        )


def rate_by_seed(runs: pl.DataFrame, column: str) -> Rate | None:
    """Returns the events of `column` per run, null left out; None without runs.

    Runs of one seed share their traffic, so seeds are what the interval is over.
    """
    known = runs.drop_nulls(column)
    if not len(known):
        return None
    seeds = known.group_by("seed", maintain_order=True).agg(pl.col(column).sum(), drives=pl.len())
    return event_rate(seeds[column].to_list(), seeds["drives"].cast(pl.Float64).to_list())


def mean_of(runs: pl.DataFrame, column: str) -> float | None:
    """Returns the mean of `column` over runs; None without values."""
    values = runs[column].drop_nulls()
    return float(values.mean()) if len(values) else None  # type: ignore[arg-type]


def load_matrix(folder: Path) -> Matrix:
    """Returns the campaign in a folder; FileError when it holds no results."""
    found = Matrix(CampaignFolder(folder, MatrixEntry))
    assert len(found.results)
    return found


def _known_first(values: pl.Series, known: dict[str, str]) -> list[str]:
    """Returns the different values, the known ones first in their order, then the others sorted."""
    there = values.unique().to_list()
    return [v for v in known if v in there] + sorted(v for v in there if v not in known)


def config_title(config: str) -> str:
    """Returns the name of a driver for people; an unknown one's own."""
    return CONFIGS.get(config, config)


def config_list(configs: Sequence[str]) -> str:
    """Returns text like "configuration 2" or "configurations 3 and 4"; other drivers by their names."""
    numbers = [c for c in configs if c in CONFIGS and c.isdigit()]
    names = [IN_SENTENCES.get(c, c) for c in configs if c not in numbers]
    if not numbers:
        return list_text(names)
    word = f"configuration{'s' * (len(numbers) > 1)} "
    if len(numbers) > 2 and int(numbers[-1]) - int(numbers[0]) == len(numbers) - 1:
        return list_text([f"{word}{numbers[0]} to {numbers[-1]}", *names])
    return list_text([word + list_text(numbers), *names] if names else [word + list_text(numbers)])


def functions_list(configs: Sequence[str]) -> str:
    """Returns text like "configuration 2 (ACC and lane centring)" for these configurations."""
    return list_text(
        [
            f"{config_list([c])} ({FUNCTIONS[c]})" if c in FUNCTIONS else config_list([c])
            for c in configs
        ]
    )


def weather_title(weather: str) -> str:
    """Returns the name of a weather for people; an unknown one's own."""
    return WEATHERS.get(weather, weather)


@cache
def published_cells() -> dict[tuple[str, str], dict[str, float | None]]:
    """Returns the published value of each column, by configuration and weather."""
    return {(row["config"], row["weather"]): row for row in published_matrix().to_dicts()}


def published_value(column: str, config: str, weather: str) -> float | None:
    """Returns the published value of one cell; None where there is none."""
    return published_cells().get((config, weather), {}).get(column)


PRELIMINARY = (
    (INTERVENTIONS, "prelim_total_collisions", "final_collisions"),
    ("lane_invasions", "prelim_lane_invasions", "final_lane_invasions"),
    ("radar_fpr_pct", "prelim_fpr_pct", "final_fpr_pct"),
    ("radar_fnr_pct", "prelim_fnr_pct", "final_fnr_pct"),
    ("dropout_pct", "prelim_dropout_pct", "final_dropout_pct"),
)


def published_preliminary() -> list[tuple[str, float, float]]:
    """Returns (column, preliminary, final): means over the runs that both published scripts share."""
    means = (
        read_published(Source.PRELIMINARY).select(pl.selectors.numeric().mean()).row(0, named=True)
    )
    return [(label, means[before], means[after]) for label, before, after in PRELIMINARY]
