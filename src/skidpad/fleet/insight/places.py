"""Places x hazard x weather for a road authority, without vehicles or tenants (C-174)."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from html import escape
from typing import Any

from sqlalchemy import Connection, Integer, cast, func, select

from skidpad.core.vocabulary import HazardType
from skidpad.fleet.store.rights import visible
from skidpad.fleet.store.tables import hazards
from skidpad.fleet.words import Principal, Role

CELL = 100.0  # m
LEAST_VEHICLES = 3  # different ones, or a place is not told; assumption
ADVICE = {
    HazardType.EGO_TAILGATING: "look at sight distance, speed limit and sudden queues",
    HazardType.EGO_TAILGATED: "look at abrupt changes of speed limit and short merges",
    HazardType.INCONSISTENT_LOCALISATION: "look at lane markings, landmarks and satellite sight",
    HazardType.CROSSING_OBJECT: "look at crossings, parked cars beside them, lighting",
    HazardType.CONFLICTING_PATHS: "look at lane guidance and markings of the junction",
    HazardType.UNSEEN_BY_A_CHANNEL: "look at what hides road users: vegetation, signs, walls, glare",
    HazardType.STUCK_VEHICLE: "look at parking, deliveries and blocked lanes",
}


@dataclass(frozen=True, slots=True)
class PlaceRow:
    """One place, one hazard, one class of weather."""

    map: str
    x: float  # m, middle of the cell
    y: float
    hazard: str
    weather: str
    count: int
    vehicles: int  # different ones
    advice: str


def places(connection: Connection, who: Principal) -> list[PlaceRow]:
    """Returns what happened where, most frequent first; rows of fewer than 3 vehicles are left out.

    An authority sees all tenants' places, all other roles those of their own vehicles.
    """
    cell = [cast(func.floor(axis / CELL), Integer) for axis in (hazards.c.x, hazards.c.y)]
    group = (hazards.c.map, *cell, hazards.c.type, hazards.c.weather)
    different = func.count(hazards.c.vehicle.distinct())
    query: Any = (
        select(*group, func.count(), different).group_by(*group).having(different >= LEAST_VEHICLES)
    )
    if who.role is not Role.AUTHORITY:
        query = query.where(visible(who, hazards))
    found = [
        PlaceRow(
            map_, (i + 0.5) * CELL, (j + 0.5) * CELL, type_, weather, count, seen,
            ADVICE[HazardType(type_)],
        )
        for map_, i, j, type_, weather, count, seen in connection.execute(query)
    ]  # fmt: skip
    return sorted(found, key=lambda r: (-r.count, r.map, r.x, r.y, r.hazard, r.weather))


HEADS = ("map", "x in m", "y in m", "hazard", "weather", "count", "vehicles", "what to look at")
STYLE = (
    "body{font:15px/1.45 system-ui,sans-serif;margin:1rem auto;max-width:70rem;padding:0 .6rem}"
    "table{border-collapse:collapse}td,th{padding:.25rem .5rem;border-bottom:1px solid #ccc;"
    "text-align:left}.scroll{overflow-x:auto}"
)


def html(rows: Sequence[PlaceRow]) -> str:
    """Returns the report of places as one HTML page."""
    head = "".join(f"<th>{escape(name)}</th>" for name in HEADS)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(_text(v))}</td>" for v in asdict(row).values()) + "</tr>"
        for row in rows
    )
    return (
        "<!doctype html><html lang=en><meta charset=utf-8>"
        '<meta name=viewport content="width=device-width,initial-scale=1">'
        f"<title>Hazards by place</title><style>{STYLE}</style><h1>Hazards by place</h1>"
        f"<p>{_summary(rows)}</p><div class=scroll><table><tr>{head}</tr>{body}</table></div>"
    )


def pdf(rows: Sequence[PlaceRow]) -> bytes:
    """Returns the report of places as PDF, 25 rows to a page."""
    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.figure import Figure

    buffer = io.BytesIO()
    about: Any = {"Title": "Hazards by place", "CreationDate": None}
    with PdfPages(buffer, metadata=about) as pages:
        for first in range(0, max(len(rows), 1), 25):
            figure = Figure(figsize=(11.7, 8.3), layout="constrained")
            axes = figure.add_subplot()
            axes.axis("off")
            axes.set_title(f"Hazards by place. {_summary(rows)}", fontsize=10)
            cells = [[_text(v) for v in asdict(r).values()] for r in rows[first : first + 25]]
            table = axes.table(cells or [["-"] * len(HEADS)], colLabels=HEADS, loc="upper center")
            table.auto_set_font_size(False)
            table.set_fontsize(7)
            table.auto_set_column_width(list(range(len(HEADS))))
            pages.savefig(figure)
    return buffer.getvalue()


def _summary(rows: Sequence[PlaceRow]) -> str:
    """Returns a sentence with the numbers of hazards and places of the rows."""
    there = len({(row.map, row.x, row.y) for row in rows})
    return (
        f"{sum(row.count for row in rows)} hazards at {there} places of {CELL:g} m; places that "
        f"fewer than {LEAST_VEHICLES} vehicles told of are left out."
    )


def _text(value: Any) -> str:
    """Returns a value as text for a table: numbers short, words without underscores."""
    return f"{value:g}" if isinstance(value, float) else str(value).replace("_", " ")
