"""Tyres as data: measured stops of each kind, and what wear does on dry and wet roads."""

import pytest

from skidpad.core.environment.tyres import REFERENCE, find_tyres, known_tyres
from skidpad.core.errors import ConfigError
from skidpad.core.maths.constants import G
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import (
    MU_REF,
    Road,
    RoadSurface,
    grip_params,
    ice_mu,
    mu_at,
    physical_params,
)
from skidpad.physics.stopping import stops

DRY = RoadSurface(0.0, 0.0, 0.0, 0.0, 5.5)
SHEET = RoadSurface(0.0, 3.0, 0.0, 0.0, -5.0)
PACKED = RoadSurface(0.0, 0.0, 50.0, 0.0, -5.0)
MPH = 0.44704


def film(mm):
    return RoadSurface(mm, 0.0, 0.0, 0.0, 15.0)


def way(tyres, surface, v0):
    return stops([physical_params(surface, MU_REF, find_tyres(tyres))], [v0])[0].distance


def test_the_reference_is_the_road_without_a_choice_of_tyres():
    for weather in (Weather(), Weather(wetness=60.0), Weather(snow_depth_mm=40.0)):
        plain = grip_params(weather, GripModel.PHYSICAL, 0.7)
        assert Road(weather, GripModel.PHYSICAL, 0.7).params(REFERENCE) == plain


@pytest.mark.parametrize(
    ("tyres", "surface", "mph", "measured"),
    [
        ("winter", DRY, 62, 43.7),  # What Car? n11594; all four were fitted
        ("summer", DRY, 62, 37.9),
        ("winter", SHEET, 12, 12.5),  # What Car? n11592
        ("summer", SHEET, 12, 19.0),
    ],
)
def test_stops_that_were_fitted(tyres, surface, mph, measured):
    assert way(tyres, surface, mph * MPH) == pytest.approx(measured, rel=0.03)


@pytest.mark.parametrize(
    ("surface", "mph", "measured", "within"),
    [
        (PACKED, 30, 1.69, 0.2),  # summer over winter on snow, evo.co.uk 17033: here 2.0
        (SHEET, 15, 9.75 / 7.01, 0.1),  # on an ice rink, motoring.co.uk 34497 (TyreSafe): here 1.52
    ],
)
def test_stops_of_summer_tyres_that_were_not_fitted(surface, mph, measured, within):
    share = way("summer", surface, mph * MPH) / way("winter", surface, mph * MPH)
    assert share == pytest.approx(measured, rel=within)


@pytest.mark.parametrize(
    ("mm", "worn"), [(0.2, (0.5, 0.2, 0.2)), (1.0, (0.4, 0.1, 0.1)), (2.0, (0.25, 0.05, 0.0))]
)
def test_a_worn_tyre_holds_what_the_table_of_bosch_says(mm, worn):
    params = physical_params(film(mm), MU_REF * 0.85 / 0.9, find_tyres("winter_1.6mm"))
    for kmh, measured in zip((50, 90, 130), worn, strict=True):
        assert mu_at(params, kmh / 3.6) == pytest.approx(measured, abs=0.09)


def test_stops_on_worn_tyres_lie_among_the_measured_ones():
    """Not fitted, and no test tells its film: the measured ratio must lie between two thin films.

    MIRA (automotivefitness.com, 3mmtyres.co.uk, 50 mph): 39.9 m with 1.6 mm, 13 m more than new;
    Tire Rack (986forum.com 428943, 70 mph): 195, 290, 378 ft with new tyres, 3.2 and 1.6 mm.
    """
    for mph, measured in ((50, 39.9 / 26.9), (70, 378 / 195)):
        thin, thick = (
            way("summer_1.6mm", film(mm), mph * MPH) / way("summer", film(mm), mph * MPH)
            for mm in (0.1, 0.5)
        )
        assert thin < measured < thick, mph


def test_wear_and_kinds_keep_their_order():
    for mm in (0.2, 0.5, 1.0):
        mu = [mu_at(physical_params(film(mm), MU_REF, find_tyres(f"summer{end}")), 22.0)
              for end in ("", "_4mm", "_1.6mm")]  # fmt: skip
        assert mu[0] > mu[1] > mu[2]
    ice = {name: mu_at(physical_params(SHEET, MU_REF, find_tyres(name)), 5.0)
           for name in ("summer", "all_season", "winter", "studded", "winter_4mm")}  # fmt: skip
    assert ice["summer"] < ice["all_season"] < ice["winter"] < ice["studded"]
    worn = mu_at(physical_params(SHEET, MU_REF, find_tyres("studded_1.6mm")), 5.0)
    assert worn == pytest.approx(ice["winter"])  # VTI: as a new tyre without studs
    assert ice["winter_4mm"] == ice["summer"]  # VTI: worn European winter tyres on smooth ice
    assert ice["winter"] == pytest.approx(ice_mu(-5.0, wet=False))
    assert ice["studded"] == pytest.approx((30 * MPH) ** 2 / (2 * G * 92 * 0.3048) * 0.71, rel=0.03)


def test_every_tyre_has_a_source_and_a_wrong_name_lists_them():
    assert all(len(t.source) > 40 for t in known_tyres().values())
    with pytest.raises(ConfigError, match="choose one of: all_season, all_season_4mm"):
        find_tyres("slick")
