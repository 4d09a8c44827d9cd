"""The acceptance checks printed in the sources, as findings with verdicts (A-276 to A-278, X-6).

They say what the published runs showed. Whether ours show it, too, is computed, never assumed.
"""

from __future__ import annotations

import polars as pl

from skidpad.evidence.contrasts import Amount, Never, drive_hash
from skidpad.evidence.drive.sides import INVASIONS, POINT, config, configs, variants
from skidpad.evidence.rates import RateBelow
from skidpad.evidence.verdicts import Finding

INVASIONS_MAX = Amount(2.0, "markings per run")  # in configurations 2 to 4


def broken_cells(table: pl.DataFrame) -> tuple[int, int]:
    """Returns cells of configuration 0 without or of 4 with a collision, and all cells of both.

    A cell whose every drive moved as in another weather is that cell again, and counts once (T-3).
    (0, 0) where one of the configurations is missing.
    """
    cells = (
        table.with_columns(drive=drive_hash(table))
        .group_by("config", "weather", maintain_order=True)
        .agg(pl.col("fatal_collisions").sum(), pl.struct("seed", "drive").alias("drive"))
    )
    cells = cells.filter(pl.Series(_are_new(cells), dtype=pl.Boolean))
    judged = cells.filter(pl.col("config").is_in(["0", "4"]))
    if judged["config"].n_unique() < 2:
        return 0, 0
    without = pl.col("fatal_collisions") == 0
    broken = (config("0").are & without) | (config("4").are & ~without)
    return len(judged.filter(broken)), len(judged)


def _are_new(cells: pl.DataFrame) -> list[bool]:
    """Returns whether each cell has a drive that no other cell of its configuration has; the larger stays."""
    drives = [{(d["seed"], d["drive"]) for d in row} for row in cells["drive"].to_list()]
    configs, order = cells["config"].to_list(), range(len(cells))

    def contains(k: int, other: int) -> bool:
        """Returns whether cell `k` stands within cell `other`, of two equal ones the later."""
        known = configs[k] == configs[other] and None not in {drive for _, drive in drives[k]}
        return known and (drives[k] < drives[other] or (drives[k] == drives[other] and other < k))

    return [not any(contains(k, other) for other in order if other != k) for k in order]


ACCEPTANCE: tuple[Finding, ...] = (
    Finding(
        "A-276",
        "Without assistance the car collides in every weather; with the full package in none.",
        "cells of configurations 0 and 4 for which this does not hold",
        "configurations 0 and 4",
        (Never("cells that break it over all seeds", broken_cells),),
    ),
    Finding(
        "A-277",
        "ACC alone crosses the most lane markings; configurations 2 to 4 at most two per run.",
        "solid markings crossed per run",
        "all configurations",
        (
            *(configs("lane_invasions", "1", c, INVASIONS) for c in ("0", "2", "3", "4")),
            *(
                RateBelow(
                    what=f"solid markings crossed in configuration {c}",
                    events=pl.col("lane_invasions").sum(),
                    limit=INVASIONS_MAX,
                    where=config(c).are,
                )
                for c in ("2", "3", "4")
            ),
        ),
    ),
    Finding(
        "A-278",
        "The preliminary script has fewer radar false positives and more misses.",
        "radar false positives and radar false negatives, final against preliminary profile",
        "its own study: both profiles",
        (
            variants("radar_fpr_pct", "final", "preliminary", POINT),
            variants("radar_fnr_pct", "preliminary", "final", POINT),
        ),
        study=True,
    ),
)
