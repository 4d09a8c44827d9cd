"""False alarms and power of the gate of `skidpad compare`: the tables of docs/statistics.md.

`python tools/gate_table.py docs/statistics.md` writes them: from simulated counts, and from comparisons
that are drawn without replacement from the seeds of docs/results/gate-pool (`--pool`: of another campaign).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import polars as pl
from scipy import stats

from coverage_table import Floats, counts_of, write_block
from result_tables import ROOT
from result_texts import markdown
from skidpad.core.maths.randomness import stream
from skidpad.evidence.compare import ALPHA, seeds_to_fire
from skidpad.evidence.statistics import holm, sign_tests

TRIALS = 2000
POOL = ROOT / "docs" / "results" / "gate-pool"
SEEDS = (10, 20, 50, 100)
MEAN, DISPERSION = 1.0, 3.0
COLUMNS = 6  # judged together
WEATHERS = 6
SHARED = 0.8  # of a count: what all weathers of a seed have in common
JUDGED = (
    "fatal_collisions",
    "crashes_vehicle",
    "road_departures",
    "lane_invasions",
    "ttc_below_1_5_s",
    "mean_speed_kmh",
)

DOUBLED = {"fatal_collisions": "interventions", "lane_invasions": "solid markings crossed"}


def share_fired(differences: Floats) -> float:
    """Share of trials in which any column fires. differences: (trials, columns, seeds)."""
    trials, columns, n = differences.shape
    if n < seeds_to_fire(columns):
        return 0.0
    p = sign_tests(differences.reshape(-1, n), mid=True)[0].reshape(trials, columns)
    return float(np.mean([min(holm(row.tolist())) <= ALPHA for row in p]))


def drawn(name: str, mean: float, n: int, columns: int, weathers: int, trials: int) -> Floats:
    """Means over weathers of counts of runs (trials, columns, n); a seed's weathers are alike in part."""
    rng = stream(34, "gate", n, f"{name} {mean} {columns} {weathers}")
    shape = (trials * columns, n)
    shared = counts_of(SHARED * mean, DISPERSION)(rng, shape)
    own = counts_of((1.0 - SHARED) * mean, DISPERSION)
    runs = shared + sum(own(rng, shape) for _ in range(weathers)) / weathers
    return runs.reshape(trials, columns, n)


def false_alarms(n: int, columns: int, weathers: int, trials: int) -> float:
    """Of identical stacks on other seeds."""
    return share_fired(
        drawn("after", MEAN, n, columns, weathers, trials)
        - drawn("before", MEAN, n, columns, weathers, trials)
    )


def power(n: int, columns: int, trials: int, dispersion: float) -> float:
    """Share of trials in which the one column whose rate is doubled fires, among others that are not."""
    rng = stream(34, "power", n, f"{columns} {dispersion}")
    before = counts_of(MEAN, dispersion)(rng, (trials * columns, n)).reshape(trials, columns, n)
    after = counts_of(MEAN, dispersion)(rng, (trials * columns, n)).reshape(trials, columns, n)
    after[:, 0] = counts_of(2.0 * MEAN, dispersion)(rng, (trials, n))
    p = sign_tests((after - before).reshape(-1, n), mid=True)[0].reshape(trials, columns)
    return float(np.mean([holm(row.tolist())[0] <= ALPHA for row in p]))


def exact_power(n: int, trials: int) -> float:
    """Of the exact test of two Poisson rates, which knows that counts are Poisson."""
    rng = stream(34, "exact power", n)
    before = rng.poisson(MEAN * n, trials)
    after = rng.poisson(2.0 * MEAN * n, trials)
    p = stats.binom.sf(after - 1, before + after, 0.5)
    return float(np.mean(p <= ALPHA))


def tables(trials: int) -> str:
    """False alarms and power by seeds, in percent."""
    head = ("", *(f"{n} seeds" for n in SEEDS))
    alarms = [
        [f"{columns} judged column{'s' * (columns > 1)}, {weathers} weather{'s' * (weathers > 1)}",
         *(_percent(false_alarms(n, columns, weathers, trials)) for n in SEEDS)]
        for columns in (1, COLUMNS) for weathers in (1, WEATHERS)
    ]  # fmt: skip
    found = [
        ["1 judged column, Poisson counts", *(_percent(power(n, 1, trials, 1.0)) for n in SEEDS)],
        ["the exact test of two Poisson rates", *(_percent(exact_power(n, trials)) for n in SEEDS)],
        [f"1 judged column, variance/mean {DISPERSION:g}",
         *(_percent(power(n, 1, trials, DISPERSION)) for n in SEEDS)],
        [f"{COLUMNS} judged columns, variance/mean {DISPERSION:g}",
         *(_percent(power(n, COLUMNS, trials, DISPERSION)) for n in SEEDS)],
    ]  # fmt: skip
    return (
        f"Comparisons of identical stacks in which any column is red, in % of {trials}; up to "
        f"{_band(trials):.1f} is within the binomial band of 5 %.\n\n{markdown(head, alarms)}\n"
        f"Comparisons that find a rate doubled from {MEAN:g} per run, in %.\n\n{markdown(head, found)}"
    )


def _band(trials: int) -> float:
    """The largest share within the binomial band of 5 %, in percent."""
    return float(100.0 * (ALPHA + 2.0 * (ALPHA * (1.0 - ALPHA) / trials) ** 0.5))


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f}"


def seed_values(rows: pl.DataFrame) -> Floats:
    """Means over the weathers of each seed (columns, seeds); of seeds that were driven in all of them."""
    seeds = rows.group_by("seed").agg(pl.col(*JUDGED).cast(pl.Float64).mean(), driven=pl.len())
    seeds = seeds.filter(pl.col("driven") == pl.col("driven").max()).drop_nulls().sort("seed")
    return np.asarray(seeds.select(JUDGED).to_numpy().T, np.float64)


def picked(values: Floats, n: int, groups: int, trials: int) -> Floats:
    """Groups of n seeds each, drawn without replacement (groups, trials, columns, n)."""
    rng = stream(34, "pool", n, f"{groups}")
    picks = np.stack([rng.permutation(values.shape[1])[: groups * n] for _ in range(trials)])
    return np.moveaxis(values[:, picks.reshape(trials, groups, n)], (2, 1), (0, 1))


def pool_alarms(values: Floats, n: int, trials: int) -> float:
    """False alarms of n seeds against n others of one pool."""
    before, after = picked(values, n, 2, trials)
    return share_fired(after - before)


def pool_power(values: Floats, column: str, n: int, trials: int) -> float:
    """Share of trials that find the counts of two seeds more than those of one, as the only column."""
    one = values[[JUDGED.index(column)]]
    before, after, more = picked(one, n, 3, trials)
    return share_fired(after + more - before)


def pool_tables(table: pl.DataFrame, trials: int) -> str:
    """False alarms and power of comparisons drawn from a pool that was driven, in percent."""
    weathers = table["weather"].unique(maintain_order=True).to_list()
    pools = {w: seed_values(table.filter(pl.col("weather") == w)) for w in weathers}
    pools[f"all {len(weathers)} weathers"] = whole = seed_values(table)
    seeds = whole.shape[1]
    head = ("", *(f"{n} seeds" for n in SEEDS))
    alarms = [
        [name, *(_percent(pool_alarms(values, n, trials)) for n in SEEDS)]
        for name, values in pools.items()
    ]
    found = [
        [f"{DOUBLED[column]}, {_mean_text(whole, column)} per run",
         *(_percent(pool_power(whole, column, n, trials)) if 3 * n <= seeds else "" for n in SEEDS)]
        for column in DOUBLED
    ]  # fmt: skip
    return (
        f"Comparisons of one stack with itself on other seeds, drawn without replacement from {seeds} "
        f"driven seeds per weather; {len(JUDGED)} judged columns, in % of {trials} in which any is red; up "
        f"to {_band(trials):.1f} is within the binomial band of 5 %.\n\n{markdown(head, alarms)}\n"
        f"Comparisons that find a doubled rate, as the only judged column in all {len(weathers)} weathers, "
        "in %. The counts of another seed are added to those of each; empty: the pool has too few "
        f"seeds.\n\n{markdown(head, found)}"
    )


def _mean_text(values: Floats, column: str) -> str:
    return f"{values[JUDGED.index(column)].mean():.2f}"


def main() -> None:
    """Print the tables, or put them into a page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", nargs="?", type=Path)
    parser.add_argument("--trials", type=int, default=TRIALS)
    parser.add_argument("--pool", type=Path, default=POOL, help="folder of a campaign's results")
    options = parser.parse_args()
    pool = pl.read_parquet(options.pool / "results.parquet")
    for name, text in (
        ("gate", tables(options.trials)),
        ("gate pool", pool_tables(pool, options.trials)),
    ):
        if options.page is None:
            print(text)
        else:
            write_block(options.page, name, text)


if __name__ == "__main__":
    main()
