"""Which routes were driven: weather, hours, metres and mean speed, ours and the published towns (C-210)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any

import polars as pl

from skidpad.report.elements.page import Block, Cell
from skidpad.report.elements.tables import Column, Format, table
from skidpad.report.published import Source, read_published

Row = Mapping[str, Any]
KNOWN = (
    "metres",
    "weather",
    "sun_altitude_deg",
    "precipitation",
)  # evaluations of before lack them
ALL = "all routes"


def route_list_blocks(evaluation: Row) -> list[Block]:
    """Returns the table of routes with what was driven on each; empty without routes."""
    segments = pl.DataFrame(evaluation["segment_table"], infer_schema_length=None)
    if "route" not in segments.columns or not len(segments):
        return []
    segments = segments.with_columns(
        pl.lit(None).alias(c) for c in KNOWN if c not in segments.columns
    )
    groups = segments.group_by("route", maintain_order=True)
    rows = sorted((_row(str(route), part) for (route,), part in groups), key=lambda r: r["route"])
    rows = [*rows, _row(ALL, segments) | {"weather": ""}, *_town_rows()]
    columns: list[Column[Row]] = [
        Column("route", partial(_cell, "route")),
        Column(
            "weather and light",
            partial(_cell, "weather"),
            "share of the heaviest rain, and the sun",
        ),
        Column("drives", partial(_cell, "drives")),
        Column("evaluated", partial(_cell, "hours"), "without the warm-up of each drive", "h"),
        Column("distance", partial(_cell, "metres"), "of the ego in the evaluated time", "m"),
        Column("mean speed", partial(_cell, "speed"), "distance by time", "km/h"),
    ]
    return [table(columns, rows, "Routes driven, ours and published")]


def _row(route: str, part: pl.DataFrame) -> dict[str, Any]:
    """Returns the row of a route's drives: sums, and every weather once."""
    hours = float(part["hours"].sum())
    metres = None if part["metres"].null_count() else float(part["metres"].sum())
    told = dict.fromkeys(weather_text(row) for row in part.select(KNOWN).to_dicts())
    return {
        "route": route,
        "weather": "; ".join(text for text in told if text) or "not recorded",
        "drives": len(part),
        "hours": hours,
        "metres": metres,
        "speed": _speed(metres, hours) if metres is not None and hours else None,
    }


def _speed(metres: float, hours: float) -> float:
    """Returns the mean speed in km/h."""
    return metres / hours / 1000.0


def weather_text(row: Row) -> str:
    """Returns weather and light of a drive in words, "" where neither is known."""
    rain, sun = row["precipitation"], row["sun_altitude_deg"]
    parts = [row["weather"] or ""]
    if rain is not None:
        parts.append(f"rain {rain:g} %" if rain else "no rain")
    if sun is not None:
        parts.append(f"night, sun {sun:g}°" if sun < 0.0 else f"sun {sun:g}°")
    return ", ".join(part for part in parts if part)


def _town_rows() -> list[dict[str, Any]]:
    """Returns the published towns as rows, and their sum."""
    towns = read_published(Source.ROUTES)
    rows = [
        {
            "route": f"town {r['town']}",
            "weather": f"{r['weather']}, {r['time_of_day']}",
            "hours": r["duration_h"],
            "metres": float(r["distance_m"]),
            "speed": _speed(r["distance_m"], r["duration_h"]),
        }
        for r in towns.to_dicts()
    ]
    hours, metres = float(towns["duration_h"].sum()), float(towns["distance_m"].sum())
    total = {
        "route": "all towns",
        "weather": "",
        "hours": hours,
        "metres": metres,
        "speed": _speed(metres, hours),
    }
    return [row | {"kind": "published"} for row in (*rows, total)]


FORMATS = {
    "drives": Format(".0f"),
    "hours": Format(".2f"),
    "metres": Format(",.0f"),
    "speed": Format(".2f"),
}


def _cell(name: str, row: Row) -> Cell:
    """Returns the cell of a row; "-" where its value is not known."""
    value, kind = row.get(name), row.get("kind", "")
    if isinstance(value, str):
        return Cell(value, kind=kind)
    if value is None:
        return Cell("-", kind=kind or "muted")
    return Cell(format(value, FORMATS[name].value), sort=float(value), kind=kind)
