"""The headline findings about driver assistance in weather (F-nn, decision X-7)."""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import (
    Amount,
    Claim,
    Mean,
    Never,
    Outweighs,
    Paired,
    RateBelow,
    Rows,
    finished,
    highest,
    lowest,
    rows_of,
)
from skidpad.evidence.verdicts import Finding

COLLISIONS = Amount(0.1, "collisions per run")  # fewer does not matter
INVASIONS = Amount(0.2, "markings per run")
PHANTOMS = Amount(0.2, "brakings per run")
SPEED = Amount(2.0, "km/h")
POINT = Amount(1.0, "percentage point")
POINTS = Amount(5.0, "percentage points")
METRES = Amount(0.2, "m")
VARIANCE = Amount(5.0, "m2")
SECONDS = Amount(1.0, "s per run")
TTC = Amount(0.1, "s")
OFF_LANES_MAX_PCT = 1.0  # of all ticks
BY_RUN = ("weather", "seed")
ASSISTED = rows_of("config", "1", "2", "3", "4", name="configurations 1 to 4")
NIGHT = rows_of("time_of_day", "night")
DAY = Rows("day", ~NIGHT.are)
RAIN = rows_of("precipitation_kind", "rain")
CLEAR = Rows("clear", ~RAIN.are)


def config(name: str) -> Rows:
    """Runs of one configuration."""
    return rows_of("config", name, name=f"configuration {name}")


def configs(column: str, more: str, less: str, margin: Amount) -> Paired:
    """`column` is larger in configuration `more` than in `less`."""
    return Paired(column=column, more=config(more), less=config(less), by=BY_RUN, amount=margin)


def variants(column: str, more: str, less: str, margin: Amount) -> Paired:
    """`column` is larger in variant `more` of a study than in `less`."""
    return Paired(
        column=column, more=rows_of("variant", more), less=rows_of("variant", less),
        by=("config", "weather", "seed"), amount=margin,
    )  # fmt: skip


def at_night(column: str, amount: Amount, claim: Claim = Claim.MORE) -> Paired:
    """`column` is larger at night than by day, or hardly."""
    return Paired(
        column=column, more=NIGHT, less=DAY, by=("config", "precipitation_kind", "seed"),
        amount=amount, claim=claim, where=ASSISTED,
    )  # fmt: skip


def ttc_hardly_more(more: str, less: str) -> Paired:
    """One side of an equivalence: the minimum is hardly larger in one configuration."""
    return Paired(
        column="min_ttc_s", more=config(more), less=config(less), by=BY_RUN, amount=TTC,
        claim=Claim.HARDLY_MORE,
    )  # fmt: skip


def unequal_logs(table: pl.DataFrame) -> tuple[int, int]:
    """Pairs of paced and slowed runs with unequal logs, and all pairs."""
    sides = [table.filter(pl.col("variant") == v) for v in ("paced", "slowed")]
    keys = [k for k in ("config", "weather", "seed") if k in table.columns]
    both = sides[0].join(sides[1], on=keys, suffix="_slowed")
    return int((both["log_hash"] != both["log_hash_slowed"]).sum()), len(both)


def astray(table: pl.DataFrame) -> str:
    """Why no verdict may rest on these runs: they drove off all lanes and nothing counted it (R-6).

    Empty: they kept to the road.
    """
    if "off_lanes_pct" not in table.columns:
        return ""
    known = finished(table).drop_nulls("off_lanes_pct")
    share = float(known["off_lanes_pct"].mean() or 0.0)  # type: ignore[arg-type]
    if share <= OFF_LANES_MAX_PCT:
        return ""
    return (
        f"No verdict: {share:.1f} % of the ticks are off all lanes outside a counted departure; "
        f"at most {OFF_LANES_MAX_PCT:g} % may be."
    )


MATRIX = "all configurations and weathers"
FINDINGS: tuple[Finding, ...] = (
    Finding(
        "F-01", "Collisions do not fall steadily with automation: 0 > 3 > 2 > 1 > 4.",
        "difference of fatal collisions per run between neighbours in that order", MATRIX,
        tuple(
            configs("fatal_collisions", more, less, COLLISIONS)
            for more, less in (("0", "3"), ("3", "2"), ("2", "1"), ("1", "4"))
        ),
    ),
    Finding(
        "F-04", "Lane centring adds collisions, because it lets the car go faster into bends.",
        "fatal collisions and speed in bends, configuration 2 minus 1", "configurations 1 and 2",
        (
            configs("fatal_collisions", "2", "1", COLLISIONS),
            configs("bend_speed_kmh", "2", "1", SPEED),
        ),
    ),
    Finding(
        "F-05", "Lane centring raises the speed.",
        "mean, 95th percentile and bend speed, configuration 2 minus 1", "configurations 1 and 2",
        tuple(configs(f"{which}_speed_kmh", "2", "1", SPEED) for which in ("mean", "p95", "bend")),
    ),
    Finding(
        "F-07", "A limit of 80 km/h removes the collisions.",
        "rate of configuration 4 against a limit; configuration 3 minus 4", "configurations 3 and 4",
        (
            RateBelow(
                what="the rate of configuration 4", events=pl.col("fatal_collisions").sum(),
                limit=COLLISIONS, where=config("4").are,
            ),
            configs("fatal_collisions", "3", "4", COLLISIONS),
        ),
    ),
    Finding(
        "F-08", "Speed, not perception, decides.",
        "effect of the target speed on collisions minus that of injected dropout",
        "its own study: target speed x injected dropout",
        (
            Paired(
                column="fatal_collisions", more=highest("target_kmh"), less=lowest("target_kmh"),
                by=("seed",), amount=COLLISIONS,
            ),
            Outweighs(
                column="fatal_collisions", factor="target_kmh", other="dropout_injected",
                by=("seed",), margin=COLLISIONS,
            ),
        ),
        study=True,
    ),
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
        "mean error, variance and dropout, night minus day, configurations 1 to 4", "night and day",
        (
            at_night("mean_error_m", METRES),
            at_night("headway_variance_m2", VARIANCE),
            at_night("dropout_pct", POINT, Claim.HARDLY_MORE),
        ),
        built_in="without noise the sun cannot act on depth and radar",
    ),
    Finding(
        "F-13", "Rain makes configuration 3 collide more.",
        "fatal collisions per run, rain minus clear", "configuration 3 in rain and clear",
        (
            Paired(
                column="fatal_collisions", more=RAIN, less=CLEAR, by=("time_of_day", "seed"),
                amount=COLLISIONS, where=config("3"),
            ),
        ),
    ),
    Finding(
        "F-16",
        "False positives are highest without assistance, and the wide pre-filter makes them.",
        "false positive rate: configuration 0 minus 1 to 4; pre-filter minus lane check",
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
        "F-17", "Holding a lost target for 5 s brakes for phantoms; the radar cascade does not.",
        "phantom brakings per run, safety-persist minus cascade",
        "its own study: a lead that changes lane, both settings",
        (variants("phantom_brakings", "safety_persist", "cascade", PHANTOMS),), study=True,
    ),
    Finding(
        "F-21", "Map-matched radar trades false positives for fewer misses and dropouts.",
        "false positive, false negative and dropout rate, map-matched against corridor",
        "its own study: both radar filters, all else equal",
        (
            variants("radar_fpr_pct", "map_matched", "corridor", POINT),
            variants("radar_fnr_pct", "corridor", "map_matched", POINT),
            variants("dropout_pct", "corridor", "map_matched", POINT),
        ),
        study=True,
    ),
    Finding(
        "F-25", "Slowing the client changes no metric in synchronous mode.",
        "pairs of runs with unequal content hash", "its own study: the same runs paced and slowed",
        (Never("unequal pairs of logs", unequal_logs),), study=True,
        built_in="no clock is read within the loop, so it is held against itself",
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
