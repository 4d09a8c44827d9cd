"""A radar with an equation: against published laws, by hand, and by what a cell cannot tell apart."""

import csv
from dataclasses import replace
from math import degrees, hypot, log10, pi, radians, tan
from pathlib import Path
from time import process_time

import numba
import numpy as np
import pytest

from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import ActorKind, RadarModel, RangeModel, SensorLevel
from skidpad.core.weather import Weather
from skidpad.physics.optics import rain_attenuation_db_km
from skidpad.physics.radio import (
    film_loss_db,
    mie_efficiencies,
    rain_scatter,
    water_permittivity,
    wet_radome_db,
)
from skidpad.roads.roadside import Barrier, BarrierKind, Box, Roadside
from skidpad.sensors.physical_radar import setup as radar_setup
from skidpad.sensors.physical_radar.cells import (
    AVERAGED,
    UNKNOWN,
    Noise,
    bound_powers,
    cfar_threshold,
    make_cells,
    noise_mean,
    power_of,
    snr_for,
)
from skidpad.sensors.physical_radar.echoes import lobe_section
from skidpad.sensors.physical_radar.radar import PhysicalRadar
from skidpad.sensors.physical_radar.targets import BACK, FRONT, LEFT
from support.sensors.cars import RADAR, world
from support.sensors.driven_radar import measured

HEAVY = Weather(precipitation=50.0)  # 25 mm/h
TABLE = Path(__file__).parents[2] / "docs" / "radar-weather.csv"


def detections(*others, roadside=None, weather=None, ticks=20, speeds=None, **table_fields):
    """Detections of all ticks: rows of range, azimuth, altitude and range rate, one array a tick."""
    table, states = world(*others)
    table = replace(table, **table_fields)
    if speeds is not None:
        states.vx[1:] = speeds
    radar = PhysicalRadar(RADAR, roadside or Roadside(), table, 1, weather)
    return [np.column_stack(radar.measure(k, states)).copy() for k in range(ticks)]


def found_share(distance, ticks=100, **options):
    """Share of ticks in which a car ahead is found; distance: m from antenna to its rear."""
    rows = detections((2.0 + 2.25 + distance, 0.0, 0.0, 0.0), ticks=ticks, **options)
    return float(np.mean([np.any(abs(r[:, 0] - distance) < 1.0) for r in rows]))


@pytest.mark.parametrize("rate", [1.0, 5.0, 12.5, 25.0, 50.0, 100.0])
@pytest.mark.parametrize("ghz", [30.0, 77.0, 94.0])
def test_drops_take_what_the_recommendation_says(rate, ghz):
    # not fitted: Mie spheres of the Marshall-Palmer spectrum against ITU-R P.838-3
    assert rain_scatter(rate, ghz)[0] == pytest.approx(rain_attenuation_db_km(rate, ghz), rel=0.3)


def test_small_and_large_spheres_return_what_rayleigh_and_optics_say():
    index = np.sqrt(water_permittivity(77.0))
    x = np.array([0.01])
    rayleigh = 4.0 * abs((index**2 - 1.0) / (index**2 + 2.0)) ** 2 * x**4
    assert mie_efficiencies(x, index)[1] == pytest.approx(rayleigh, rel=1e-3)
    extinct, back = mie_efficiencies(np.array([60.0]), 50.0 + 50.0j)  # nearly metal
    assert extinct == pytest.approx(2.0, rel=0.02)
    assert back == pytest.approx(abs((49.0 + 50.0j) / (51.0 + 50.0j)) ** 2, rel=0.02)


def test_a_film_of_water_takes_what_was_published():
    # "over 5 dB may occur at water film thickness of 0.15mm and radio frequency of 12GHz" (HIREC)
    assert 5.0 < film_loss_db(0.15e-3, 12.0) < 6.5
    assert film_loss_db(0.0, 77.0) == pytest.approx(0.0, abs=1e-12)
    assert wet_radome_db(25.0, 0.0, 77.0) == pytest.approx(0.0, abs=1e-12)
    assert 0.0 < wet_radome_db(5.0, 30.0, 77.0) < wet_radome_db(25.0, 30.0, 77.0)


def test_threshold_keeps_the_rate_of_false_alarms_and_finds_what_theory_says():
    cells = make_cells()

    @numba.njit
    def shares(cells, aims, clutter, threshold, snr, echoes):
        passed = found = 0
        n = len(echoes)
        for k, echo in enumerate(echoes):
            noise = Noise(np.uint64(6), k, 0.1, aims, clutter, clutter)
            mean = noise_mean(cells, noise, 250, 10_000_100 + 3 * k, 0.0, np.uint64(7))
            passed += echo > threshold * mean
            found += echo * (1.0 + snr) > threshold * mean
        return passed / n, found / n

    # P_FA 1e-3 can be counted; Swerling 1 by IEEE AES-14 (1978), 44: M 16, P_D 0.9
    false, detected = 1e-3, 0.9
    one, other = shares(
        cells,
        np.zeros((1, 3)),
        np.zeros(250),
        cfar_threshold(false),
        snr_for(detected, false),
        np.random.default_rng(1).exponential(size=200_000),
    )
    assert one == pytest.approx(false, rel=0.25)
    assert other == pytest.approx(detected, abs=0.01)
    assert AVERAGED == 16


def test_sections_are_those_of_the_table_at_the_middle_of_each_lobe():
    section = lobe_section.py_func
    assert 10 * log10(section(BACK, 180.0, 79.65)) == pytest.approx(13.90)
    assert 10 * log10(section(FRONT, 0.0, 71.75)) == pytest.approx(14.99)
    assert 10 * log10(section(LEFT, 90.0 + 26.90 / 2.0, 79.70)) == pytest.approx(20.60 - 3.0)
    assert 10 * log10(section(LEFT, -90.0, 79.70)) == pytest.approx(20.60 - 20.52)


def test_the_equation_by_hand():
    setup = radar_setup.setup_of(RADAR, np.uint64(1), None)
    snr = setup.factor * 10.0 / RADAR.range**4
    assert snr == pytest.approx(((0.9 / 1e-8) ** (1 / 16) - 1) / (1 - 0.9 ** (1 / 16)))
    wet = radar_setup.setup_of(RADAR, np.uint64(1), HEAVY)
    lost = 2.0 * rain_attenuation_db_km(25.0) * 0.150  # dB to 150 m and back
    assert 10.0 * wet.air.loss * 150.0 / np.log(10.0) == pytest.approx(lost)
    # clutter of rain in the cell at 60 m: eta times its volume, over the noise, by Doppler cells
    width = radians(30.0) * np.sqrt(pi / (32.0 * np.log(2.0)))
    volume = 0.6 * 60.0**2 * radians(1.4) * width
    noise = 60.0**4 / setup.factor * 10.0 ** (2.0 * rain_attenuation_db_km(25.0) * 0.06 / 10.0)
    share = (0.53 / 3.6) / 2.0
    expected = rain_scatter(25.0, 77.0)[1] * volume * share / noise
    assert wet.air.rain[100] == pytest.approx(expected, rel=1e-6)


def test_a_car_is_found_where_it_is_and_as_it_moves():
    rows = detections((42.0, 3.0, 0.0, 0.0), speeds=[-8.0], ticks=60)
    ahead, left = 42.0 - 2.25 - 2.0, 3.0
    near = [r[np.argmin(abs(r[:, 0] - hypot(ahead, left)))] for r in rows if len(r)]
    assert len(near) == 60
    mean = np.mean(near, axis=0)
    assert mean[0] == pytest.approx(hypot(ahead, left), abs=0.15)
    assert degrees(mean[1]) == pytest.approx(degrees(np.arctan2(left, ahead)), abs=0.15)
    assert mean[2] == pytest.approx(-0.25 / ahead, abs=0.003)  # 0.75 m high, seen from 1 m
    assert mean[3] == pytest.approx(-8.0 * ahead / hypot(ahead, left), abs=0.03)


def test_farther_and_in_rain_it_is_found_less_often():
    shares = [found_share(d) for d in (40.0, 100.0, 140.0)]
    assert shares[0] == 1.0
    assert shares[0] >= shares[1] >= shares[2] > 0.5
    flood = Weather(precipitation=100.0)
    assert found_share(140.0, weather=flood) < shares[2] - 0.1
    assert found_share(160.0) == 0.0  # beyond its range


def test_people_return_less_than_cars():
    kinds = np.array([ActorKind.CAR, ActorKind.PEDESTRIAN], dtype=np.uint8)
    assert found_share(60.0, kind=kinds) > 0.95
    assert found_share(140.0, kind=kinds) < found_share(140.0) - 0.2


def count_near(rows, distance):
    return np.mean([np.sum(abs(r[:, 0] - distance) < 1.0) for r in rows])


def test_a_cell_tells_no_two_apart_and_its_neighbours_do():
    at = 40.0 + 4.25
    beside = 40.0 * tan(radians(1.4)) * 4.0
    apart = detections((at, 0.0, 0.0, 0.0), (at, beside, 0.0, 0.0))
    assert count_near(apart, 40.0) > 1.8  # by angle
    # two people at one place are one; with 1 m/s between them they are two
    kinds = np.array([ActorKind.CAR, *[ActorKind.PEDESTRIAN] * 2], dtype=np.uint8)
    people = {
        "kind": kinds,
        "length": np.array([4.5, 0.1, 0.1]),
        "width": np.array([1.8, 0.1, 0.1]),
    }
    places = ((42.1, 0.0, 0.0, 0.0), (42.1, 0.3, 0.0, 0.0))
    assert count_near(detections(*places, **people), 40.0) < 1.1
    assert count_near(detections(*places, speeds=[0.0, 1.0], **people), 40.0) > 1.8


def test_what_is_hidden_is_not_found():
    tall = np.array([1.5, 3.5, 1.5])
    rows = detections((30.0, 0.0, 0.0, 0.0), (60.0, 0.0, 0.0, 0.0), height=tall)
    assert count_near(rows, 30.0 - 4.25) > 0.9
    assert count_near(rows, 60.0 - 4.25) == 0.0
    wall = Barrier(BarrierKind.WALL, np.array([[20.0, -5.0, 0.0], [20.0, 5.0, 0.0]]), 3.0)
    rows = detections((60.0, 0.0, 0.0, 0.0), roadside=Roadside(barriers=(wall,)))
    assert count_near(rows, 60.0 - 4.25) == 0.0


def test_rails_and_gantries_are_found_as_standing_and_high():
    rail = Barrier(BarrierKind.GUARDRAIL, np.array([[0.0, 4.0, 0.0], [80.0, 4.0, 0.0]]), 0.75)
    beam = Box(20, 60.0, 0.0, 5.5, 0.0, 0.5, 12.0, 0.8)
    table, states = world()
    states.vx[0] = 20.0
    radar = PhysicalRadar(RADAR, Roadside(barriers=(rail,), boxes=(beam,)), table, 1)
    rows = np.concatenate([np.column_stack(radar.measure(k, states)) for k in range(10)])
    side = rows[:, 0] * np.sin(rows[:, 1])
    posts = rows[abs(side - 4.0) < 0.5]
    assert len(posts) > 30
    assert posts[:, 3] == pytest.approx(-20.0 * np.cos(posts[:, 1]), abs=0.3)
    high = rows[(abs(rows[:, 0] - 57.8) < 1.0) & (abs(side) < 1.0)]
    assert len(high) >= 8
    assert np.mean(high[:, 2]) > 0.08  # the stack's window ends below


def test_empty_road_gives_false_alarms_as_rarely_as_set(monkeypatch):
    monkeypatch.setattr(radar_setup, "FALSE_ALARMS", 1e-7)
    rows = detections(ticks=3000)
    cells = 250 * 22 * 2 * (133.0 / 3.6) / (0.53 / 3.6)
    assert sum(map(len, rows)) == pytest.approx(3000 * -np.expm1(-cells * 1e-7), rel=0.15)


def test_the_same_seed_and_tick_give_the_same_bytes_whatever_came_before():
    table, states = world((40.0, 0.0, 0.0, 0.0), (60.0, 3.0, 0.0, 0.2))
    one, other = (PhysicalRadar(RADAR, Roadside(), table, 5) for _ in range(2))
    for k in range(5):
        one.measure(k, states)
    again = [np.column_stack(r.measure(7, states)).tobytes() for r in (one, other)]
    assert again[0] == again[1]
    third = PhysicalRadar(RADAR, Roadside(), table, 6)
    assert np.column_stack(third.measure(7, states)).tobytes() != again[0]


def radar_bytes(frame):
    return np.column_stack(frame.radar).tobytes()


def test_both_levels_and_the_switch():
    frames = {}
    for name, options in {
        "objects": {},
        "pixels": {"level": SensorLevel.PIXELS},
        "geometric": {"model": RadarModel.GEOMETRIC},
        "no weather": {"range": RangeModel.NONE.value},
    }.items():
        backend, frame = measured(**options)
        frames[name] = radar_bytes(frame)
        backend.close()
    assert frames["objects"] == frames["pixels"]
    assert frames["objects"] != frames["geometric"]
    assert frames["objects"] != frames["no weather"]


def test_a_tick_costs_at_most_four_times_one_with_the_geometric_radar():
    backends = {m: measured(model=m)[0] for m in RadarModel}
    best = dict.fromkeys(RadarModel, np.inf)
    for _ in range(5):
        for model, backend in backends.items():
            begin = process_time()
            for _ in range(40):
                frame = backend.step(VehicleCommand(throttle=0.3))
                _ = frame.segments, frame.radar
            best[model] = min(best[model], process_time() - begin)
    assert best[RadarModel.PHYSICAL] < 4.0 * best[RadarModel.GEOMETRIC]


def test_bounds_hold_the_power_that_is_drawn():
    """Over a million cells: a bound on the wrong side would drop a detection without a trace."""
    cells, aims = make_cells(), np.zeros((1, 3))
    aims[:, 2] = 1.0
    clutter = np.linspace(0.0, 5.0, 2048)

    @numba.njit
    def count_wrong(cells, aims, clutter, ticks):
        wrong, tight = 0, 0.0
        n = len(cells.number)
        cells.reached[0] = n
        for k in range(n):
            cells.number[k] = k
            cells.re[k] = 0.01 * (k % 500)
        for tick in range(ticks):
            noise = Noise(np.uint64(3), tick, 0.1, aims, clutter, clutter)
            cells.power[:] = UNKNOWN
            bound_powers(cells, noise)
            for k in range(n):
                amplitude = np.sqrt(power_of(cells, noise, k))
                wrong += not cells.fewest[k] <= amplitude <= cells.most[k]
                tight = max(tight, amplitude / cells.most[k])
        return wrong, tight

    wrong, tight = count_wrong(cells, aims, clutter, 128)
    assert wrong == 0
    assert tight > 0.99


def test_the_page_shows_this_model():
    rows = list(csv.DictReader(TABLE.open()))
    row = next(r for r in rows if (r["rain_mm_h"], r["speed_km_h"]) == ("25", "100"))
    assert float(row["itu_p838_3_db_km"]) == pytest.approx(rain_attenuation_db_km(25.0), abs=0.01)
    assert float(row["mie_db_km"]) == pytest.approx(rain_scatter(25.0, 77.0)[0], abs=0.01)
    dry = next(r for r in rows if r["weather"] == "dry")
    assert float(dry["car_rear_m"]) > float(row["car_rear_m"])
