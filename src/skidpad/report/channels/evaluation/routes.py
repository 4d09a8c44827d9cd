"""What each route came to: violations of indicators and the monitor's times (C-215, C-233)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np
import polars as pl

from skidpad.evidence.channels.indicators.catalogue import Indicator
from skidpad.evidence.channels.judging.facts import CAUSE_PREFIX, ViolationCause
from skidpad.report.elements.page import Block, Cell, words
from skidpad.report.elements.tables import Column, Format, table
from skidpad.report.published import Source, read_published

Row = dict[str, Any]
PREFIX, MEAN = "violations_", "_mean_ms"
ALL = "all routes"
MS = Format(".3f", absent="not measured")


def route_blocks(evaluation: Mapping[str, Any]) -> list[Block]:
    """Returns tables of violations and times per route; empty for what was not evaluated."""
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
    theirs = (
        "8 h over six towns, another simulator and other channels. The cause that the source gives "
        "stands behind each number (hover), and in the table below."
    )
    return [
        _by_indicator(rows, names, "Indicators beyond their threshold, per route"),
        *_our_causes(segments, names),
        _by_indicator(_town_rows(), names, "Published: indicators per town", theirs, "published"),
        *_cause_table(names),
    ]


HOURS, TOTAL = "hours driven", "total"


def _by_indicator(
    routes: list[Row], names: list[str], caption: str, note: str = "", kind: str = ""
) -> Block:
    """Returns a table with a row per indicator and their sum, and a column per route; "" where unknown."""

    def cell(route: Row, name: str) -> Cell:
        if name == HOURS:
            return Cell(f"{route['hours']:.2f}", sort=route["hours"])
        if name == TOTAL:
            value = sum(route.get(PREFIX + n) or 0 for n in names)
        else:
            value = route.get(PREFIX + name)
        if value is None:
            return Cell("", kind=kind)
        hint = route.get("causes", {}).get(name, "")
        return Cell(f"{value}", sort=float(value), kind=kind, hint=hint)

    columns: list[Column[str]] = [
        Column("indicator", words, "events: repeats within 2 s count once"),
        *(Column[str](route["route"], partial(cell, route)) for route in routes),
    ]
    timed = [HOURS] if all("hours" in route for route in routes) else []
    return table(columns, [*timed, *names, TOTAL], caption, note)


def _our_causes(segments: pl.DataFrame, names: list[str]) -> list[Block]:
    """Returns the table of what was going on as our violations began, per route; empty without causes."""
    columns = [
        (name, cause, f"{CAUSE_PREFIX}{cause.name.lower()}_{name}")
        for name in names
        for cause in ViolationCause
    ]
    there = [(name, cause, column) for name, cause, column in columns if column in segments.columns]
    routes = sorted(segments["route"].unique())
    rows: list[Row] = []
    for name, cause, column in there:
        counts = dict(segments.group_by("route").agg(pl.col(column).fill_null(0.0).sum()).rows())
        rows.append({"indicator": name, "cause": cause.value, ALL: sum(counts.values()), **counts})
    rows.sort(key=lambda row: -row[ALL])
    shown: list[Column[Row]] = [
        Column("indicator: cause", lambda r: f"{words(r['indicator'])}: {r['cause']}",
               "the first that applies in this order: " + "; ".join(c.value for c in ViolationCause),
               kind="long"),
        *(Column[Row](route, partial(_value, route), "violations") for route in routes),
        Column("total", partial(_value, ALL), "violations"),
    ]  # fmt: skip
    caption = "What was going on when an indicator went beyond its threshold, per route"
    return [table(shown, rows, caption)] if rows else []


def _town_rows() -> list[Row]:
    """Returns a row per published town: violations by indicator, and the causes given."""
    towns: dict[int, Row] = {}
    for r in read_published(Source.VIOLATIONS_BY_TOWN).to_dicts():
        row = towns.setdefault(r["town"], {"route": f"town {r['town']}", "causes": {}})
        row[PREFIX + r["spi"]] = r["threshold_violations"]
        row["causes"][r["spi"]] = r["cause"] or ""
    return list(towns.values())


def _cause_table(names: list[str]) -> list[Block]:
    """Returns the table of causes that the source gives, with violations over all towns; or nothing."""
    known = read_published(Source.VIOLATIONS_BY_TOWN).drop_nulls("cause")
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
    """Returns tables of module times in ms per route; empty where no total was measured."""
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
    if not rows:
        return []
    caption = "The monitor's processor time per cycle, per route"
    return [table(columns, rows, caption, note), *_module_table(known, modules)]


STD, GREATEST, LEAST = "_std_ms", "_max_ms", "_min_ms"
SHARES = {  # ours: title, published statistic
    "breaches_pct": ("breaches", "breaches_of_25_ms_pct"),
    "within_90_pct": ("within 90 %", "within_90_pct_of_threshold_pct"),
    "under_50_pct": ("under 50 %", "below_50_pct_of_threshold_pct"),
}
PUBLISHED_NAMES = {"total": "spi_and_hsi_total"}


def _module_table(segments: pl.DataFrame, modules: list[str]) -> list[Block]:
    """Returns the table (C-233) of every module in every route, then the published; or nothing."""
    endings = (STD, GREATEST, LEAST, *(f"_{share}" for share in SHARES))
    measured = [m for m in modules if {m + e for e in endings} <= set(segments.columns)]
    rows: list[Row] = []
    for route in [*sorted(segments["route"].unique()), ALL]:
        here = segments if route == ALL else segments.filter(route=route)
        rows += [{"route": route, "module": m, **_merge_segments(here, m)} for m in measured]
    if not rows or not measured:
        return []
    rows += _published_times(measured)

    def cell(of: str, row: Row) -> Cell:
        value = row.get(of)
        if value is None or isinstance(value, str):
            return Cell(words(value or ""), kind=row.get("kind", ""))
        return Cell(f"{value:.3f}", sort=value, kind=row.get("kind", ""))

    columns: list[Column[Row]] = [
        Column("route", partial(cell, "route")),
        Column("module", partial(cell, "module")),
        Column("mean", partial(cell, "mean"), "per cycle", "ms"),
        Column("deviation", partial(cell, "std"), "over all cycles", "ms"),
        Column("least", partial(cell, "min"), "", "ms"),
        Column("greatest", partial(cell, "max"), "", "ms"),
        *(
            Column[Row](title, partial(cell, name), "share of cycles against the threshold", "%")
            for name, (title, _) in SHARES.items()
        ),
    ]
    note = (
        "The threshold of the total is 25 ms, that of a module its own maximum on the route, which "
        "nothing breaches. Over all routes each drive counts against its own route's. Published "
        "towns in italics, from an automotive processor (four Cortex-A53): another machine, so they "
        "do not compare."
    )
    return [table(columns, rows, "Times of each module in each route", note)]


def _merge_segments(segments: pl.DataFrame, module: str) -> Row:
    """Returns mean, std, min and max in ms and SHARES in % of a module over segments, weighted by hours."""
    hours, mean, std = (segments[c].to_numpy() for c in ("hours", module + MEAN, module + STD))
    weight = hours / hours.sum()
    centre = float(weight @ mean)
    return {
        "mean": centre,
        "std": float(np.sqrt(max(weight @ (std**2 + mean**2) - centre**2, 0.0))),
        "min": float(segments[module + LEAST].to_numpy().min()),
        "max": float(segments[module + GREATEST].to_numpy().max()),
        **{name: float(weight @ segments[f"{module}_{name}"].to_numpy()) for name in SHARES},
    }


def _published_times(modules: list[str]) -> list[Row]:
    """Returns a row of published times in ms per town and module, as those of `_merge_segments`."""
    known = read_published(Source.TIMING)
    rows: list[Row] = []
    for town in known["town"].unique().sort():
        for module in modules:
            here = known.filter(town=town, module=PUBLISHED_NAMES.get(module, module))
            said = dict(here.select("statistic", "value").rows())
            if said:
                rows.append(
                    {
                        "route": f"town {town}",
                        "module": module,
                        **{name: said[f"{name}_ms"] for name in ("mean", "std", "min", "max")},
                        **{ours: said.get(theirs) for ours, (_, theirs) in SHARES.items()},
                        "kind": "published",
                    }
                )
    return rows


def _value(name: str, row: Row) -> float | None:
    """Returns the named field of a row, which may be None."""
    return row[name]  # type: ignore[no-any-return]
