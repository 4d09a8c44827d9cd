"""How far must be driven for the envelope's proof: `python tools/envelope_power.py` prints the tables.

Events are contacts above 5 km/h and departures. Two drivers go the same distance; their counts are Poisson.
The factor's lower bound is the exact one-sided one, given the sum of the counts (Clopper and Pearson).
"""

from __future__ import annotations

from itertools import product

import numpy as np
from scipy import stats

GOAL, LEAST = 10.0, 3.0  # times fewer events: aimed at, and excluded from below
LEVEL, POWER = 0.05, 0.8  # one-sided; chance to show it where it is so
ENOUGH = 30  # events of the bare stack, below which no factor is printed
ROUTES = 30.0  # km: ten seeds of a route of 3 km
STEPS = np.geomspace(20.0, 20_000.0, 61)  # km


def factor_bound(bare: int, governed: int) -> float:
    """Returns the one-sided 95 % lower bound of the ratio of two rates over equal distances."""
    if bare == 0:
        return 0.0
    share = float(stats.beta.ppf(LEVEL, bare, governed + 1))
    return share / (1.0 - share)


def chance_to_show(rate: float, km: float, factor: float, least: float) -> float:
    """Returns the chance that the bound is at least `least`; rate: events per 100 km of the bare one."""
    mean = rate * km / 100.0
    most = int(mean + 6.0 * mean**0.5 + 10.0)
    bare = stats.poisson.pmf(np.arange(most), mean)
    few = int(mean / factor + 6.0 * (mean / factor) ** 0.5 + 10.0)
    governed = stats.poisson.pmf(np.arange(few), mean / factor)
    pairs = product(range(most), range(few))
    likely = ((x, y) for x, y in pairs if bare[x] * governed[y] > 1e-9)
    return float(sum(bare[x] * governed[y] for x, y in likely if factor_bound(x, y) >= least))


def needed_km(rate: float, factor: float, least: float) -> float | None:
    """Returns the shortest of the tried distances with enough power; None: more than the longest."""
    for km in STEPS:
        if rate * km / 100.0 < 400.0 and chance_to_show(rate, float(km), factor, least) >= POWER:
            return float(km)
    return None


def table() -> str:
    """Returns the table of docs/envelope-proof.md."""
    text = (
        "| events of the bare stack per 100 km | km for 30 events | km to show 3 times fewer, if it is "
        "10 times | km to show fewer at all, if it is 2 times |\n|---|---|---|---|\n"
    )
    for rate in (2.0, 5.0, 12.0, 30.0):
        found = [needed_km(rate, GOAL, LEAST), needed_km(rate, 2.0, 1.0)]
        cells = ["more than 20 000" if km is None else f"{km:.0f}" for km in found]
        text += f"| {rate:.0f} | {100.0 * ENOUGH / rate:.0f} | {cells[0]} | {cells[1]} |\n"
    return text


def routes_table() -> str:
    """Returns the chances of the routes with an end: ROUTES km, by events and by how much it is better."""
    text = (
        f"| in {ROUTES:.0f} km, events of the bare stack per 100 km | bound of 3, if 10 times | "
        "bound of 3, if 8 times | fewer at all, if 4 times |\n|---|---|---|---|\n"
    )
    for rate in (30.0, 50.0, 100.0, 200.0, 400.0):
        chances = [
            chance_to_show(rate, ROUTES, better, least)
            for better, least in ((GOAL, LEAST), (8, LEAST), (4, 1))
        ]
        text += f"| {rate:.0f} | " + " | ".join(f"{100.0 * c:.0f} %" for c in chances) + " |\n"
    return text


if __name__ == "__main__":
    print(table(), routes_table(), sep="\n", end="")
