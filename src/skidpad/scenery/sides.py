"""The two borders of every road, and what kind of road it is: where scenery begins."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.geometry import mps_from_kmh
from skidpad.roads.lanes import LaneKind, LaneSamples, LaneTable

TOWN_LIMIT, MOTORWAY_LIMIT = (
    mps_from_kmh(51.0),
    mps_from_kmh(99.0),
)  # the former of a road without sidewalks
DRIVEN = (LaneKind.DRIVING, LaneKind.RAMP)
SHORTEST = 8.0  # m of a border beside which anything stands


class RoadKind(Enum):
    """What grows beside a road follows from this."""

    TOWN = "town"
    RURAL = "rural"
    MOTORWAY = "motorway"


@dataclass(frozen=True, slots=True)
class Side:
    """One outer border of a road along its reference line."""

    road: int
    is_left: bool
    kind: RoadKind
    points: Floats  # (n, 3) m
    outward: Floats  # (n, 2) unit vectors away from the road
    s: Floats  # (n,) m along the border

    @property
    def length(self) -> float:
        """Length of the border in m."""
        return float(self.s[-1])

    def at(self, s: float, offset: float) -> tuple[float, float, float]:
        """Returns x, y in m and a direction in rad of the place at s in m, `offset` m beyond the border.

        The direction is that of the border there, with the road to its right on the left border, else to its
        left.
        """
        x, y = (float(np.interp(s, self.s, self.points[:, i])) for i in (0, 1))
        nx, ny = (float(np.interp(s, self.s, self.outward[:, i])) for i in (0, 1))
        size = max(float(np.hypot(nx, ny)), 1e-9)
        nx, ny = nx / size, ny / size
        along = np.arctan2(-nx, ny) if self.is_left else np.arctan2(nx, -ny)
        return x + offset * nx, y + offset * ny, float(along)


def sides_of(samples: LaneSamples, lanes: LaneTable) -> list[Side]:
    """Returns both borders of all roads that have lanes outside junctions, in the order of road indices.

    Borders shorter than SHORTEST m are left out.
    """
    found = []
    for road in np.unique(lanes.road[lanes.junction < 0]).tolist():
        for is_left in (True, False):
            points, outward = _border(samples, lanes, road, is_left)
            s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points[:, :2], axis=0).T))])
            if s[-1] >= SHORTEST:
                kind = kind_of(samples, lanes, road)
                found.append(Side(road, is_left, kind, points, outward, s))
    return found


def kind_of(samples: LaneSamples, lanes: LaneTable, road: int) -> RoadKind:
    """Returns the kind of a road: TOWN with a sidewalk or a limit of TOWN_LIMIT at most.

    Else MOTORWAY from MOTORWAY_LIMIT on, or with four lanes in a section and a limit; else RURAL. The type
    that an OpenDRIVE file gives a road is not asked: town editors write "town" for motorways, too.
    """
    own = np.flatnonzero(lanes.road == road)
    if (lanes.kind[own] == LaneKind.SIDEWALK).any():
        return RoadKind.TOWN
    limits = samples.limit[np.isin(samples.lane, own)]
    limit = float(np.nanmax(limits)) if np.isfinite(limits).any() else float("nan")
    if limit >= MOTORWAY_LIMIT:
        return RoadKind.MOTORWAY
    driven = own[np.isin(lanes.kind[own], DRIVEN)]
    widest = max(
        (int((lanes.section[driven] == s).sum()) for s in lanes.section[driven]), default=0
    )
    if widest >= 4 and limit > TOWN_LIMIT:
        return RoadKind.MOTORWAY
    return RoadKind.TOWN if limit <= TOWN_LIMIT else RoadKind.RURAL


def _border(
    samples: LaneSamples, lanes: LaneTable, road: int, is_left: bool
) -> tuple[Floats, Floats]:
    """Returns points (n, 3) in m and outward unit vectors (n, 2) of a road's edge, along increasing s."""
    parts = list(_edges(samples, lanes, road, is_left))
    points = np.concatenate([p for p, _ in parts])
    outward = np.concatenate([n for _, n in parts])
    new = np.concatenate([[True], np.hypot(*np.diff(points[:, :2], axis=0).T) > 1e-3])
    return points[new], outward[new]


def _edges(
    samples: LaneSamples, lanes: LaneTable, road: int, is_left: bool
) -> Iterator[tuple[Floats, Floats]]:
    """Yields (edge (n, 3) in m, outward unit vectors (n, 2)) along each lane section's outermost lane."""
    own = np.flatnonzero(lanes.road == road)
    for section in np.unique(lanes.section[own]).tolist():
        members = own[lanes.section[own] == section]
        ids = lanes.lane_id[members]
        lane = int(members[ids.argmax() if is_left else ids.argmin()])
        part = slice(int(lanes.first[lane]), int(lanes.first[lane] + lanes.size[lane]))
        along = samples.s_road[part][-1] >= samples.s_road[part][0]
        heading = samples.heading[part] + (0.0 if along else np.pi)
        sign = 1.0 if is_left else -1.0
        outward = sign * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        half = 0.5 * samples.width[part, None]
        middle = np.stack([samples.x[part], samples.y[part]], axis=1)
        edge = np.column_stack([middle + half * outward, samples.z[part]])
        order = slice(None) if along else slice(None, None, -1)
        yield edge[order], outward[order]
