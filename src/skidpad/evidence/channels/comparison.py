"""Two monitored drives beside each other, paired by cycle (C-17)."""

from __future__ import annotations

from collections.abc import Iterator

import polars as pl

from skidpad.core.errors import InputError
from skidpad.evidence.statistics import ratio_limits
from skidpad.evidence.statistics_text import interval_text

BLOCK = 100  # cycles that are resampled together, since neighbours are not independent


def compare_drives(a: pl.DataFrame, b: pl.DataFrame) -> Iterator[str]:
    """Yields a line per indicator and subject: mean of b less a over common cycles, and violations of each.

    a, b: tables of indicators of two drives. The interval is over blocks of BLOCK cycles. Raises
    InputError, when first asked for a line, if the tables have nothing in common.
    """
    keys = ["cycle", "indicator", "subject"]
    both = a.join(b, on=keys, suffix="_b", maintain_order="left")
    if both.is_empty():
        raise InputError("the two drives have no cycle, indicator and subject in common")
    for (indicator, subject), rows in both.group_by("indicator", "subject", maintain_order=True):
        known = rows.filter(pl.col("evaluated") & pl.col("evaluated_b"))
        label = f"{indicator} ({subject})"
        if known.is_empty():
            yield f"{label}: never evaluated in both"
            continue
        blocks = known.group_by(pl.col("cycle") // BLOCK, maintain_order=True).agg(
            d=(pl.col("value_b") - pl.col("value")).sum(), n=pl.len()
        )
        d, n = blocks["d"].to_numpy(), blocks["n"].to_numpy()
        mean = d.sum() / n.sum()
        yield (
            f"{label}: {mean:+.4f} {interval_text(ratio_limits(d, n), len(d), 'block')} over {len(known)} "
            f"cycles; violated in {known['violated'].sum()} and {known['violated_b'].sum()}"
        )
