"""The ways that drives took on their maps."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.errors import SkidpadError
from skidpad.core.text.wording import count_text
from skidpad.recording.channels.drives import read_records
from skidpad.report.elements.figures import Chart, Curve, curves
from skidpad.report.elements.page import Block, Figure, Text
from skidpad.roads.bundled import kept_map
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import RoadMap

Way = Sequence[Sequence[float]]  # x, y in m
LANE_STEP = 4  # samples of a lane from one point of its line to the next
BESIDE = 3  # maps in one figure
LANES = {"color": "#c5cdd5", "linewidth": 0.6}
DRIVEN = {"linewidth": 1.0, "alpha": 0.6}


def draw_ways(folder: Path) -> list[Block]:
    """Returns figures of the ways of all drives below the folder, by map; a note where none is kept."""
    ways: dict[str, list[Way]] = {}
    km: dict[str, float] = {}
    for record in read_records([folder]):
        if record.outcome.way:
            map = _map_name(record.plan)
            ways.setdefault(map, []).append(record.outcome.way)
            km[map] = km.get(map, 0.0) + record.outcome.distance_m / 1000.0
    if not ways:
        text = "Not shown: the drives of this folder kept no places, as none did before 2026-11-25."
        return [Text(text, tone="note")]
    driven = ", ".join(
        f"{name}: {count_text(len(of), 'drive')}, {km[name]:.0f} km" for name, of in ways.items()
    )
    return [Figure(svg, f"Where the ego drove. {driven}.") for svg in ways_figures(ways, folder)]


def ways_figures(ways: Mapping[str, Sequence[Way]], folder: Path) -> list[str]:
    """Returns an SVG per BESIDE maps, by name: lanes grey, the ways driven over them."""
    names = sorted(ways)
    rows = [names[k : k + BESIDE] for k in range(0, len(names), BESIDE)]
    return [
        curves([_chart(name, ways[name], folder) for name in row], width=3.6 * len(row), height=3.8)
        for row in rows
    ]


def _chart(name: str, ways: Sequence[Way], folder: Path) -> Chart:
    """Returns a chart in m of the ways driven on a map, over its lanes where the map is known."""
    x, y = _join_lines(np.array(way, dtype=np.float64).reshape(-1, 2) for way in ways)
    drawn = [Curve("driven", x, y, colour=0, style=DRIVEN)]
    map = _known_map(name, folder)
    if map is not None:
        drawn.insert(0, Curve("lanes", *_join_lines(lane_lines(map)), style=LANES))
    return Chart(drawn, "x, m", "y, m", name, equal=True)


def lane_lines(map: RoadMap) -> Iterable[Floats]:
    """Yields (k, 2) points in m along each driving lane, every LANE_STEP-th sample and the last."""
    for lane in np.flatnonzero(map.lanes.kind == LaneKind.DRIVING).tolist():
        first, size = int(map.lanes.first[lane]), int(map.lanes.size[lane])
        rows = np.append(np.arange(first, first + size - 1, LANE_STEP), first + size - 1)
        yield np.column_stack([map.samples.x[rows], map.samples.y[rows]])


def _join_lines(lines: Iterable[Floats]) -> tuple[Floats, Floats]:
    """Returns x and y of (k, 2) lines as one line, with nan after each."""
    gap = np.full((1, 2), np.nan)
    whole = np.concatenate([part for line in lines for part in (line, gap)] or [gap])
    return whole[:, 0], whole[:, 1]


def _known_map(name: str, folder: Path) -> RoadMap | None:
    """Returns the map of that name that the folder keeps, else a bundled one; None where there is none."""
    try:
        return kept_map(folder, name, "")
    except SkidpadError:
        return None


def _map_name(plan: Mapping[str, Any]) -> str:
    """Returns the name of the plan's map file without its ending, "unknown" where the plan names none."""
    course = plan.get("course")
    place = course.get("map", "") if isinstance(course, dict) else ""
    return Path(str(place)).stem or "unknown"
