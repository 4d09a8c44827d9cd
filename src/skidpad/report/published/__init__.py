"""The published numbers, to stand beside ours in a report, marked as published (decision X-6).

They are copied from the three theses' tables and nothing else in Skidpad may read them: a simulator
that knew the answer would prove nothing. Each cell of the matrix was one run of 500 s.
"""

from __future__ import annotations

from enum import Enum
from functools import cache
from importlib.resources import files
from typing import Any

import polars as pl


class Source(str, Enum):
    """One table each; the value is the name of its file here."""

    MATRIX = "adas_results_by_config_weather"  # tables 5 to 9 of the ADAS thesis
    SPEEDS = "adas_average_speeds"  # table 15 and sections 6.1, 7.2
    PRELIMINARY = "adas_preliminary_vs_final_matching_runs"  # table 14
    SAMPLES = "adas_sample_counts"  # table 14 and section 6.1
    REAL_TIME = "adas_rtf_figures"  # sections 4.1, 5.5, 6.3
    PRESETS = "grip_weather_presets"  # tables 2 and 3 of the friction thesis
    COMPLETION = "grip_completion_and_score"
    WARPING = "grip_dtw_reduced_vs_original"
    CUTIN_COMPLETION = "grip_cutin_fix_completion_score"
    CUTIN_WARPING = "grip_cutin_fix_dtw"
    HAZARDS = "channels_hsi_summary"  # tables of the channels thesis
    HAZARDS_BY_TOWN = "channels_hsi_results_by_town"
    VIOLATIONS = "channels_spi_violations_summary"
    VIOLATIONS_BY_TOWN = "channels_spi_violations_by_town"
    TIMING = "channels_timing_statistics"
    ROUTES = "channels_routes"  # table 6.1


KINDS = {"Clear Sky": "clear", "Heavy Rain": "rain"}
COLUMNS = {"collisions": "fatal_collisions", "speed_kmh": "mean_speed_kmh"}


def read_published(source: Source) -> pl.DataFrame:
    """Returns a published table as it was copied."""
    text = (files(__name__) / f"{source.value}.csv").read_bytes()
    return pl.read_csv(text, infer_schema_length=None)


@cache
def published_rows(source: Source, *keys: str) -> dict[Any, dict[str, Any]]:
    """Returns the rows of a table by the values of these columns: a tuple, or one value for one column."""
    rows = read_published(source).to_dicts()
    return {tuple(r[k] for k in keys) if len(keys) > 1 else r[keys[0]]: r for r in rows}


def published_matrix() -> pl.DataFrame:
    """Returns the 30 published cells with columns named as results.parquet; null where unpublished."""
    cells = _cells(read_published(Source.MATRIX)).drop("config_features", "source")
    speeds = read_published(Source.SPEEDS).filter(
        pl.col("source").is_in(["Table 15", "section 6.1.1"])
    )
    speeds = _cells(speeds).select("config", "weather", "mean_speed_kmh")
    return cells.join(speeds, on=["config", "weather"], how="left").sort("config", "weather")


def _cells(table: pl.DataFrame) -> pl.DataFrame:
    """Returns a published table with configuration and weather named as ours."""
    kind = pl.col("weather").replace_strict(KINDS)
    time = pl.col("time_of_day").str.to_lowercase()
    return table.select(
        pl.col("config_id").cast(pl.String).alias("config"),
        (kind + "-" + time).alias("weather"),
        kind.alias("precipitation_kind"),
        time.alias("time_of_day"),
        pl.exclude("config_id", "weather", "time_of_day").name.map(lambda c: COLUMNS.get(c, c)),
    )
