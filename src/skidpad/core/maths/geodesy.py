"""Places on the map as latitude and longitude."""

from __future__ import annotations

from math import asin, atan, atan2, cos, cosh, degrees, exp, log, pi, radians, sin, sinh, tan

EARTH_RADIUS = 6_378_137.0  # m, equator of WGS 84, as in CARLA's projection
UTM_SCALE = 0.9996  # on the middle meridian


def geolocation(
    east: float, north: float, latitude: float, longitude: float
) -> tuple[float, float]:
    """Returns (latitude, longitude) in deg of a place in m from an origin in deg.

    Mercator on a sphere, scaled at the origin, as CARLA computes it.
    """
    scale = EARTH_RADIUS * cos(radians(latitude))
    y = scale * log(tan(pi / 4.0 + radians(latitude) / 2.0)) + north
    x = scale * radians(longitude) + east
    return (2.0 * atan(exp(y / scale)) - pi / 2.0) * 180.0 / pi, x / scale * 180.0 / pi


def client_geolocation(
    east: float, north: float, latitude: float, longitude: float
) -> tuple[float, float]:
    """Returns (latitude, longitude) in deg as the client of CARLA 0.9.16 has it: transverse Mercator.

    On a sphere; its scale is UTM's, whatever scale, shift and ellipsoid the map names (found with the
    wheel, whose numbers these are to the last digits). Spherical form of PROJ's tmerc, inverse.
    """
    along = north / (UTM_SCALE * EARTH_RADIUS) + radians(latitude)
    across = east / (UTM_SCALE * EARTH_RADIUS)
    turned = degrees(atan2(sinh(across), cos(along)))
    return degrees(asin(sin(along) / cosh(across))), longitude + turned
