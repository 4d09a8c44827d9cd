"""What kernels rely on in a map's arrays, checked where a map comes from a file."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple, get_args, get_origin, get_type_hints

import numpy as np
from numpy.typing import NDArray

from skidpad.core.errors import FileError
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable, Marking, SignalKind, SignalTable

EXTENT = 1.0e7  # m from the origin; no road is further
LONGER = ("next_start", "prev_start")  # one entry more than there are lanes
FREE = ("next_lane", "prev_lane")  # of any length
MAYBE_NAN = ("limit", "value")


def check_arrays(samples: LaneSamples, lanes: LaneTable, signals: SignalTable, where: str) -> None:
    """Raises FileError, beginning with `where`, where an index points outside its table or a value is off.

    Kernels read arrays without looking at bounds, so this is what keeps a file from doing harm. Numbers are
    at most EXTENT; NaN is allowed in MAYBE_NAN only.
    """
    try:
        n, m, k = len(samples.x), len(lanes.road), len(signals.id)
        _require(n >= 2 and m >= 1, "has no lane")
        _columns(samples, n, "samples")
        _columns(lanes, m, "lanes")
        _columns(signals, k, "signals")
        _within(lanes.size, 2, n, "lanes.size")
        _within(lanes.first, 0, n - 1, "lanes.first")
        ends = np.cumsum(lanes.size, dtype=np.int64)
        _require(int(ends[-1]) == n, "lanes have other samples than there are")
        _require(bool((lanes.first == ends - lanes.size).all()), "lanes overlap or leave gaps")
        for name in ("left", "right", "opposite"):
            _within(getattr(lanes, name), -1, m - 1, f"lanes.{name}")
        for start, lane in (
            (lanes.next_start, lanes.next_lane),
            (lanes.prev_start, lanes.prev_lane),
        ):
            _within(lane, 0, m - 1, "a lane that follows")
            _require(start[0] == 0 and start[-1] == len(lane), "lists of lanes have other ends")
            _require(bool((np.diff(start) >= 0).all()), "lists of lanes overlap")
        _within(samples.lane, 0, m - 1, "samples.lane")
        _within(signals.lane, 0, m - 1, "signals.lane")
        _within(lanes.kind, 0, max(LaneKind), "lanes.kind")
        _within(signals.kind, 0, max(SignalKind), "signals.kind")
        for marking in (samples.marking_left, samples.marking_right):
            _within(marking, 0, max(Marking), "a marking")
    except ValueError as error:
        raise FileError(f"{where}: {error}") from None


def _columns(table: Any, n: int, name: str) -> None:
    """Raises ValueError where a column of a table has a wrong type, length or value."""
    for column, kind in KINDS[type(table)].items():
        values, title = getattr(table, column), f"{name}.{column}"
        _require(values.dtype == kind, f"{title} holds {values.dtype}, not {kind}")
        _require(values.ndim == 1, f"{title} has {values.ndim} dimensions")
        if column not in FREE:
            _require(len(values) == n + (column in LONGER), f"{title} has {len(values)} values")
        if kind.kind == "f":
            known = values[~np.isnan(values)] if column in MAYBE_NAN else values
            _require(
                bool((np.abs(known) <= EXTENT).all()), f"{title} holds what is no number of use"
            )


def kinds(table: type[NamedTuple]) -> dict[str, np.dtype[Any]]:
    """Returns the numpy types of a table's columns by name, as the table declares them."""
    return {name: np.dtype(element_type(hint)) for name, hint in get_type_hints(table).items()}


def element_type(hint: Any) -> type[np.generic]:
    """Returns the numpy type that an array's type hint names.

    NDArray[T] is ndarray[..., dtype[T]], or an alias of T with numpy 2.5 on Python 3.12.
    """
    return next(_types_in(hint))


def _types_in(hint: Any) -> Iterator[type[np.generic]]:
    """Yields every numpy scalar type that a type hint names, at any depth."""
    if get_origin(hint) is None and isinstance(hint, type) and issubclass(hint, np.generic):
        yield hint
    for part in get_args(hint):
        yield from _types_in(part)


KINDS = {table: kinds(table) for table in (LaneSamples, LaneTable, SignalTable)}


def _within(values: NDArray[Any], low: int, high: int, title: str) -> None:
    """Raises ValueError where a value is not between low and high, both included."""
    if values.size and not (low <= int(values.min()) and int(values.max()) <= high):
        raise ValueError(f"{title} must be between {low} and {high}")


def _require(holds: bool, text: str) -> None:
    """Raises ValueError with the text where the condition is false."""
    if not holds:
        raise ValueError(text)
