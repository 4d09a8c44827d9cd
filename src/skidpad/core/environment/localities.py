"""A place on a map in words: road, lane, junction and the kind of road."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum

from skidpad.core.geometry import mps_from_kmh

STREET_UP_TO = mps_from_kmh(60.0)  # m/s
ROAD_UP_TO = mps_from_kmh(100.0)  # m/s


class RoadKind(str, Enum):
    """The kind of a road, by its limit where no junction is."""

    JUNCTION = "junction"
    STREET = "street up to 60 km/h"
    ROAD = "road up to 100 km/h"
    MOTORWAY = "road above 100 km/h"
    UNLIMITED = "road without a limit"


def kind_of_limit(limit: float | None) -> RoadKind:
    """Returns the kind of a road from its speed limit in m/s."""
    if limit is None:
        return RoadKind.UNLIMITED
    if limit <= STREET_UP_TO:
        return RoadKind.STREET
    return RoadKind.ROAD if limit <= ROAD_UP_TO else RoadKind.MOTORWAY


@dataclass(frozen=True, slots=True, kw_only=True)
class Locality:
    """Where on a map something is; ids are those of the OpenDRIVE file."""

    road: int
    lane: int  # counted from the right, 1 is the rightmost of its direction
    lanes: int  # of that direction
    kind: RoadKind
    junction: int | None  # that it lies in, else the nearest; None: the map has none
    distance: float | None  # m to that junction, 0 within it

    def describe(self) -> str:
        """Returns it in words, as `road 12, right lane of 2, 35 m from junction 3`."""
        if self.kind is RoadKind.JUNCTION:
            return f"in junction {self.junction}"
        parts = [f"road {self.road}"]
        if self.lanes > 1:
            parts.append(self._describe_lane())
        if self.junction is not None:
            parts.append(f"{self.distance:.0f} m from junction {self.junction}")
        return ", ".join(parts)

    def _describe_lane(self) -> str:
        """Returns the lane in words, counted from the right, as "right lane of 3"."""
        if self.lane in (1, self.lanes):
            return f"{'right' if self.lane == 1 else 'left'} lane of {self.lanes}"
        return f"lane {self.lane} of {self.lanes} from the right"


Locate = Callable[[str, float, float], Locality | None]  # map, x, y in m; None: no road is near
