"""False alarms and power of the gate of `skidpad compare`: the tables of docs/statistics.md.

`python tools/gate_table.py docs/statistics.md` writes them, from simulated counts. `--pool CAMPAIGN`
draws null comparisons without replacement from a campaign that was driven, and prints their share of
false alarms: its seeds are split into two groups of each size that fits.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import polars as pl
from scipy import stats

from coverage_table import Floats, counts_of, write_block
from result_texts import markdown
from skidpad.core.randomness import stream
from skidpad.evidence.compare import ALPHA, seeds_to_fire
from skidpad.evidence.statistics import holm, sign_tests

TRIALS = 2000
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
    band = 100.0 * (ALPHA + 2.0 * (ALPHA * (1.0 - ALPHA) / trials) ** 0.5)
    return (
        f"Comparisons of identical stacks in which any column is red, in % of {trials}; up to "
        f"{band:.1f} is within the binomial band of 5 %.\n\n{markdown(head, alarms)}\n"
        f"Comparisons that find a rate doubled from {MEAN:g} per run, in %.\n\n{markdown(head, found)}"
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f}"


def pool_alarms(table: pl.DataFrame, n: int, trials: int) -> float:
    """False alarms of n seeds against n others of one campaign, drawn without replacement."""
    seeds = table.group_by("seed").agg(pl.col(*JUDGED).cast(pl.Float64).mean()).drop_nulls()
    values = seeds.sort("seed").select(JUDGED).to_numpy().T
    rng = stream(34, "pool", n)
    picks = [rng.permutation(values.shape[1])[: 2 * n] for _ in range(trials)]
    return share_fired(np.stack([values[:, p[:n]] - values[:, p[n:]] for p in picks]))


def main() -> None:
    """Print the tables, put them into a page, or try a pool."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("page", nargs="?", type=Path)
    parser.add_argument("--trials", type=int, default=TRIALS)
    parser.add_argument("--pool", type=Path)
    options = parser.parse_args()
    if options.pool is not None:
        table = pl.read_parquet(options.pool / "results.parquet")
        for (config, *weather), rows in [
            *table.group_by("config", "weather", maintain_order=True),
            *table.group_by("config", maintain_order=True),
        ]:
            where = weather[0] if weather else "all weathers"
            for n in SEEDS:
                if 2 * n <= rows["seed"].n_unique():
                    share = pool_alarms(rows, n, options.trials)
                    print(f"{config}, {where}, {n} against {n}: {_percent(share)} %")
        return
    text = tables(options.trials)
    if options.page is None:
        print(text)
    else:
        write_block(options.page, "gate", text)


if __name__ == "__main__":
    main()
