"""Judges the envelope's estimate of grip and prints the tables of docs/envelope.md.

`python tools/envelope_grip.py [--seeds N] [--out FILE]`: each drive is made once per law of slip stiffness
and tyre, and judged under three stiffnesses of the estimator's design. Seeds from 9101 were not tuned on.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from itertools import product
from math import inf, isfinite
from pathlib import Path

import numpy as np
import polars as pl

from grip_judging import Estimates, estimate_again, judge_estimates, keep_signals
from skidpad.core.courses import Roads
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.run import RunSpec
from skidpad.core.settings.parts import load_profile
from skidpad.core.vocabulary import Govern, SensorLevel
from skidpad.evidence.statistics import poisson_interval
from skidpad.physics.presets import find_weather
from skidpad.stack.configurations import numbered_driver

PLACES = (("figure8", "winter"), ("motorway", "summer"))  # maps and tyres
WEATHERS = ("clear-noon", "rain-noon", "snow", "icy_100")
LAWS = {"no law": False, "falls with the surface": True}
SHARES = (0.7, 1.0, 1.3)
FIRST_SEED, DURATION = 9101, 60.0
ICE = 0.13  # share of the friction that a patch leaves: ice under a dry sky
PATCHES = (150.0, 60.0)  # m from one patch to the next, and their length


def patches_on(map_name: str) -> tuple[SurfacePatch, ...]:
    """Returns patches of ice along every road of a map."""
    from skidpad.roads.bundled import load_map

    lanes = load_map(map_name).lanes
    longest: dict[int, float] = {}
    for road, length in zip(lanes.road.tolist(), lanes.length.tolist(), strict=True):
        longest[road] = max(longest.get(road, 0.0), length)
    every, length = PATCHES
    return tuple(
        SurfacePatch(friction=ICE, road=road, s=(s, s + length))
        for road, end in longest.items()
        for s in np.arange(every, end - length, every + length).tolist()
    )


def drives(seeds: int) -> Iterator[tuple[str, str, str, Estimates]]:
    """Yields law, surface, design stiffness and estimates of every drive."""
    cells = [(w, w, ()) for w in WEATHERS]
    for (map_name, tyres), (law, changes) in product(PLACES, LAWS.items()):
        here = [*cells, ("patches of ice", "clear-noon", patches_on(map_name))]
        for (name, weather, surface), seed in product(here, range(seeds)):
            settings = load_profile("recommended", {"tyre_stiffness": changes, "tyres": tyres})
            spec = RunSpec(
                driver=numbered_driver(3), course=Roads(map=map_name), seed=FIRST_SEED + seed,
                weather=find_weather(weather), duration=DURATION, settings=settings,
                sensors=SensorLevel.OBJECTS, govern=Govern.TABLE, surface=surface,
            )  # fmt: skip
            kept = keep_signals(spec)
            for share in SHARES:
                best = law == "no law" and share == 1.0 and tyres == "winter"
                label = "best case" if best else f"{law}, x{share:g}"
                yield label, name, map_name, estimate_again(kept, share, spec.seed)


def poisson(count: int, hours: float) -> str:
    """Returns a rate per hour with its exact 95 % interval."""
    found = poisson_interval(count, hours)
    return f"{count / hours:.1f} ({found.low:.1f} to {found.high:.1f})"


def main() -> None:
    """Drives, judges and prints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--out", type=Path)
    args = parser.parse_args()
    found: dict[tuple[str, str], list[Estimates]] = {}
    for label, surface, _, estimates in drives(args.seeds):
        found.setdefault((label, surface), []).append(estimates)
    print(
        "| stiffness of the tyre, design | surface | error of the value: 5, 50, 95 % | on the prior alone | "
        "more than 1.3 times too high | false alarms per hour (95 %) | falls noticed within 1 s, of | "
        "time to notice, median |\n|---|---|---|---|---|---|---|---|"
    )
    rows = []
    for (label, surface), made in sorted(found.items()):
        j = judge_estimates(made)
        error = "no information" if j.error is None else ", ".join(f"{e:+.0%}" for e in j.error)
        within = sum(s <= 1.0 for s in j.notice)
        middle = float(np.median(j.notice)) if j.notice else inf
        noticed = f"{within} of {len(j.notice)}" if j.notice else "-"
        median = f"{middle:.1f} s" if isfinite(middle) else ("never" if j.notice else "-")
        print(
            f"| {label} | {surface} | {error} | {j.prior_share:.0%} | {j.too_high:.0%} | "
            f"{poisson(j.alarms, j.hours)} | {noticed} | {median} |"
        )
        low, half, high = j.error or (None, None, None)
        rows.append(
            {"law": label, "surface": surface, "error_5": low, "error_50": half, "error_95": high,
             "prior_share": j.prior_share, "too_high": j.too_high, "alarms": j.alarms,
             "hours": j.hours, "falls": len(j.notice), "within_1_s": within}
        )  # fmt: skip
    if args.out:
        args.out.parent.mkdir(parents=True, exist_ok=True)
        pl.DataFrame(rows).write_csv(args.out)


if __name__ == "__main__":
    main()
