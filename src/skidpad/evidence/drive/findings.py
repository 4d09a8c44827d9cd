"""The headline findings about driver assistance in weather (F-nn, decision X-7)."""

from __future__ import annotations

import numpy as np
import polars as pl

from skidpad.evidence.contrasts import NOT_RUN, complete, contrast, differences
from skidpad.evidence.statistics import Interval
from skidpad.evidence.verdicts import Contrast, Finding, paired, rate_below

COLLISIONS = 0.1  # per run: fewer does not matter
SPEED = 2.0  # km/h
POINTS = 1.0  # percentage points
METRES = 0.2
VARIANCE = 5.0  # m^2
INVASIONS = 0.2  # per run
SECONDS = 1.0
TTC = 0.1  # s
ASSISTED = ("1", "2", "3", "4")
FACTORS = ("config", "weather", "precipitation_kind", "time_of_day", "variant", "seed")


def config(name: str) -> pl.Expr:
    """Rows of one configuration."""
    return pl.col("config") == name


def configs_differ(
    table: pl.DataFrame, column: str, more: str, less: str, margin: float
) -> list[Contrast]:
    """`column` is larger in configuration `more` than in `less`, at equal weather and seed."""
    label = f"{column}, configuration {more} minus {less}"
    return contrast(table, label, column, config(more), config(less), ("weather", "seed"), margin)


def f01(table: pl.DataFrame) -> list[Contrast]:
    """Neighbours in the claimed order."""
    order = (("0", "3"), ("3", "2"), ("2", "1"), ("1", "4"))
    return complete([configs_differ(table, "fatal_collisions", *p, COLLISIONS) for p in order])


def f04(table: pl.DataFrame) -> list[Contrast]:
    """Collisions and speed in bends."""
    return complete(
        [
            configs_differ(table, "fatal_collisions", "2", "1", COLLISIONS),
            configs_differ(table, "bend_speed_kmh", "2", "1", SPEED),
        ]
    )


def f05(table: pl.DataFrame) -> list[Contrast]:
    """Three measures of speed."""
    columns = ("mean_speed_kmh", "p95_speed_kmh", "bend_speed_kmh")
    return complete([configs_differ(table, c, "2", "1", SPEED) for c in columns])


def f07(table: pl.DataFrame) -> list[Contrast]:
    """The rate itself, and the step from configuration 3."""
    limited = table.filter(config("4") & ~pl.col("outcome").is_in(NOT_RUN))
    if not len(limited):
        return []
    events = int(limited["fatal_collisions"].sum())
    label = f"{COLLISIONS:g} collisions per run minus the rate of configuration 4"
    return complete(
        [
            [rate_below(label, events, len(limited), COLLISIONS)],
            configs_differ(table, "fatal_collisions", "3", "4", COLLISIONS),
        ]
    )


def f08(table: pl.DataFrame) -> list[Contrast]:
    """Columns target_kmh, dropout_injected, seed, fatal_collisions: a two-factor experiment."""
    if not len(table):
        return []
    effects = []
    for factor in ("target_kmh", "dropout_injected"):
        high, low = (pl.col(factor) == v for v in (table[factor].max(), table[factor].min()))
        effect, _ = differences(table, high, low, ("seed",), "fatal_collisions")
        effects.append(effect.to_numpy())
    speed, dropout = effects
    if not speed.size or speed.size != dropout.size:
        return []
    return [
        paired("collisions, highest minus lowest speed", speed, COLLISIONS),
        paired("effect of speed minus effect of dropout", speed - np.abs(dropout), COLLISIONS),
    ]


def f10(table: pl.DataFrame) -> list[Contrast]:
    """Solid markings."""
    return configs_differ(table, "lane_invasions", "1", "2", INVASIONS)


def f11(table: pl.DataFrame) -> list[Contrast]:
    """The same clear road under another sun."""
    clear = table.filter(pl.col("config").is_in(ASSISTED))
    noon, sunrise = (pl.col("weather") == f"clear-{t}" for t in ("noon", "sunrise"))
    label = "dropout_pct, clear noon minus clear sunrise"
    return contrast(clear, label, "dropout_pct", noon, sunrise, ("config", "seed"), POINTS)


def f12(table: pl.DataFrame) -> list[Contrast]:
    """Two growths and one absence of growth."""
    rows = table.filter(pl.col("config").is_in(ASSISTED))
    night = pl.col("time_of_day") == "night"
    by = ("config", "precipitation_kind", "seed")
    parts = [
        contrast(rows, f"{column}, night minus day", column, night, ~night, by, margin)
        for column, margin in (("mean_error_m", METRES), ("headway_variance_m2", VARIANCE))
    ]
    more, same = differences(rows, night, ~night, by, "dropout_pct")
    label = f"{POINTS:g} point minus the growth of dropout_pct at night"
    spare = [paired(label, POINTS - more.to_numpy(), 0.0, same)] if len(more) else []
    return complete([*parts, spare])


def f13(table: pl.DataFrame) -> list[Contrast]:
    """Rain against clear."""
    rain = pl.col("precipitation_kind") == "rain"
    rows = table.filter(config("3"))
    label = "fatal_collisions, configuration 3, rain minus clear"
    by = ("time_of_day", "seed")
    return contrast(rows, label, "fatal_collisions", rain, ~rain, by, COLLISIONS)


def f16(table: pl.DataFrame) -> list[Contrast]:
    """Between configurations, and between filter levels."""
    assisted = pl.col("config").is_in(ASSISTED)
    by, label = ("weather", "seed"), "radar_fpr_pct, configuration 0 minus 1 to 4"
    drop = table.with_columns(filtered=pl.col("radar_fpr_pct_pre") - pl.col("radar_fpr_pct"))
    drop = drop.drop_nulls("filtered").sort([c for c in FACTORS if c in drop.columns])
    saved = (
        [paired("false positives, pre-filter minus lane check", drop["filtered"], 5.0 * POINTS)]
        if len(drop)
        else []
    )
    first = contrast(table, label, "radar_fpr_pct", config("0"), assisted, by, 5.0 * POINTS)
    return complete([first, saved])


def variants_differ(
    table: pl.DataFrame, column: str, more: str, less: str, margin: float
) -> list[Contrast]:
    """`column` is larger in variant `more` of a study than in `less`, at equal seeds."""
    high, low = pl.col("variant") == more, pl.col("variant") == less
    by = ("config", "weather", "seed")
    return contrast(table, f"{column}, {more} minus {less}", column, high, low, by, margin)


def f17(table: pl.DataFrame) -> list[Contrast]:
    """Columns variant (cascade, safety_persist), seed, phantom_brakings."""
    return variants_differ(table, "phantom_brakings", "safety_persist", "cascade", 0.2)


def f21(table: pl.DataFrame) -> list[Contrast]:
    """Columns variant (map_matched, corridor), seed and the metrics."""
    return complete(
        [
            variants_differ(table, "radar_fpr_pct", "map_matched", "corridor", POINTS),
            variants_differ(table, "radar_fnr_pct", "corridor", "map_matched", POINTS),
            variants_differ(table, "dropout_pct", "corridor", "map_matched", POINTS),
        ]
    )


def f25(table: pl.DataFrame) -> list[Contrast]:
    """Columns variant (paced, slowed), seed, log_hash. One unequal pair contradicts the claim."""
    sides = [table.filter(pl.col("variant") == v) for v in ("paced", "slowed")]
    keys = [k for k in ("config", "weather", "seed") if k in table.columns]
    both = sides[0].join(sides[1], on=keys, suffix="_slowed")
    if not len(both):
        return []
    unequal = int((both["log_hash"] != both["log_hash_slowed"]).sum())
    label = "0.5 minus the number of unequal pairs of logs"
    return [rate_zero(label, unequal, len(both))]


def rate_zero(label: str, unequal: int, pairs: int) -> Contrast:
    """A deterministic claim: certain either way, so its p values are 0 and 1."""
    value = 0.5 - unequal
    p_claimed, p_reversed = (1.0, 0.0) if unequal else (0.0, 1.0)
    sure = Interval(value, value)
    return Contrast(label, value, sure, p_claimed, p_reversed, 0.0, pairs, pairs)


def f26(table: pl.DataFrame) -> list[Contrast]:
    """One difference and one equivalence."""
    by = ("weather", "seed")
    shift, _ = differences(table, config("3"), config("4"), by, "min_ttc_s")
    change = shift.to_numpy()
    return complete(
        [
            configs_differ(table, "ttc_below_1_5_s", "3", "4", SECONDS),
            [paired(f"{TTC:g} s minus the change of min_ttc_s", TTC - change, 0.0)]
            if change.size
            else [],
            [paired(f"{TTC:g} s plus the change of min_ttc_s", TTC + change, 0.0)]
            if change.size
            else [],
        ]
    )


SIGNS = "paired by weather and seed; sign changes, exact up to 12 pairs; bootstrap interval"
MATRIX = "all configurations and weathers"
FINDINGS: tuple[Finding, ...] = (
    Finding(
        id="F-01",
        claim="Collisions do not fall steadily with automation: 0 > 3 > 2 > 1 > 4.",
        estimand="difference of fatal collisions per run between neighbours in that order",
        needs=MATRIX,
        test=SIGNS,
        margin=f"{COLLISIONS:g} per run",
        contrasts=f01,
    ),
    Finding(
        id="F-04",
        claim="Lane centring adds collisions, because it lets the car go faster into bends.",
        estimand="fatal collisions and speed in bends, configuration 2 minus 1",
        needs="configurations 1 and 2",
        test=SIGNS,
        margin=f"{COLLISIONS:g} per run, {SPEED:g} km/h",
        contrasts=f04,
    ),
    Finding(
        id="F-05",
        claim="Lane centring raises the speed.",
        estimand="mean, 95th percentile and bend speed, configuration 2 minus 1",
        needs="configurations 1 and 2",
        test=SIGNS,
        margin=f"{SPEED:g} km/h",
        contrasts=f05,
    ),
    Finding(
        id="F-07",
        claim="A limit of 80 km/h removes the collisions.",
        estimand="rate of configuration 4 against a limit; configuration 3 minus 4",
        needs="configurations 3 and 4",
        test=f"exact Poisson against the margin; {SIGNS}",
        margin=f"{COLLISIONS:g} per run",
        contrasts=f07,
    ),
    Finding(
        id="F-08",
        claim="Speed, not perception, decides.",
        estimand="effect of the target speed on collisions minus that of injected dropout",
        needs="its own study: target speed x injected dropout",
        test="paired by seed; sign changes",
        margin=f"{COLLISIONS:g} per run",
        contrasts=f08,
        study=True,
    ),
    Finding(
        id="F-10",
        claim="Lane centring cuts lane invasions.",
        estimand="solid markings crossed per run, configuration 1 minus 2",
        needs="configurations 1 and 2",
        test=SIGNS,
        margin=f"{INVASIONS:g} per run",
        contrasts=f10,
    ),
    Finding(
        id="F-11",
        claim="The high sun of noon costs detections that sunrise does not.",
        estimand="dropout, clear noon minus clear sunrise, configurations 1 to 4",
        needs="clear-noon and clear-sunrise",
        test="paired by configuration and seed; sign changes",
        margin=f"{POINTS:g} percentage point",
        contrasts=f11,
    ),
    Finding(
        id="F-12",
        claim="Night raises distance error and variance without more dropout.",
        estimand="mean error, variance and dropout, night minus day, configurations 1 to 4",
        needs="night and day",
        test="paired by configuration, rain and seed; sign changes",
        margin=f"{METRES:g} m, {VARIANCE:g} m2, {POINTS:g} percentage point",
        contrasts=f12,
    ),
    Finding(
        id="F-13",
        claim="Rain makes configuration 3 collide more.",
        estimand="fatal collisions per run, rain minus clear",
        needs="configuration 3 in rain and clear",
        test="paired by time of day and seed; sign changes",
        margin=f"{COLLISIONS:g} per run",
        contrasts=f13,
    ),
    Finding(
        id="F-16",
        claim="False positives are highest without assistance, and the wide pre-filter makes them.",
        estimand="false positive rate: configuration 0 minus 1 to 4; pre-filter minus lane check",
        needs="configuration 0 and one of 1 to 4",
        test=SIGNS,
        margin=f"{5 * POINTS:g} percentage points",
        contrasts=f16,
    ),
    Finding(
        id="F-17",
        claim="Holding a lost target for 5 s brakes for phantoms; the radar cascade does not.",
        estimand="phantom brakings per run, safety-persist minus cascade",
        needs="its own study: a lead that changes lane, both settings",
        test="paired by seed; sign changes",
        margin="0.2 per run",
        contrasts=f17,
        study=True,
    ),
    Finding(
        id="F-21",
        claim="Map-matched radar trades false positives for fewer misses and dropouts.",
        estimand="false positive, false negative and dropout rate, map-matched against corridor",
        needs="its own study: both radar filters, all else equal",
        test="paired by seed; sign changes",
        margin=f"{POINTS:g} percentage point",
        contrasts=f21,
        study=True,
    ),
    Finding(
        id="F-25",
        claim="Slowing the client changes no metric in synchronous mode.",
        estimand="pairs of runs with unequal content hash",
        needs="its own study: the same runs paced and slowed",
        test="equality of logs; one unequal pair contradicts",
        margin="none",
        contrasts=f25,
        study=True,
    ),
    Finding(
        id="F-26",
        claim="Minimum time to collision does not separate configurations; time below 1.5 s does.",
        estimand="configuration 3 minus 4: time below 1.5 s, and change of the minimum",
        needs="configurations 3 and 4",
        test=f"{SIGNS}; equivalence of the minimum by two one-sided tests",
        margin=f"{SECONDS:g} s per run, {TTC:g} s",
        contrasts=f26,
    ),
)
