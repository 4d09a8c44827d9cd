"""What the friction report works on: cells with both frictions, their series, published values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import polars as pl

from skidpad.core.errors import FileError
from skidpad.evidence.contrasts import NOT_RUN
from skidpad.evidence.grip.findings import CUT_IN
from skidpad.evidence.grip.study import (
    ORIGINAL,
    REDUCED,
    CellSeries,
    Distance,
    Pair,
    cell_series,
    delays,
    distances,
    pairs,
)
from skidpad.recording.grip import read_series, series_path
from skidpad.recording.results import read_results
from skidpad.report.published import Source, published

SCENARIOS = {
    "ghost_cut_in": "Ghost cut-in",
    "lead_slowdown": "Lead slowdown",
    "front_accident": "Front accident",
}
BASELINE = "rain_0"
FIXED = "fixed"  # variant of the cut-in in the campaign proper (G-9)
WEATHERS = (
    *(f"rain_{k}" for k in (0, 20, 40, 60, 80, 100)),
    *(f"icy_{k}" for k in (0, 10, 30, 70, 100)),
)
Key = tuple[str, str]  # scenario, weather


@dataclass(frozen=True)
class GripCampaign:
    """A campaign's results and where its series lie."""

    folder: Path
    results: pl.DataFrame
    behind_drops: pl.DataFrame | None = None  # the same runs with drops on the cameras (B-161)

    @cached_property
    def all_runs(self) -> pl.DataFrame:
        """With and without drops."""
        if self.behind_drops is None:
            return self.results
        return pl.concat([self.results, self.behind_drops])

    @cached_property
    def finished(self) -> pl.DataFrame:
        """Runs that count in denominators (decision L-7)."""
        return self.results.filter(~pl.col("outcome").is_in(NOT_RUN))

    @cached_property
    def pairs(self) -> dict[Key, Pair]:
        """Cells of the campaign proper, in the published order."""
        found = {(p.scenario, p.weather): p for p in pairs(self.results) if p.cutin == FIXED}
        return {k: found[k] for k in sorted(found, key=self._order)}

    @cached_property
    def variants(self) -> dict[str, Pair]:
        """Variants of the cut-in at the baseline; none when only one was driven (B-075)."""
        cut_ins = [p for p in pairs(self.results) if p.scenario == CUT_IN]
        found = {p.cutin: p for p in cut_ins if p.weather == BASELINE}
        return found if len(found) > 1 else {}

    def _order(self, key: Key) -> tuple[int, int, str]:
        scenario, weather = key
        known = WEATHERS.index(weather) if weather in WEATHERS else len(WEATHERS)
        return list(SCENARIOS).index(scenario), known, weather

    @cached_property
    def scenarios(self) -> list[str]:
        """Those that were driven."""
        return list(dict.fromkeys(s for s, _ in self.pairs))

    def weathers(self, scenario: str) -> list[str]:
        """Those in which a scenario was driven."""
        return [w for s, w in self.pairs if s == scenario]

    @cached_property
    def both(self) -> bool:
        """Both frictions were driven."""
        return any(len(p.original) and len(p.reduced) for p in self.pairs.values())

    @cached_property
    def _series(self) -> dict[tuple[str, str, str, str], CellSeries]:
        return {}

    def series(self, pair: Pair, friction: str) -> CellSeries | None:
        """Recorded series of a cell; None without runs."""
        key = (pair.scenario, pair.cutin, pair.weather, friction)
        if key not in self._series:
            runs = pair.side(friction)
            if not len(runs):
                return None
            variant = "" if pair.cutin == FIXED else f"-{pair.cutin}"
            variant += "-drops" if runs["overlay"][0] else ""
            name = f"{pair.scenario}{variant}_{pair.weather}_{friction}"
            self._series[key] = cell_series(
                runs, lambda seed: read_series(series_path(self.folder, name, seed))
            )
        return self._series[key]

    @cached_property
    def distances(self) -> dict[Key, list[Distance]]:
        """Reduced against original, of every metric and cell."""
        found = {}
        for key, pair in self.pairs.items():
            a, b = self.series(pair, ORIGINAL), self.series(pair, REDUCED)
            if a is not None and b is not None:
                found[key] = list(distances(a, b, pair.identical))
        return found

    @cached_property
    def variant_distances(self) -> dict[str, list[Distance]]:
        """Each variant of the cut-in against `original`, friction untouched (B-077)."""
        base = self.variants.get("original")
        start = self.series(base, ORIGINAL) if base is not None else None
        found = {}
        for name, pair in self.variants.items():
            mine = self.series(pair, ORIGINAL)
            if start is not None and mine is not None:
                found[name] = list(distances(start, mine, identical=name == "original"))
        return found

    @cached_property
    def delays(self) -> dict[Key, np.ndarray[tuple[int], np.dtype[np.float64]]]:
        """Delay of each pair in s; NaN where no shift explains the difference."""
        found = {}
        for key, pair in self.pairs.items():
            a, b = self.series(pair, ORIGINAL), self.series(pair, REDUCED)
            if a is not None and b is not None:
                found[key] = delays(a, b)
        return found

    def with_delays(self) -> pl.DataFrame:
        """Results with `delay_s` in the rows of reduced friction."""
        parts = []
        for key, values in self.delays.items():
            runs = self.pairs[key].reduced["seed"].to_list()[: len(values)]
            parts.append(
                pl.DataFrame(
                    {"seed": runs, "delay_s": values},
                    schema={"seed": pl.Int64, "delay_s": pl.Float64},
                ).with_columns(
                    scenario=pl.lit(key[0]),
                    weather=pl.lit(key[1]),
                    friction=pl.lit(REDUCED),
                    cutin=pl.lit(FIXED),
                    delay_s=pl.col("delay_s").fill_nan(None),
                )
            )
        if not parts:
            return self.results
        on = ["scenario", "weather", "friction", "cutin", "seed"]
        return self.results.join(pl.concat(parts), on=on, how="left")


def load_grip(folder: Path) -> GripCampaign:
    """The results in a campaign's folder; FileError when there are none."""
    results = read_results(folder)
    if "friction" not in results.columns:
        raise FileError(f"{folder} holds no friction campaign")
    if not len(results):
        raise FileError(f"{folder} holds no finished run yet")
    if results["overlay"].n_unique() == 1:
        return GripCampaign(folder, results)
    drops = results["overlay"]
    return GripCampaign(folder, results.filter(~drops), results.filter(drops))


def scenario_title(name: str) -> str:
    """Name for people."""
    return SCENARIOS.get(name, name)


@cache
def published_completion() -> dict[tuple[str, str, str], tuple[float, float, bool]]:
    """Completion in percent, score and whether we doubt it, by scenario, weather, friction."""
    rows = published(Source.COMPLETION).to_dicts()
    return {
        (r["scenario"], r["preset"], r["friction_mode"]): (
            r["completion_rate_pct"],
            r["mean_score_pct"],
            r["consistency_flag_derived"] != "ok",
        )
        for r in rows
    }


@cache
def published_distances() -> dict[tuple[str, str, str], float]:
    """By scenario, weather and metric."""
    rows = published(Source.WARPING).to_dicts()
    return {(r["scenario"], r["preset"], r["metric"]): r["dtw_distance"] for r in rows}


@cache
def published_variants() -> dict[str, tuple[float, float]]:
    """Completion in percent and score of the cut-in's variants."""
    rows = published(Source.CUTIN_COMPLETION).to_dicts()
    return {r["variant"]: (r["completion_rate_pct"], r["mean_score_pct"]) for r in rows}


@cache
def published_variant_distances() -> dict[tuple[str, str], float]:
    """By variant and metric."""
    rows = published(Source.CUTIN_WARPING).to_dicts()
    return {(r["variant_compared_with_original"], r["metric"]): r["dtw_distance"] for r in rows}
