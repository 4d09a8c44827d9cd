"""Contrasts from results tables: pairs that agree in their factors, and what is compared."""

from __future__ import annotations

from collections.abc import Sequence

import polars as pl

from skidpad.core.vocabulary import Outcome
from skidpad.evidence.verdicts import Contrast, paired

NOT_RUN = frozenset(  # leave every denominator (L-7)
    {Outcome.AGENT_ERROR.value, Outcome.CRASHED.value, Outcome.TIMEOUT.value}
)


def differences(
    table: pl.DataFrame, more: pl.Expr, less: pl.Expr, by: Sequence[str], column: str
) -> tuple[pl.Series, bool]:
    """Differences of `column` between the rows of `more` and of `less` that agree in `by`.

    Several rows of one side that agree are averaged. Also whether all pairs are equal drives.
    """
    if "outcome" in table.columns:
        table = table.filter(~pl.col("outcome").is_in(NOT_RUN))
    keys = [k for k in by if k in table.columns]
    hashes = pl.col("log_hash").sort() if "log_hash" in table.columns else pl.lit(None)
    wanted = [pl.col(column).cast(pl.Float64).mean().alias("value"), hashes.alias("hashes")]
    sides = [table.filter(side).group_by(keys).agg(wanted) for side in (more, less)]
    both = sides[0].join(sides[1], on=keys, suffix="_less").drop_nulls(["value", "value_less"])
    both = both.sort(keys)
    known = "log_hash" in table.columns and not table["log_hash"].has_nulls()
    same = known and len(both) > 0 and bool((both["hashes"] == both["hashes_less"]).all())
    return both["value"] - both["value_less"], same


def contrast(
    table: pl.DataFrame,
    label: str,
    column: str,
    more: pl.Expr,
    less: pl.Expr,
    by: Sequence[str],
    margin: float,
) -> list[Contrast]:
    """One contrast, or none when there are no pairs."""
    values, same = differences(table, more, less, by, column)
    return [paired(label, values.to_numpy(), margin, same)] if len(values) else []


def complete(parts: Sequence[list[Contrast]]) -> list[Contrast]:
    """All contrasts, or none when one of them has no runs: a claim is judged whole."""
    return [c for part in parts for c in part] if all(parts) else []
