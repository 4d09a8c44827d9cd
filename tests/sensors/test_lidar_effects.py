"""Kinds of fog, wet ground and the window of a lidar: by second routes and beside published numbers."""

import csv
from math import pi
from pathlib import Path

import numpy as np
import pytest

from skidpad.core.environment.lidar_effects import LidarFog
from skidpad.core.vocabulary import SemanticClass
from skidpad.core.weather import Weather
from skidpad.physics.camera import wetted_share
from skidpad.physics.fog import FOGS, with_fog
from skidpad.physics.optics import LidarAir, lidar_air
from skidpad.physics.radio import mie_efficiencies
from skidpad.physics.wetted import (
    DIFFUSE,
    INDEX,
    water_cover,
    water_transmission,
    wet_ground,
    window_loss,
)
from skidpad.sensors.ranging.clouds import no_spray
from skidpad.sensors.ranging.lidar_returns import ON_GROUND, WHITE, ReturnModel, find_returns

CAR, ROAD = int(SemanticClass.CAR), int(SemanticClass.ROAD)
TABLE = Path(__file__).parents[2] / "docs" / "lidar-fog.csv"
RADIUS = np.linspace(0.05, 60.0, 2000)  # um
KINDS = (LidarFog.ADVECTION, LidarFog.RADIATION)


def mie_sums(kind, nanometres, index):
    """Extinction and backscatter of a fog per drop, and the volume of a drop, in um."""
    drops = FOGS[kind]
    number = RADIUS**drops.shape * np.exp(-drops.slope * RADIUS)
    with np.errstate(all="ignore"):  # terms beyond those that small drops have
        out, back = mie_efficiencies(2.0 * pi * RADIUS * 1e3 / nanometres, complex(index, 1e-9))
    area = number * pi * RADIUS**2
    volume = (number * 4.0 / 3.0 * pi * RADIUS**3).sum()
    return (out * area).sum(), (back * area).sum() / (4.0 * pi), volume


def published():
    with TABLE.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("kind", KINDS)
def test_ratios_are_mie_sums_over_the_spectra(kind):
    lidar, visible = mie_sums(kind, 905.0, 1.328), mie_sums(kind, 550.0, 1.333)
    assert lidar[0] / visible[0] == pytest.approx(FOGS[kind].dims, abs=1e-3)
    assert lidar[0] / lidar[1] == pytest.approx(FOGS[kind].lidar_ratio, rel=0.01)


@pytest.mark.parametrize("kind", KINDS)
def test_the_lidar_ratio_is_that_of_a_published_calibration(kind):
    """O'Connor et al. (2004): 18.8 +- 0.8 sr of water drops at 905 nm; nothing was fitted to it."""
    row = next(r for r in published() if r["quantity"] == "lidar ratio")
    assert abs(FOGS[kind].lidar_ratio - float(row["published"])) < float(row["spread"])


def test_water_of_a_sight_lies_between_the_two_kinds():
    """ITU-R P.840: about 0.05 g/m^3 at 300 m of sight and 0.5 g/m^3 at 50 m."""
    rows = [r for r in published() if r["quantity"] == "liquid water"]
    assert len(rows) == 2
    for row in rows:
        water = {}
        for kind in KINDS:
            out, _, volume = mie_sums(kind, 550.0, 1.333)
            water[kind] = volume / out * 3.0 / float(row["sight_m"])  # cm^3/m^3, so g/m^3
        assert water[LidarFog.RADIATION] < float(row["published"]) < water[LidarFog.ADVECTION]


def test_fog_of_a_kind_has_the_same_sight_and_more_backscatter():
    air = lidar_air(Weather(fog_density=90.0, fog_distance=5.0))
    assert with_fog(air, LidarFog.FIXED) is air
    for kind in KINDS:
        found = with_fog(air, kind)
        assert found.fog == pytest.approx(air.fog, rel=0.03)
        assert found.fog / found.backscatter == FOGS[kind].lidar_ratio
        assert 3.0 < found.backscatter / air.backscatter < 4.0
        assert found._replace(fog=air.fog, backscatter=air.backscatter) == air


def test_small_drops_answer_less_per_extinction_than_large_ones():
    answers = [
        ReturnModel(with_fog(lidar_air(Weather(fog_density=85.0)), kind), 100.0).air.fog_power
        for kind in (LidarFog.FIXED, LidarFog.RADIATION, LidarFog.ADVECTION)
    ]
    assert 0.0 < answers[0] < answers[1] < answers[2]


def test_water_reflects_two_percent_at_right_angles_and_all_at_a_graze():
    assert 1.0 - water_transmission(np.array(1.0)) == pytest.approx(
        ((INDEX - 1) / (INDEX + 1)) ** 2
    )
    assert water_transmission(np.array(1e-6)) == pytest.approx(0.0, abs=1e-4)
    brewster = np.arctan(INDEX)  # where light of one polarisation enters whole
    across = (np.sin(brewster - (pi / 2 - brewster))) ** 2  # Fresnel's sine law, of the other
    assert 1.0 - water_transmission(np.cos(brewster)) == pytest.approx(0.5 * across)


def test_evenly_spread_light_is_reflected_as_the_integral_says():
    cosine = (np.arange(20_000) + 0.5) / 20_000
    mean = 2.0 * ((1.0 - water_transmission(cosine)) * cosine).mean()
    assert mean == pytest.approx(DIFFUSE, abs=5e-4)


def rays_through_water(rho, cosine, n, rng):
    """Share of light that comes back near the way it went in, by rays; over that of dry ground."""
    inside = np.sqrt(1.0 - (1.0 - cosine**2) / INDEX**2)
    weight, found = float(water_transmission(np.array(cosine))), 0.0
    for _ in range(12):
        weight *= rho
        up = np.sqrt(rng.random(n))  # cosine of a Lambertian ray in water
        sine = INDEX * np.sqrt(1.0 - up**2)
        out = np.where(sine < 1.0, np.sqrt(np.maximum(1.0 - sine**2, 0.0)), 0.0)
        through = np.where(sine < 1.0, water_transmission(out), 0.0)
        near = np.abs(up - inside) < 0.005
        found += weight * (through * near).mean() / (2.0 * INDEX**2 * 0.01 * inside)
        weight *= 1.0 - through.mean()
    return found / rho


@pytest.mark.parametrize("cosine", [0.9, 0.6, 0.3])
def test_ground_under_water_by_rays(cosine):
    """Rays that enter, spread, leave or are thrown back, against the closed form."""
    found = rays_through_water(0.3, cosine, 400_000, np.random.default_rng(3))
    assert found == pytest.approx(float(wet_ground(0.3, np.array(cosine))), rel=0.05)


def test_wet_ground_is_darker_and_lost_at_a_graze():
    """Seen from above 0.4 to 0.7 of dry (as albedo: Lekner and Dorf 1988); at 1.8 m over 30 m a tenth."""
    assert 0.4 < wet_ground(0.1, np.array(1.0)) < 0.7
    grazing = wet_ground(0.1, np.array(1.8 / 30.0))
    assert 0.03 < grazing < 0.15
    cosines = np.linspace(0.01, 1.0, 100)
    assert (np.diff(wet_ground(0.1, cosines)) > 0.0).all()
    assert (water_cover(0.0), water_cover(0.6), water_cover(3.0)) == (0.0, pytest.approx(0.5), 1.0)


def reach_of(label, *, cover=0.0, cosine=1.0, window=1.0):
    """Farthest distance in m at which a lidar of 100 m finds a surface."""
    distance = np.arange(2.0, 100.0, 0.05)
    n = len(distance)
    found = find_returns(
        ReturnModel(LidarAir(), 100.0, cover).air,
        distance, np.full(n, label), np.full(n, cosine), window, np.uint64(1), 0, no_spray(),
    )  # fmt: skip
    return float(distance[np.isfinite(found.distance)].max())


def test_a_lidar_finds_wet_ground_less_far_and_cars_as_far():
    """Power falls with the square of distance, so the reach with the root of what water leaves."""
    dry = reach_of(ROAD)
    assert dry == pytest.approx(100.0 * (ON_GROUND / WHITE) ** 0.5, abs=0.1)
    for cosine in (1.0, 0.25, 0.0625):
        left = float(wet_ground(ON_GROUND, np.array(cosine)))
        assert reach_of(ROAD, cover=1.0, cosine=cosine) == pytest.approx(dry * left**0.5, abs=0.1)
    assert reach_of(CAR, cover=1.0, cosine=0.1) == reach_of(CAR)


def test_half_a_window_halves_the_reach():
    assert window_loss(0.5, 0.0, 30.0, 10.0) == pytest.approx(0.25)
    assert reach_of(CAR, window=0.25) == pytest.approx(0.5 * reach_of(CAR), abs=0.1)


def test_drops_on_the_window_are_those_on_a_lens():
    share = wetted_share(25.0, 20.0, 3.0)
    assert window_loss(0.0, 25.0, 20.0, 3.0) == pytest.approx((1.0 - share) ** 2)
    assert window_loss(0.0, 25.0, 20.0, 0.0) == window_loss(0.0, 0.0, 20.0, 3.0) == 1.0


def test_dim_window_leaves_intensity_by_its_loss():
    model, n = ReturnModel(LidarAir(), 100.0), 200
    arrays = (np.full(n, 20.0), np.full(n, CAR), np.ones(n))
    clean = find_returns(model.air, *arrays, 1.0, np.uint64(1), 0, no_spray())
    dim = find_returns(model.air, *arrays, 0.3, np.uint64(1), 0, no_spray())
    assert dim.intensity == pytest.approx(0.3 * clean.intensity)
    assert np.std(dim.distance) > np.std(clean.distance)


def test_range_noise_is_that_of_a_data_sheet_in_its_middle_ranges():
    """A 905 nm lidar of 100 m range is sold with an accuracy of 3 cm; ours is 2.6 cm at 30 m."""
    n = 4000
    found = ReturnModel(LidarAir(), 100.0).measure(np.full(n, 30.0), np.full(n, CAR), 1)
    assert 0.02 < np.std(found.distance) < 0.03
