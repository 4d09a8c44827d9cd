"""What moved between the results of a campaign that lie in docs/results and those of driving it again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import polars as pl

from skidpad.core.text.wording import count_text

APART = ("outcome", "version", "log_hash", "motion_hash", "fingerprint")  # columns that name no run
MEASURED = "outcome"  # the first column that a run had; those before it say which run it is
SHOWN = 12  # columns, those that moved most


def read_rows(path: Path) -> pl.DataFrame:
    """The rows of a campaign: results.parquet of a folder, or a file of a study."""
    if path.is_dir():
        parquet, rows = path / "results.parquet", path / "rows.csv"
        path = parquet if parquet.is_file() else rows
    if path.suffix == ".parquet":
        return pl.read_parquet(path)
    return pl.read_csv(path, infer_schema_length=None)


def what_moved(before: pl.DataFrame, after: pl.DataFrame) -> list[str]:
    """Lines for people: rows that are new or gone, rows whose numbers moved, and columns by their means."""
    named = before.columns[: before.columns.index(MEASURED)]
    keys = [k for k in named if k in after.columns]
    numbers = [
        c
        for c, kind in before.schema.items()
        if c not in (*keys, *APART) and kind.is_numeric() and c in after.columns
    ]
    plain = [
        t.with_columns(pl.col(keys).cast(pl.String), pl.col(numbers).cast(pl.Float64)).unique(
            keys, keep="first", maintain_order=True
        )
        for t in (before, after)
    ]
    both = plain[0].join(plain[1].select(*keys, *numbers), on=keys, suffix=" now")
    moved = {c: ~pl.col(c).eq_missing(pl.col(f"{c} now")) for c in numbers}
    other = both.filter(pl.any_horizontal(*moved.values())) if moved else both.head(0)
    gone, new = (len(t) - len(both) for t in plain)
    rows = count_text(len(both), "row")
    first = f"{len(other)} of {rows} moved; {gone} gone, {new} new"
    return [first, *_columns(both, numbers)]


def _columns(both: pl.DataFrame, numbers: Sequence[str]) -> list[str]:
    """Means before and after, of the columns that moved most for their size."""
    changes: list[tuple[float, str, float | None, float | None]] = []
    for column in numbers:
        means = [both[name].drop_nans().mean() for name in (column, f"{column} now")]
        old, new = (None if m is None else float(m) for m in means)  # type: ignore[arg-type]
        if old != new and old is not None and new is not None:
            changes.append((abs(new - old) / max(abs(old), 1e-9), column, old, new))
        elif (old is None) != (new is None):
            changes.append((float("inf"), column, old, new))
    most = sorted(changes, key=lambda c: (-c[0], c[1]))[:SHOWN]
    rest = len(changes) - len(most)
    lines = [f"  {column}: {_mean(old)} -> {_mean(new)}" for _, column, old, new in most]
    return lines + ([f"  and {count_text(rest, 'column')} more"] if rest else [])


def _mean(value: float | None) -> str:
    return "none" if value is None else f"{value:.4g}"
