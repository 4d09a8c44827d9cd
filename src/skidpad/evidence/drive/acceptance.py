"""The acceptance checks printed in the sources, as findings with verdicts (A-276 to A-278, X-6).

They say what the published runs showed. Whether ours show it, too, is computed, never assumed.
"""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import NOT_RUN, complete
from skidpad.evidence.drive.findings import (
    INVASIONS,
    POINTS,
    SIGNS,
    config,
    configs_differ,
    rate_zero,
    variants_differ,
)
from skidpad.evidence.verdicts import Contrast, Finding, rate_below

INVASIONS_MAX = 2.0  # per run, in configurations 2 to 4


def a276(table: pl.DataFrame) -> list[Contrast]:
    """Cells that break the check: configuration 0 without, or 4 with a collision."""
    runs = table.filter(~pl.col("outcome").is_in(NOT_RUN))
    cells = runs.group_by("config", "weather").agg(pl.col("fatal_collisions").sum())
    without = cells.filter(config("0") & (pl.col("fatal_collisions") == 0))
    with_some = cells.filter(config("4") & (pl.col("fatal_collisions") > 0))
    judged = cells.filter(pl.col("config").is_in(["0", "4"]))
    if judged["config"].n_unique() < 2:
        return []
    broken = len(without) + len(with_some)
    return [rate_zero("0.5 minus the cells that break the check", broken, len(judged))]


def a277(table: pl.DataFrame) -> list[Contrast]:
    """Configuration 1 against each other one, and the rates of 2 to 4."""
    parts = [
        configs_differ(table, "lane_invasions", "1", c, INVASIONS) for c in ("0", "2", "3", "4")
    ]
    for c in ("2", "3", "4"):
        runs = table.filter(config(c) & ~pl.col("outcome").is_in(NOT_RUN))
        crossed = int(runs["lane_invasions"].sum())
        label = f"{INVASIONS_MAX:g} minus solid markings crossed per run, configuration {c}"
        parts.append([rate_below(label, crossed, len(runs), INVASIONS_MAX)] if len(runs) else [])
    return complete(parts)


def a278(table: pl.DataFrame) -> list[Contrast]:
    """Columns variant (preliminary, final), seed, radar_fpr_pct, radar_fnr_pct."""
    return complete(
        [
            variants_differ(table, "radar_fpr_pct", "final", "preliminary", POINTS),
            variants_differ(table, "radar_fnr_pct", "preliminary", "final", POINTS),
        ]
    )


ACCEPTANCE: tuple[Finding, ...] = (
    Finding(
        id="A-276",
        claim="Without assistance the car collides in every weather; with the full package in none.",
        estimand="cells of configurations 0 and 4 for which this does not hold",
        needs="configurations 0 and 4",
        test="counting cells over all seeds; one that breaks it contradicts",
        margin="none",
        contrasts=a276,
    ),
    Finding(
        id="A-277",
        claim="ACC alone crosses the most lane markings; configurations 2 to 4 at most two per run.",
        estimand="solid markings crossed per run",
        needs="all configurations",
        test=f"{SIGNS}; exact Poisson against two per run",
        margin=f"{INVASIONS:g} per run",
        contrasts=a277,
    ),
    Finding(
        id="A-278",
        claim="The preliminary script has fewer radar false positives and more misses.",
        estimand="false positive and false negative rate, final against preliminary profile",
        needs="its own study: both profiles",
        test="paired by seed; sign changes",
        margin=f"{POINTS:g} percentage point",
        contrasts=a278,
        study=True,
    ),
)
