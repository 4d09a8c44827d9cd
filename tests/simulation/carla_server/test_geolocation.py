"""Latitude and longitude of the server against those of the client's own map."""

from __future__ import annotations

import re

import pytest

from skidpad.roads.bundled import load_map, map_file
from skidpad.simulation.carla_server.maps.maps import ServedMap

carla = pytest.importorskip("carla")
PLACES = ((0.0, 0.0), (1450.0, -300.0), (-3000.0, 2000.0), (20_000.0, 40_000.0))
NAMED = "+proj=tmerc +lat_0={} +lon_0={} +k=1 +x_0=500 +ellps=GRS80 +units=m"


@pytest.mark.parametrize(
    "projection", [NAMED.format(48.1, 11.5), NAMED.format("-3.5e1", 174), "", "+proj=utm +zone=32"]
)
def test_a_place_is_where_the_client_has_it(projection):
    text = map_file("straight").read_text(encoding="utf-8")
    text = re.sub(r"(<geoReference>).*?(</geoReference>)", rf"\g<1>{projection}\g<2>", text)
    roads = load_map("straight")
    roads.geo_reference = projection
    served, client = ServedMap("straight", roads, text, ()), carla.Map("straight", text)
    for x, y in PLACES:
        geo = client.transform_to_geolocation(carla.Location(x, -y, 0.0))
        assert served.geolocation(x, -y) == pytest.approx((geo.latitude, geo.longitude), abs=1e-11)
