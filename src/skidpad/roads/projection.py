"""Between degrees of latitude and longitude and a map's metres."""

from __future__ import annotations

from math import isfinite, radians

from skidpad.core.errors import ConfigError, MissingExtra
from skidpad.core.text.told import describe_value

EARTH_RADIUS = 6_378_137.0  # m, equator of WGS 84, for maps without a projection
# What places on the ground depend on. Heights (geoid grids, vunits) are the map's own, and files are
# never opened because a map names them.
KEPT = (
    "proj", "lat_0", "lon_0", "lat_1", "lat_2", "lat_ts", "k", "k_0", "x_0", "y_0", "zone", "south",
    "ellps", "datum", "a", "b", "rf", "R",
)  # fmt: skip


def map_place(projection: str, latitude: float, longitude: float) -> tuple[float, float]:
    """Returns (x, y) in m on a map of a place in deg.

    projection: the PROJ text of the map's header (ASAM OpenDRIVE 1.8, "Geo referencing"). Without one,
    on the plane that touches the earth at 0, 0. ConfigError when PROJ knows no such projection or the
    place lies outside it, MissingExtra where PROJ is not installed.
    """
    if "+proj=" not in projection:
        return EARTH_RADIUS * radians(longitude), EARTH_RADIUS * radians(latitude)
    try:
        from pyproj import Proj  # takes 60 ms, which few maps and files need
        from pyproj.exceptions import ProjError
    except ImportError as error:
        raise MissingExtra("a GeoPosition on a map with a projection", "geo") from error
    words = (word for word in projection.split() if word.lstrip("+").partition("=")[0] in KEPT)
    try:
        x, y = Proj(" ".join(words))(longitude, latitude, errcheck=True)
        why = "" if isfinite(x + y) else "there is no such place"
    except ProjError as error:
        why = describe_value(str(error), 200)
    if why:
        raise ConfigError(
            f"latitude {latitude:g}, longitude {longitude:g} cannot be put on the map, whose geoReference "
            f"is {describe_value(projection, 200)}: {why}"
        )
    return float(x), float(y)
