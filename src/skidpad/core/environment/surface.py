"""What lies on parts of the road: puddles, ice, snow, or a share of the friction, by area."""

from __future__ import annotations

from collections.abc import Iterable
from math import inf
from typing import Literal

from msgspec import Struct

from skidpad.core.errors import ConfigError, require_range
from skidpad.core.weather import RANGES

FRICTION = (0.01, 1.5)  # times the friction that is there without the patch
WATER_MM = (0.0, 10.0)  # for friction, deeper than 2 counts as 2 (docs/physics.md)
ICE_MM = (0.0, 20.0)
SNOW_MM = (0.0, 2000.0)
SLUSH_MM = (0.0, 15.0)
# Wheel paths lie this far from the middle of a lane and are this wide, m: the usual track of a car and
# a car's place in its lane; our assumption
PATH_OFFSET, PATH_WIDTH = 0.75, 0.6
RADIUS = (0.1, 1000.0)  # m
DRIED_MIN = (0.0, 1440.0)  # min
AIR_C = RANGES["air_temperature_c"]  # of weather
NUMBERS = {  # ranges of the fields that are one number
    "friction": FRICTION,
    "water_mm": WATER_MM,
    "ice_mm": ICE_MM,
    "snow_mm": SNOW_MM,
    "slush_mm": SLUSH_MM,
    "dried_min": DRIED_MIN,
    "air_below_c": AIR_C,
}


class PatchError(ConfigError):
    """A patch that does not fit the map; says which of its file, but not the file."""


class SurfacePatch(
    Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, omit_defaults=True
):
    """One area with something on it. What is there and where it is are each said in one way.

    Attributes:
        name: what pages call it.
        friction: times the friction that the weather leaves there.
        water_mm, ice_mm, snow_mm: depth, mm; where the weather's is more, that counts.
        slush_mm: depth, mm; it lies on what else is there.
        circle: x, y of the middle and the radius, m, in the map's plane.
        polygon: corners x, y, m, in the map's plane, at least three.
        road: OpenDRIVE id; the area is a stretch of it.
        lane: OpenDRIVE id of a lane of it; None: all driving lanes.
        s: from and to along the road, m; None: the whole road.
        bridges: the area is every bridge that the map names.
        side: half of each lane, seen in its driving direction, its two wheel paths, or the rest of it.
        by_deposits: `water_mm` is what is there at `precipitation_deposits` 100; at 0 nothing is.
        dried_min: minutes without rain for which `water_mm` has dried when the run begins.
        air_below_c: the patch is there while the air is colder, degrees Celsius; None: always.
    """

    name: str = ""
    friction: float | None = None
    water_mm: float = 0.0
    ice_mm: float = 0.0
    snow_mm: float = 0.0
    slush_mm: float = 0.0
    circle: tuple[float, float, float] | None = None
    polygon: tuple[tuple[float, float], ...] = ()
    road: int | None = None
    lane: int | None = None
    s: tuple[float, float] | None = None
    bridges: bool = False
    side: Literal["both", "left", "right", "wheel_paths", "beside_wheel_paths"] = "both"
    air_below_c: float | None = None
    dried_min: float = 0.0
    by_deposits: bool = False

    def __post_init__(self) -> None:
        self._require_what()
        self._require_where()

    def _require_what(self) -> None:
        """Raises ConfigError unless the patch has either a friction or a depth in mm, within its range."""
        deep = [name for name in NUMBERS if name.endswith("_mm")]
        for name in deep:
            require_range(name, getattr(self, name), *NUMBERS[name])
        lies = any(getattr(self, name) > 0.0 for name in deep)
        if lies is (self.friction is not None):
            raise ConfigError(
                "needs either friction or a depth: water_mm, ice_mm, snow_mm, slush_mm"
            )
        if self.friction is not None:
            require_range("friction", self.friction, *FRICTION)
        require_range("dried_min", self.dried_min, *DRIED_MIN)
        if self.dried_min > 0.0 and self.water_mm == 0.0:
            raise ConfigError("dried_min goes with water_mm")
        if self.by_deposits and self.water_mm == 0.0:
            raise ConfigError("by_deposits goes with water_mm")

    def _require_where(self) -> None:
        """Raises ConfigError unless the area is one valid circle, polygon, road, or the bridges."""
        areas = (self.circle is not None, bool(self.polygon), self.road is not None, self.bridges)
        if sum(areas) != 1:
            raise ConfigError("needs one of circle, polygon, road and bridges")
        if self.road is None and (self.lane is not None or self.s is not None):
            raise ConfigError("lane and s go with a road")
        if self.road is None and not self.bridges and self.side != "both":
            raise ConfigError("side goes with a road or bridges")
        if self.polygon and len(self.polygon) < 3:
            raise ConfigError(f"polygon needs at least 3 corners, got {len(self.polygon)}")
        if self.circle is not None:
            require_range("circle's radius", self.circle[2], *RADIUS)
        if self.s is not None and not 0.0 <= self.s[0] < self.s[1]:
            raise ConfigError(f"s must run from 0 or more to more, got {list(self.s)}")
        if self.air_below_c is not None:
            require_range("air_below_c", self.air_below_c, *AIR_C)

    @property
    def stretch(self) -> tuple[float, float]:
        """Returns where the patch begins and ends along its road, m; without `s` it covers the whole road."""
        return (0.0, inf) if self.s is None else self.s


def present_patches(surface: Iterable[SurfacePatch], air_c: float) -> tuple[SurfacePatch, ...]:
    """Returns the patches that are there in air of this temperature, in degrees Celsius."""
    return tuple(p for p in surface if p.air_below_c is None or air_c < p.air_below_c)


def place_in_file(k: int, patch: SurfacePatch) -> str:
    """Returns where a patch stands in its file, for messages: "patches[2] (puddle)"."""
    return f"patches[{k}]{f' ({patch.name})' if patch.name else ''}"
