"""Places on the map as latitude and longitude."""

from __future__ import annotations

from math import atan, cos, exp, log, pi, radians, tan

EARTH_RADIUS = 6_378_137.0  # m, equator of WGS 84, as in CARLA's projection


def geolocation(
    east: float, north: float, latitude: float, longitude: float
) -> tuple[float, float]:
    """(latitude, longitude) in deg of a place in m from an origin in deg.

    Mercator on a sphere, scaled at the origin, as CARLA computes it.
    """
    scale = EARTH_RADIUS * cos(radians(latitude))
    y = scale * log(tan(pi / 4.0 + radians(latitude) / 2.0)) + north
    x = scale * radians(longitude) + east
    return (2.0 * atan(exp(y / scale)) - pi / 2.0) * 180.0 / pi, x / scale * 180.0 / pi
