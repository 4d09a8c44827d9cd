"""The headline findings about driver assistance in weather (F-nn, decision X-7), in order."""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import Claim, Mean, Paired, drop_unfinished, rows_of
from skidpad.evidence.drive.crash_findings import CRASH_FINDINGS
from skidpad.evidence.drive.sides import (
    ASSISTED,
    BY_RUN,
    INVASIONS,
    METRES,
    POINT,
    POINTS,
    SECONDS,
    VARIANCE,
    at_night,
    config,
    configs,
    ttc_hardly_more,
)
from skidpad.evidence.drive.study_findings import STUDY_FINDINGS
from skidpad.evidence.verdicts import Finding

OFF_LANES_MAX_PCT = 1.0  # of all ticks


def astray(table: pl.DataFrame) -> str:
    """Returns why no verdict may rest on these runs: they drove off all lanes and nothing counted it (R-6).

    "" where at most OFF_LANES_MAX_PCT of the ticks are, or nothing is known of it.
    """
    if "off_lanes_pct" not in table.columns:
        return ""
    known = drop_unfinished(table).drop_nulls("off_lanes_pct")
    share = float(known["off_lanes_pct"].mean() or 0.0)  # type: ignore[arg-type]
    if share <= OFF_LANES_MAX_PCT:
        return ""
    return (
        f"No verdict: {share:.1f} % of the ticks are off all lanes outside a counted departure; "
        f"at most {OFF_LANES_MAX_PCT:g} % may be."
    )


OTHERS: tuple[Finding, ...] = (
    Finding(
        "F-10", "Lane centring cuts lane invasions.",
        "solid markings crossed per run, configuration 1 minus 2", "configurations 1 and 2",
        (configs("lane_invasions", "1", "2", INVASIONS),),
    ),
    Finding(
        "F-11", "The high sun of noon costs detections that sunrise does not.",
        "dropout, clear noon minus clear sunrise, configurations 1 to 4",
        "clear-noon and clear-sunrise",
        (
            Paired(
                column="dropout_pct", more=rows_of("weather", "clear-noon"),
                less=rows_of("weather", "clear-sunrise"), by=("config", "seed"), amount=POINT,
                where=ASSISTED,
            ),
        ),
        built_in="without noise the sun cannot act on depth and radar",
    ),
    Finding(
        "F-12", "Night raises distance error and variance without more dropout.",
        "mean distance error, its variance and dropout, night minus day, configurations 1 to 4",
        "night and day, both clear or both in rain",
        (
            at_night("mean_error_m", METRES),
            at_night("headway_variance_m2", VARIANCE),
            at_night("dropout_pct", POINT, Claim.HARDLY_MORE),
        ),
        built_in="without noise the sun cannot act on depth and radar",
    ),
    Finding(
        "F-16",
        "False positives are highest without assistance, and the wide pre-filter makes them.",
        "radar false positives: configuration 0 minus 1 to 4; pre-filter minus lane check",
        "configuration 0 and one of 1 to 4",
        (
            Paired(
                column="radar_fpr_pct", more=config("0"), less=ASSISTED, by=BY_RUN, amount=POINTS,
            ),
            Mean(
                label="false positives, pre-filter minus lane check",
                value=pl.col("radar_fpr_pct_pre") - pl.col("radar_fpr_pct"), margin=POINTS,
                by=("config", "weather", "precipitation_kind", "time_of_day", "variant", "seed"),
            ),
        ),
    ),
    Finding(
        "F-26",
        "Minimum time to collision does not separate configurations; time below 1.5 s does.",
        "configuration 3 minus 4: time below 1.5 s, and change of the minimum",
        "configurations 3 and 4",
        (
            configs("ttc_below_1_5_s", "3", "4", SECONDS),
            ttc_hardly_more("3", "4"),
            ttc_hardly_more("4", "3"),
        ),
    ),
)  # fmt: skip
FINDINGS = tuple(sorted((*CRASH_FINDINGS, *STUDY_FINDINGS, *OTHERS), key=lambda f: f.id))
