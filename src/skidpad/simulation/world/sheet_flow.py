"""Rain that runs off slowly where the superelevation of the road is low, as patches of water.

The formula is that of the film everywhere, `physics.grip.runoff_film`, with slope and length at the place:
rain flows down the steepest line of a plane with cross slope b and grade g, so for sqrt(1 + (g/b)^2) of the
paved width above. One film for the width of a lane, that of its middle.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.weather import Weather
from skidpad.physics.grip import rain_rate, road_surface, runoff_film
from skidpad.roads.cross_slopes import CrossSlopes, cross_slopes
from skidpad.roads.queries import RoadMap

LEVELS_MM = (0.5, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0)  # depth of a patch: the largest that is reached
LEVEL = 0.001  # least slope of a road: it is never built more even; our assumption
LONGEST = 60.0  # m that water flows along a road before it finds a way off; our assumption


class SheetFlow:
    """The water that rain leaves on a map's lanes by their own slopes."""

    def __init__(self, map: RoadMap) -> None:
        self.map, self.slopes = map, cross_slopes(map)

    def patches(self, weather: Weather) -> tuple[SurfacePatch, ...]:
        """Returns the stretches of lane on which water is deeper than elsewhere in this weather."""
        rain, elsewhere = rain_rate(weather), road_surface(weather).film_mm
        if rain <= 0.0 or elsewhere <= 0.0:
            return ()
        film = elsewhere - runoff_film(rain) + drained_films(self.slopes, rain)
        return tuple(self._stretches(np.digitize(film, LEVELS_MM), elsewhere))

    def _stretches(self, level: NDArray[np.int64], elsewhere: float) -> Iterator[SurfacePatch]:
        """Yields a patch for each run of samples of a lane with one level, above the film elsewhere in mm."""
        lane, s = self.slopes.lane, self.slopes.s_road
        cut = (np.diff(level) != 0) | (np.diff(lane) != 0) | (np.abs(np.diff(s)) > 2.0)
        for run in np.split(np.arange(len(level)), np.flatnonzero(cut) + 1):
            deep = LEVELS_MM[level[run[0]] - 1] if len(run) and level[run[0]] > 0 else 0.0
            low, high = (float(s[run].min()), float(s[run].max())) if len(run) else (0.0, 0.0)
            if deep > elsewhere and low < high:
                yield SurfacePatch(
                    name="sheet flow",
                    water_mm=deep,
                    road=int(self.map.lanes.road[lane[run[0]]]),
                    lane=int(self.map.lanes.lane_id[lane[run[0]]]),
                    s=(low, high),
                )


def drained_films(slopes: CrossSlopes, rain_mm_h: float) -> Floats:
    """Returns the depth of rain above the texture at each place, mm."""
    cross = np.maximum(slopes.cross, LEVEL)
    slope = np.hypot(cross, slopes.grade)
    length = np.minimum(slopes.above * slope / cross, LONGEST)
    return np.array(
        [runoff_film(rain_mm_h, *at) for at in zip(length, slope, strict=True)], dtype=np.float64
    )
