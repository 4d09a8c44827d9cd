"""A baked map in the form that kernels read, with its search grid."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats, Ints32
from skidpad.roads.baked import BakedMap
from skidpad.roads.kernels import LaneArrays
from skidpad.roads.lanes import LaneKind

CELL = 4.0  # m, edge of a cell of the search grid
CELLS_MAX = 8_000_000  # a map that is larger gets larger cells


def lane_arrays(baked: BakedMap) -> LaneArrays:
    """Returns a baked map packed for kernels, with its search grid; headings are made continuous."""
    p, t = baked.samples, baked.lanes
    turns = np.diff(p.heading, prepend=p.heading[:1])
    jumps = -2.0 * np.pi * np.round(turns / (2.0 * np.pi))
    heading = p.heading + np.cumsum(jumps)
    heading -= np.repeat((heading - p.heading)[t.first], t.size)
    columns = (
        *(p.x, p.y, p.z, heading, p.s, p.curvature, p.grade, p.bank, p.width, p.limit, p.s_road),
        *(np.cos(heading), np.sin(heading)),
    )
    order = np.lexsort((baked.signals.s, baked.signals.lane)).astype(np.int32)
    cell, origin, start, cell_sample = _grid(p.x, p.y)
    return LaneArrays(
        sample=np.ascontiguousarray(np.column_stack(columns)),
        lane_of=p.lane,
        **{name: column for name, column in t._asdict().items() if name in LaneArrays._fields},
        drivable=((t.kind == LaneKind.DRIVING) | (t.kind == LaneKind.RAMP)).astype(np.int32),
        signal_start=np.searchsorted(baked.signals.lane[order], np.arange(len(t.road) + 1)).astype(
            np.int32
        ),
        signal_row=order,
        signal_s=baked.signals.s[order],
        signal_kind=baked.signals.kind[order].astype(np.int32),
        cell_size=cell,
        cell_origin=origin,
        cell_start=start,
        cell_sample=cell_sample,
        cell_point=np.column_stack((p.x, p.y, p.z))[cell_sample],
    )


def _grid(x: Floats, y: Floats) -> tuple[float, Floats, Ints32, Ints32]:
    """Returns cell size in m, origin, cell starts (rows + 1, columns) and the points' order by cell."""
    origin = np.array([x.min(), y.min()])
    size = max(CELL, float(np.sqrt(np.ptp(x) / CELLS_MAX * np.ptp(y))))
    size = max(size, float(np.ptp(x) + np.ptp(y)) / CELLS_MAX)  # a thin map
    column = np.floor((x - origin[0]) / size).astype(np.int64)
    row = np.floor((y - origin[1]) / size).astype(np.int64)
    columns, rows = int(column.max()) + 1, int(row.max()) + 1
    cell = row * columns + column
    order = np.argsort(cell, kind="stable").astype(np.int32)
    start = np.searchsorted(cell[order], np.arange(rows * columns + columns))
    return size, origin, start.astype(np.int32).reshape(rows + 1, columns), order
