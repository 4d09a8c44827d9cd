"""What the friction report works on: cells with both frictions, their series, published values."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
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
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.grip import GRIP, GripEntry, read_series
from skidpad.report.elements.campaign import CampaignView

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
PAIRED = ["scenario", "weather", "friction", "cutin", "seed"]  # name a run of the campaign


@dataclass(frozen=True)
class GripCampaign(CampaignView[GripEntry]):
    """A campaign with and without friction of weathers."""

    columns = GRIP
    common = ("controller", "sensors", "model", "version")

    @cached_property
    def four_cells(self) -> bool:
        """Returns True when runs were driven with and without drops on the cameras (B-161)."""
        return self.results["overlay"].n_unique() > 1

    @cached_property
    def plain(self) -> pl.DataFrame:
        """Returns the results of the campaign proper: without the runs with drops, where both were driven."""
        return self.results.filter(~pl.col("overlay")) if self.four_cells else self.results

    @cached_property
    def pairs(self) -> dict[Key, Pair]:
        """Returns the cells of the campaign proper by (scenario, weather), in the published order."""
        found = {(p.scenario, p.weather): p for p in pairs(self.plain) if p.cutin == FIXED}
        return {k: found[k] for k in sorted(found, key=self._order)}

    @cached_property
    def variants(self) -> dict[str, Pair]:
        """Returns the variants of the cut-in at the baseline; empty when only one was driven (B-075)."""
        cut_ins = [p for p in pairs(self.plain) if p.scenario == CUT_IN]
        found = {p.cutin: p for p in cut_ins if p.weather == BASELINE}
        return found if len(found) > 1 else {}

    @cached_property
    def counted(self) -> pl.DataFrame:
        """Returns the finished runs of the campaign proper, with the fixed cut-in."""
        here = ~pl.col("outcome").is_in(NOT_RUN) & (pl.col("cutin") == FIXED)
        return self.plain.filter(here)

    def _order(self, key: Key) -> tuple[int, int, str]:
        """Returns a key that sorts by scenario, then known weathers in order, then the others by name."""
        scenario, weather = key
        known = WEATHERS.index(weather) if weather in WEATHERS else len(WEATHERS)
        return list(SCENARIOS).index(scenario), known, weather

    @cached_property
    def scenarios(self) -> list[str]:
        """Returns the scenarios that were driven, in order."""
        return list(dict.fromkeys(s for s, _ in self.pairs))

    def of(self, scenario: str) -> list[Pair]:
        """Returns the cells of a scenario, in the order of weathers."""
        return [pair for pair in self.pairs.values() if pair.scenario == scenario]

    @property
    def titles(self) -> list[tuple[str, str]]:
        """Returns the driven scenarios with their names for people."""
        return [(s, scenario_title(s)) for s in self.scenarios]

    @cached_property
    def both(self) -> bool:
        """Returns True when any cell was driven with both settings of friction."""
        return any(len(p.original) and len(p.reduced) for p in self.pairs.values())

    @cached_property
    def _series(self) -> dict[tuple[str, str, str, str], CellSeries]:
        """Returns an empty cache of series, filled by `series` as it is asked."""
        return {}

    def series(self, pair: Pair, friction: str) -> CellSeries | None:
        """Returns the recorded series of a cell with this friction, read once; None without runs."""
        key = (pair.scenario, pair.cutin, pair.weather, friction)
        runs = pair.side(friction)
        if key not in self._series and len(runs):
            names = dict(zip(runs["seed"], self.names(runs), strict=True))
            self._series[key] = cell_series(
                runs, lambda seed: read_series(self.folder.path, str(names[seed]))
            )
        return self._series.get(key)

    @cached_property
    def distances(self) -> dict[Key, dict[str, Distance]]:
        """Returns warping distances of reduced against original grip, by cell that has both, then metric."""
        found = {}
        for key, pair in self.pairs.items():
            a, b = self.series(pair, ORIGINAL), self.series(pair, REDUCED)
            if a is not None and b is not None:
                found[key] = {d.metric: d for d in distances(a, b, pair.identical)}
        return found

    @cached_property
    def variant_distances(self) -> dict[str, dict[str, Distance]]:
        """Returns warping distances of each cut-in from `original`, by variant and metric (B-077).

        Friction untouched; empty without the original.
        """
        base = self.variants.get("original")
        start = self.series(base, ORIGINAL) if base is not None else None
        found = {}
        for name, pair in self.variants.items():
            mine = self.series(pair, ORIGINAL)
            if start is not None and mine is not None:
                compared = distances(start, mine, identical=name == "original")
                found[name] = {d.metric: d for d in compared}
        return found

    @cached_property
    def delays(self) -> dict[Key, np.ndarray[tuple[int], np.dtype[np.float64]]]:
        """Returns the delay of each pair of runs in s by cell; nan where no shift explains the difference."""
        found = {}
        for key, pair in self.pairs.items():
            a, b = self.series(pair, ORIGINAL), self.series(pair, REDUCED)
            if a is not None and b is not None:
                found[key] = delays(a, b)
        return found

    def with_delays(self) -> pl.DataFrame:
        """Returns the results of the campaign proper with `delay_s`, only for reduced friction.

        It is null in other rows and where no delay was found. Without any pair of runs the column is
        missing.
        """
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
            return self.plain
        return self.plain.join(pl.concat(parts), on=PAIRED, how="left")


def load_grip(folder: Path) -> GripCampaign:
    """Returns the campaign in a folder; FileError when it holds no results of one."""
    found = GripCampaign(CampaignFolder(folder, GripEntry))
    if "friction" not in found.results.columns:
        raise FileError(f"{folder} holds no friction campaign")
    return found


def scenario_title(name: str) -> str:
    """Returns the title of a scenario for readers; an unknown one's name."""
    return SCENARIOS.get(name, name)
