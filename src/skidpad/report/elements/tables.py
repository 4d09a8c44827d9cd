"""Tables by specification: a column is a quantity that says of itself all that the table on the page,
its CSV and its list of definitions need."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from skidpad.evidence.statistics import Interval
from skidpad.report.elements.page import Cell, Table

R = TypeVar("R")


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """Holds an estimate in the unit of its column, its 95 % interval and what was published of it."""

    value: float | None
    interval: Interval | None = None
    remark: str = ""  # behind the interval
    lines: tuple[str, ...] = ()  # small print below it
    published: float | None = None
    doubted: bool = False  # the published value contradicts itself
    kind: str = ""  # see `page.Cell`
    heat: float | None = None
    hint: str = ""


@dataclass(frozen=True, slots=True)
class Format:
    """How numbers are written, as for `format`; "" picks the digits by size."""

    value: str = ""
    limits: str = ""  # of the interval
    absent: str = "none"  # where there is no value


Content = Cell | Quantity | str | float | None


@dataclass(frozen=True)
class Column(Generic[R]):
    """What stands in a column, as a function of the row: a run, a cell of a campaign, a hazard."""

    title: str
    of: Callable[[R], Content]
    definition: str = ""
    unit: str = ""
    format: Format = Format()
    kind: str = ""  # of all its cells that say nothing else

    @property
    def heading(self) -> str:
        """Returns the title of the column with its unit, as "speed, km/h"."""
        return f"{self.title}, {self.unit}" if self.unit else self.title

    def cell(self, row: R) -> Cell:
        """Returns the cell of a row in this column."""
        content = self.of(row)
        if isinstance(content, Cell):
            return content
        if isinstance(content, str):
            return Cell(content, kind=self.kind)
        if not isinstance(content, Quantity):
            content = Quantity(value=content, kind=self.kind)
        return quantity_cell(content, self.format)


def table(
    columns: Sequence[Column[R]],
    rows: Iterable[R],
    caption: str = "",
    note: str = "",
    sortable: bool = True,
) -> Table:
    """Returns a table with one row per item and one cell per column."""
    return Table(
        [(c.heading, c.definition) for c in columns],
        [[c.cell(row) for c in columns] for row in rows],
        caption,
        note,
        sortable,
    )


def quantity_cell(q: Quantity, style: Format) -> Cell:
    """Returns the cell of an estimate; below it the interval with remark, further lines, what was published.

    Without a value it reads `style.absent`, muted.
    """
    told = [] if q.interval is None or q.value is None else [_limits(q, style)]
    told += [line for line in (*([] if told else [q.remark]), *q.lines) if line]
    if q.published is not None:
        told.append(f"published {q.published:.4g}{' ?' if q.doubted else ''}")
    if q.value is None:
        note = "\n".join(told)
        return Cell(style.absent, published=q.published, note=note, kind="muted", hint=q.hint)
    return Cell(
        number(q.value, style.value),
        sort=q.value,
        limits=q.interval,
        published=q.published,
        note="\n".join(told),
        heat=q.heat,
        kind=q.kind,
        hint=q.hint,
    )


def _limits(q: Quantity, style: Format) -> str:
    """Returns a quantity's interval as "low to high" with its remark; the interval must be there."""
    assert q.interval is not None
    low, high = (number(end, style.limits) for end in q.interval)
    return f"{low} to {high}" + (f", {q.remark}" if q.remark else "")


def number(value: float, spec: str = "") -> str:
    """Returns a number as text by `spec`, else whole, or with two digits below 100 if it is not."""
    if spec:
        return f"{value:{spec}}"
    whole = abs(value) >= 100 or value == int(value)
    return f"{value:.0f}" if whole else f"{value:.2f}"
