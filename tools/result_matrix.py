"""Tables of driver assistance in weather, made of committed results."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import polars as pl

from result_texts import limits, markdown, verdict_rows
from skidpad.evidence.drive.acceptance import ACCEPTANCE
from skidpad.evidence.drive.findings import FINDINGS, astray
from skidpad.evidence.statistics import Rate, compare_pairs, event_rate
from skidpad.evidence.verdicts import Judgement, judge
from skidpad.recording.campaign.folder import CampaignFolder
from skidpad.recording.campaign.matrix import MatrixEntry
from skidpad.recording.campaign.quantities import name_of
from skidpad.report.matrix.data import Matrix, config_title, mean_of, rate_by_seed, weather_title
from skidpad.report.matrix.tables import METRICS

COUNTS = {
    column: name_of(column)
    for column in ("crashes_vehicle", "road_departures", "fatal_collisions", "fatal_first")
}
COMPARED = {
    **{c: name_of(c) for c in ("fatal_collisions", "crashes_vehicle", "road_departures")},
    "mean_speed_kmh": METRICS["mean_speed_kmh"].heading,
    "dropout_pct": "dropout, percentage points",
    "mean_error_m": METRICS["mean_error_m"].heading,
}


def matrix_of(folder: Path) -> Matrix:
    """The results of a matrix."""
    return Matrix(CampaignFolder(folder, MatrixEntry))


def headline(folder: Path) -> str:
    """One row per configuration, every drive once: per run, per 100 km, and how fast."""
    matrix = matrix_of(folder)
    head = [
        "configuration",
        "runs",
        *COUNTS.values(),
        "interventions per 100 km",
        METRICS["mean_speed_kmh"].heading,
    ]
    rows = []
    for c in matrix.configs:
        runs = matrix.cell(c)
        counts = [rated(matrix.rate(name, c)) for name in COUNTS]
        per_distance = rated(_per_100_km(runs, "fatal_collisions"))
        rows.append([config_title(c), str(len(runs)), *counts, per_distance, _speed(matrix, c)])
    return markdown(head, rows)


def factors(folder: Path) -> str:
    """One row per configuration and weather: what a factor changes, and how fast that is."""
    matrix = matrix_of(folder)
    cells = [(c, w) for c in sorted(matrix.configs, key=_numbers_count) for w in matrix.weathers]
    rows = []
    for c, w in cells:
        runs = matrix.cell(c, w)
        counts = [rated(rate_by_seed(runs, name)) for name in COUNTS]
        rows.append(
            [config_title(c), weather_title(w), str(len(runs)), *counts, _speed(matrix, c, w)]
        )
    head = ["configuration", "weather", "runs", *COUNTS.values(), METRICS["mean_speed_kmh"].heading]
    return markdown(head, rows)


def by_weather(folder: Path, column: str) -> str:
    """Events per run by configuration and weather."""
    matrix = matrix_of(folder)
    head = ["configuration", *map(weather_title, matrix.weathers)]
    rows = [
        [config_title(c), *(rated(matrix.rate(column, c, w)) for w in matrix.weathers)]
        for c in matrix.configs
    ]
    return markdown(head, rows)


def claims(folder: Path) -> str:
    """Every claim that a matrix can judge."""
    return verdict_rows(_judged(folder))


def verdicts(folders: Sequence[Path]) -> str:
    """What became of each claim in several campaigns, side by side."""
    judged = [_judged(folder) for folder in folders]
    rows = [
        [same[0].finding.id, same[0].finding.claim, *(j.verdict.value for j in same)]
        for same in zip(*judged, strict=True)
    ]
    return markdown(("id", "claim", *(folder.name for folder in folders)), rows)


def _judged(folder: Path) -> list[Judgement]:
    results = matrix_of(folder).results
    found = [f for f in (*FINDINGS, *ACCEPTANCE) if not f.study]
    return judge(found, [results] * len(found), astray(results))


def against(reference: Path, other: Path) -> str:
    """The other campaign minus the reference over the cells that both drove.

    Weathers of a seed share their traffic, so a pair is a seed: the mean of its cells.
    """
    a, b = (matrix_of(folder).finished for folder in (reference, other))
    cell = ["config", "weather", "seed"]
    pairs = a.join(b, on=cell, suffix="_b").sort(
        cell
    )  # sums in one order: 0.175 is rounded one way
    rows = []
    configs = matrix_of(other).configs
    for config in configs if len(configs) == 1 else ["", *configs]:
        runs = pairs if not config else pairs.filter(pl.col("config") == config)
        for name, title in COMPARED.items():
            both = runs.drop_nulls([name, f"{name}_b"])
            if not len(both):
                continue
            change = (pl.col(f"{name}_b").cast(pl.Float64) - pl.col(name)).mean()
            seeds = both.group_by("seed", maintain_order=True).agg(change.alias("change"))["change"]
            c = compare_pairs(seeds.to_numpy())
            title_of = config_title(config) if config else "all"
            rows.append([title_of, title, str(c.n), f"{round(c.mean, 9):+.2f}", limits(c.interval)])
    return markdown(("configuration", "per run", "seeds", f"minus {reference.name}", "95 %"), rows)


def _numbers_count(name: str) -> list[str | int]:
    """Sorts `2 at 90 km/h` before `2 at 100 km/h`."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def rated(rate: Rate | None) -> str:
    """`1.98 [1.57, 2.40]`, or in place of the limits the seeds that had an event."""
    if rate is None:
        return "no run"
    if rate.interval is None:
        return f"{rate.rate:.2f}, in {rate.runs_with} of {rate.runs}"
    return f"{rate.rate:.2f} {limits(rate.interval)}"


def _per_100_km(runs: pl.DataFrame, column: str) -> Rate | None:
    """Events over distance; seeds are what the interval is over, as in `rate_by_seed`."""
    known = runs.drop_nulls([column, "distance_km"])
    if not len(known):
        return None
    seeds = known.group_by("seed", maintain_order=True).agg(pl.col(column, "distance_km").sum())
    return event_rate(seeds[column].to_list(), (seeds["distance_km"] / 100.0).to_list())


def _speed(matrix: Matrix, config: str, weather: str | None = None) -> str:
    speed = mean_of(matrix.cell(config, weather), "mean_speed_kmh")
    return "no run" if speed is None else f"{speed:.1f}"
