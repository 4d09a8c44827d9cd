"""Where patches lie that cover the bridges of a map."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from msgspec import structs

from skidpad.core.environment.surface import PatchError, SurfacePatch, place_in_file
from skidpad.roads.queries import RoadMap
from skidpad.roads.roadside import Bridge


def spread_over_bridges(map: RoadMap, surface: Sequence[SurfacePatch]) -> tuple[SurfacePatch, ...]:
    """Returns the patches, those of `bridges` as one stretch of road for each bridge of the map.

    PatchError where a patch asks for bridges and the map names none.
    """
    return tuple(part for k, patch in enumerate(surface) for part in _parts(map, k, patch))


def _parts(map: RoadMap, k: int, patch: SurfacePatch) -> Iterator[SurfacePatch]:
    """Yields a patch itself, or its stretches on the bridges of the map."""
    if not patch.bridges:
        yield patch
        return
    bridges = map.roadside.bridges
    if not bridges:
        raise PatchError(
            f"{place_in_file(k, patch)}: map {map.name} names no <bridge>; say road and s of each one"
        )
    for bridge in bridges:
        for lane in _lanes(map, bridge):
            yield structs.replace(
                patch, bridges=False, road=bridge.road, lane=lane, s=(bridge.s_from, bridge.s_to)
            )


def _lanes(map: RoadMap, bridge: Bridge) -> Sequence[int | None]:
    """Returns the ids of the lanes that a bridge carries or [None] for all."""
    if bridge.lanes is None:
        return [None]
    low, high = bridge.lanes
    ids = map.lanes.lane_id[map.lanes.road == bridge.road]
    return sorted({int(i) for i in ids if low <= i <= high})
