"""Where the patches of a surface lie on a map, as polygons to be drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.environment.surface import PATH_OFFSET, PATH_WIDTH, SurfacePatch
from skidpad.roads.bridges import spread_over_bridges
from skidpad.roads.queries import RoadMap

CORNERS = 32  # of a circle
STEP = 4  # samples of a lane between two corners
WATER, ICE, SNOW, FRICTION = "water", "ice", "snow", "friction"


class PatchOutline(NamedTuple):
    """One piece of a patch."""

    kind: str  # water, ice, snow or friction
    name: str
    corners: Floats  # (n, 3) m


def patch_kind(patch: SurfacePatch) -> str:
    """Returns what lies there, "snow", "ice", "water" or else "friction": snow hides ice, ice hides water.

    Slush is snow here.
    """
    if patch.snow_mm > 0.0 or patch.slush_mm > 0.0:
        return SNOW
    if patch.ice_mm > 0.0:
        return ICE
    return WATER if patch.water_mm > 0.0 else FRICTION


def outline_patches(map: RoadMap, surface: Sequence[SurfacePatch]) -> list[PatchOutline]:
    """Returns the polygons of all patches: one for an area, one per lane for a stretch of road."""
    return [
        PatchOutline(patch_kind(patch), patch.name, corners)
        for patch in spread_over_bridges(map, surface)
        for corners in _pieces(map, patch)
    ]


def _pieces(map: RoadMap, patch: SurfacePatch) -> Iterator[Floats]:
    """Yields the outlines (n, 3) in m of a patch: its circle, its polygon or its stretches of lanes."""
    if patch.circle is not None:
        x, y, radius = patch.circle
        turn = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
        yield _on_road(map, np.column_stack([x + radius * np.cos(turn), y + radius * np.sin(turn)]))
    elif patch.polygon:
        yield _on_road(map, np.array(patch.polygon, dtype=np.float64))
    else:
        yield from _stretches(map, patch)


def _on_road(map: RoadMap, corners: Floats) -> Floats:
    """Returns corners (n, 2) as (n, 3), all at the height of the lane sample nearest to their middle."""
    s, (x, y) = map.samples, corners.mean(axis=0)
    nearest = int(np.argmin((s.x - x) ** 2 + (s.y - y) ** 2))
    return np.column_stack([corners, np.full(len(corners), s.z[nearest])])


def _stretches(map: RoadMap, patch: SurfacePatch) -> Iterator[Floats]:
    """Yields the outlines (n, 3) in m of a patch on each drivable lane of its road, one for each strip."""
    s, lanes = map.samples, map.lanes
    low, high = patch.stretch
    for lane in np.flatnonzero((lanes.road == patch.road) & (map.arrays.drivable == 1)):
        if patch.lane not in (None, int(lanes.lane_id[lane])):
            continue
        rows = np.arange(int(lanes.first[lane]), int(lanes.first[lane]) + int(lanes.size[lane]))
        rows = rows[(s.s_road[rows] >= low) & (s.s_road[rows] <= high)]
        if len(rows) < 2:
            continue
        some = np.unique(np.append(rows[::STEP], rows[-1]))
        for strip in _strips(patch.side, 0.5 * s.width[some]):
            edges = [
                np.column_stack(
                    [
                        s.x[some] - offset * np.sin(s.heading[some]),
                        s.y[some] + offset * np.cos(s.heading[some]),
                        s.z[some],
                    ]
                )
                for offset in strip
            ]
            yield np.concatenate([edges[0], edges[1][::-1]])


def _strips(side: str, half: Floats) -> list[tuple[Floats, Floats]]:
    """Returns the edges of what a side covers of a lane, left and right of its middle, m.

    half: of the lane's width, (n,).
    """
    near, far = PATH_OFFSET - 0.5 * PATH_WIDTH, PATH_OFFSET + 0.5 * PATH_WIDTH
    inner, outer = np.minimum(near, half), np.minimum(far, half)
    return {
        "both": [(half, -half)],
        "left": [(half, 0.0 * half)],
        "right": [(0.0 * half, -half)],
        "wheel_paths": [(outer, inner), (-inner, -outer)],
        "beside_wheel_paths": [(half, outer), (inner, -inner), (-outer, -half)],
    }[side]
