"""Rain on a road whose superelevation passes through zero, by hand; and where nothing is said of it."""

from dataclasses import replace
from math import hypot

import numpy as np
import pytest

from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import (
    TEXTURE_MM,
    Road,
    physical_params,
    ratio_at,
    road_surface,
    runoff_film,
)
from skidpad.roads.bundled import FOLDER, load_map
from skidpad.roads.cross_slopes import cross_slopes
from skidpad.simulation.world.patches import Patches
from skidpad.simulation.world.sheet_flow import SheetFlow, drained_films

RAIN = Weather(name="rain", precipitation=50.0, wetness=100.0)  # 25 mm/h
# From 3 % up on the left to 3 % up on the right between s = 500 and 600 m, on a grade of 1 %
BANKED = """<lateralProfile>
<superelevation s="0" a="0.03" b="0" c="0" d="0"/>
<superelevation s="500" a="0.03" b="-0.0006" c="0" d="0"/>
<superelevation s="600" a="-0.03" b="0" c="0" d="0"/>
</lateralProfile>"""


@pytest.fixture(scope="module")
def banked(tmp_path_factory):
    text = (FOLDER / "straight.xodr").read_text("utf-8")
    text = text.replace("<lateralProfile/>", BANKED)
    text = text.replace('<elevation s="0.0" a="0.0" b="0.0"', '<elevation s="0.0" a="0.0" b="0.01"')
    path = tmp_path_factory.mktemp("banked") / "banked.xodr"
    path.write_text(text)
    return load_map(path)


def at(map, slopes, lane_id, s_road):
    """The place of `slopes` in the middle of a lane that is nearest to s of the road."""
    own = map.lanes.lane_id[slopes.lane] == lane_id
    return int(np.argmin(np.where(own, np.abs(slopes.s_road - s_road), np.inf)))


def test_one_point_by_hand(banked):
    """Lane -2 at s = 530, where the left is 1.2 % up: the straight road has a shoulder of 2 m and three
    lanes of 3.5 m on either side and no median, so 2 + 4 x 3.5 + 1.75 m lie above its middle."""
    slopes = cross_slopes(banked)
    k = at(banked, slopes, -2, 530.0)
    assert slopes.s_road[k] == pytest.approx(530.0, abs=0.5)
    b = 0.03 - 0.0006 * (slopes.s_road[k] - 500.0)
    g = 0.01 + 5.25 * 0.0006  # of the road, and of its twist 5.25 m to the right
    assert slopes.cross[k] == pytest.approx(np.tan(b), rel=1e-3)
    assert slopes.grade[k] == pytest.approx(g, abs=1e-4)
    assert slopes.above[k] == pytest.approx(17.75, abs=0.01)
    slope = hypot(np.tan(b), g)
    length = 17.75 * slope / np.tan(b)
    depth = 0.01485 * TEXTURE_MM**0.11 * length**0.43 * 25.0**0.59 / slope**0.42 - TEXTURE_MM
    assert drained_films(slopes, 25.0)[k] == pytest.approx(depth, rel=0.01)
    assert depth == pytest.approx(1.34, abs=0.02)
    assert runoff_film(25.0) == pytest.approx(0.35, abs=0.01)  # 7 m at 2 %, everywhere else


def test_the_other_side_is_above_where_the_other_side_is_high(banked):
    """Lane -2 at s = 570: a shoulder, lane -3 and half of its own width lie above."""
    slopes = cross_slopes(banked)
    assert slopes.above[at(banked, slopes, -2, 570.0)] == pytest.approx(2.0 + 3.5 + 1.75, abs=0.01)
    assert slopes.above[at(banked, slopes, 2, 530.0)] == pytest.approx(2.0 + 3.5 + 1.75, abs=0.01)


def test_water_is_deepest_where_the_superelevation_passes_through_zero(banked):
    slopes = cross_slopes(banked)
    films = drained_films(slopes, 25.0)
    at_zero = films[at(banked, slopes, -1, 549.0)]
    assert at_zero > films[at(banked, slopes, -1, 520.0)] > films[at(banked, slopes, -1, 400.0)]


def test_a_wheel_meets_the_level_that_the_film_reaches(banked):
    flow = SheetFlow(banked)
    road = Road(RAIN, GripModel.PHYSICAL)
    found = Patches(banked, (), road, sheet_flow=flow)
    lane = int(np.flatnonzero((banked.lanes.road == 1) & (banked.lanes.lane_id == -2))[0])
    k = at(banked, flow.slopes, -2, 530.0)
    elsewhere = road_surface(RAIN)
    film = elsewhere.film_mm - runoff_film(25.0) + drained_films(flow.slopes, 25.0)[k]
    assert 1.5 <= film < 2.0
    place = banked.at(lane, 530.0)
    wanted = physical_params(replace(elsewhere, film_mm=1.5))
    share = found.ratio_at(place.x, place.y, place.z, 20.0)
    assert share * ratio_at(road.params(), 20.0) == pytest.approx(ratio_at(wanted, 20.0), rel=1e-6)
    found.lay(replace(road, weather=Weather(wetness=100.0)))
    assert found.ratio_at(place.x, place.y, place.z, 20.0) == 1.0  # no rain, no flow


def test_a_map_without_superelevation_is_crowned_everywhere():
    assert len(cross_slopes(load_map("straight")).lane) == 0
    assert SheetFlow(load_map("straight")).patches(RAIN) == ()


def test_a_long_level_straight_is_taken_for_a_crown(banked):
    """The motorway's straights have no superelevation for more than 100 m, its transitions are shorter."""
    motorway = load_map("motorway")
    slopes = cross_slopes(motorway)
    assert len(slopes.lane) > 0
    level = slopes.cross < 0.005
    assert 0 < level.sum() < 0.1 * len(level)
    assert np.isfinite(slopes.above).all()
    assert slopes.above.max() < 25.0
