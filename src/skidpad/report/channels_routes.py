"""What each route came to: violations of indicators and the monitor's times (C-215, C-233)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import polars as pl

from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.report.page import Block, Cell, words
from skidpad.report.published import Source, published
from skidpad.report.tables import Column, Format, table

Row = dict[str, Any]
PREFIX, MEAN = "violations_", "_mean_ms"
ALL = "all routes"
MS = Format(".3f", absent="not measured")


def route_blocks(evaluation: Mapping[str, Any]) -> list[Block]:
    """Violations and times per route; nothing of what was not evaluated."""
    segments = pl.DataFrame(evaluation["segment_table"], infer_schema_length=None)
    if "route" not in segments.columns or not len(segments):
        return []
    return [*_violations(segments), *_times(segments)]


def _violations(segments: pl.DataFrame) -> list[Block]:
    """Events beyond the threshold per route and indicator with totals, ours then the published."""
    names = [i.value for i in Indicator if PREFIX + i.value in segments.columns]
    if not names:
        return []
    sums = [pl.col("hours").sum(), *(pl.col(PREFIX + n).sum().cast(pl.Int64) for n in names)]
    rows = segments.group_by("route").agg(sums).sort("route").to_dicts()
    rows.append({"route": ALL} | segments.select(sums).row(0, named=True))
    rows += [row | {"kind": "published"} for row in _town_rows()]

    def cell(row: Row, text: str, sort: float | None = None, hint: str = "") -> Cell:
        return Cell(text, sort=sort, kind=row.get("kind", ""), hint=hint)

    def count(name: str, row: Row) -> Cell:
        value = row.get(PREFIX + name)
        if value is None:
            return cell(row, "")
        return cell(row, f"{value}", float(value), row.get("causes", {}).get(name, ""))

    def total(row: Row) -> Cell:
        value = sum(row.get(PREFIX + n) or 0 for n in names)
        return cell(row, f"{value}", float(value))

    def hours(row: Row) -> Cell:
        known = row.get("hours")
        return cell(row, "" if known is None else f"{known:.2f}", known)

    columns: list[Column[Row]] = [
        Column("route", lambda row: cell(row, row["route"])),
        Column("h", hours),
        *(
            Column(words(n), partial(count, n), "events: repeats within 2 s count once")
            for n in names
        ),
        Column("total", total),
    ]
    note = (
        "Published towns in italics: 8 h over six towns, another simulator and other channels; the "
        "cause that the source gives stands behind each of its numbers (hover), and in the table below."
    )
    return [
        table(columns, rows, "Indicators beyond their threshold, per route", note),
        *_cause_table(names),
    ]


def _town_rows() -> list[Row]:
    """Rows of the published towns."""
    towns: dict[int, Row] = {}
    for r in published(Source.VIOLATIONS_BY_TOWN).to_dicts():
        row = towns.setdefault(r["town"], {"route": f"town {r['town']}", "causes": {}})
        row[PREFIX + r["spi"]] = r["threshold_violations"]
        row["causes"][r["spi"]] = r["cause"] or ""
    return list(towns.values())


def _cause_table(names: list[str]) -> list[Block]:
    """Which causes the source gives, with their violations over all towns."""
    known = published(Source.VIOLATIONS_BY_TOWN).drop_nulls("cause")
    known = known.filter(pl.col("spi").is_in(names))
    rows = (
        known.group_by("cause", "spi")
        .agg(pl.col("threshold_violations").sum(), pl.col("town").sort().cast(pl.String))
        .sort("threshold_violations", "cause", "spi", descending=[True, False, False])
        .to_dicts()
    )
    columns: list[Column[Row]] = [
        Column("indicator", lambda r: words(r["spi"])),
        Column("cause", lambda r: r["cause"]),
        Column("violations", lambda r: float(r["threshold_violations"])),
        Column("towns", lambda r: ", ".join(r["town"])),
    ]
    return [table(columns, rows, "Published causes of violations")] if rows else []


def _times(segments: pl.DataFrame) -> list[Block]:
    """Mean processor time of every module per route, with the tail and the greatest of the total."""
    modules = [
        c.removesuffix(MEAN)
        for c, kind in segments.schema.items()
        if c.endswith(MEAN) and kind.is_numeric()
    ]
    if "total" not in modules:
        return []
    modules.sort(key=lambda m: (m == "total", m))
    known = segments.drop_nulls("total_mean_ms")

    def weighted_mean(module: str) -> pl.Expr:
        return (pl.col(module + MEAN) * pl.col("hours")).sum() / pl.col("hours").sum()

    figures = [
        *(weighted_mean(m).alias(m) for m in modules),
        pl.col("total_p999_ms").max(),
        pl.col("total_max_ms").max(),
    ]
    rows = known.group_by("route").agg(figures).sort("route").to_dicts()
    if rows:
        rows.append({"route": ALL} | known.select(figures).row(0, named=True))
    columns: list[Column[Row]] = [
        Column("route", lambda row: row["route"]),
        *(Column(words(m), partial(_value, m), "mean per cycle", "ms", MS) for m in modules),
        Column("99.9 % of total", partial(_value, "total_p999_ms"), "worst drive", "ms", MS),
        Column("greatest total", partial(_value, "total_max_ms"), "", "ms", MS),
    ]
    note = "Means weighted by hours. The total has a budget of 25 ms per cycle."
    return (
        [table(columns, rows, "The monitor's processor time per cycle, per route", note)]
        if rows
        else []
    )


def _value(name: str, row: Row) -> float | None:
    return row[name]  # type: ignore[no-any-return]
