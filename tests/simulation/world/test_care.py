"""What drivers count upon: never more than the road has, and in the dry what they always did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from skidpad.campaign.bench.traffic import measure
from skidpad.campaign.bench.traffic_options import TrafficBench
from skidpad.core.maths.constants import G
from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.states import ActorStates
from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import left_at, mu_at
from skidpad.physics.optics import depth_range, sight, transmission
from skidpad.physics.presets import find_weather
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import load_map
from skidpad.simulation.world.placed import places_for
from skidpad.simulation.world.traffic import care as care_
from skidpad.simulation.world.traffic.care import Care, care_of, careless
from skidpad.simulation.world.traffic.idm import A_CURVE, Character
from skidpad.simulation.world.traffic.manager import room
from skidpad.simulation.world.traffic.occupancy import NOBODY, add, find_behind, occupancy
from skidpad.simulation.world.traffic.streets import network_of

MAP = load_map("figure8")
assert MAP.ego_start is not None
EGO = ActorSetup(name="ego", type=EGO_TYPE, place=MAP.ego_start)
DRY, WET, WHITE, ICY = (find_weather(n) for n in ("clear-noon", "rain-noon", "snow", "icy_30"))


def minding(weather: Weather) -> Care:
    setup = Setup(map="figure8", weather=weather, specs=(), ego=EGO, grip=GripModel.PHYSICAL)
    return care_of(setup, slow_in_weather=True)


SPEEDS = st.floats(0.0, 40.0)


@given(v=SPEEDS, weather=st.sampled_from([DRY, WET, WHITE, ICY]))
def test_nobody_counts_on_more_than_the_road_has(v: float, weather: Weather) -> None:
    care = minding(weather)
    most = G * mu_at(care.grip, v)
    c = care_.character(care, v, 1.5, 1.4)
    assert 0.0 < c.a_max <= most
    assert 0.0 < c.b < -c.a_min < most
    assert c.headway >= 1.5
    assert care_.steering_limit(care, v) < most
    assert care_.traction_limit(care, v, 0.6, 0.0) < 0.6 * most
    assert 0.4 < care_.speed_choice(care, v) <= 1.0


@given(v=SPEEDS)
def test_a_dry_road_changes_nothing_but_manners(v: float) -> None:
    here, there = minding(DRY), careless()
    follows = care_.character(here, v, 1.5, 1.4)
    assert follows[:3] == pytest.approx(Character()[:3], rel=0.03)  # at 36 m/s tyres have less
    # not the tyres' all
    assert follows.a_min == pytest.approx(-care_.HARDEST_SHARE * G * mu_at(here.grip, v))
    assert care_.braking(here, v) == pytest.approx(care_.braking(there, v), rel=0.03)
    assert care_.speed_choice(here, v) == 1.0
    assert care_.bend_speed_sq(here, 0.01, A_CURVE) == pytest.approx(A_CURVE / 0.01)
    assert care_.sight_speed(here, v) > 30.0


@given(v=SPEEDS, curvature=st.floats(0.001, 0.05))
def test_careless_drivers_know_no_weather(v: float, curvature: float) -> None:
    care = careless()
    assert care_.character(care, v, 1.5, 1.4) == Character()
    assert care_.sight_speed(care, v) == np.inf
    assert care_.bend_speed_sq(care, -curvature, A_CURVE) == pytest.approx(A_CURVE / curvature)
    assert care_.traction_limit(care, v, 0.6, 1.0) == np.inf
    assert care_.reach(care, v, 25.0) == 25.0


@given(curvature=st.floats(0.002, 0.05), weather=st.sampled_from([WET, WHITE, ICY]))
def test_bends_take_their_share_of_the_grip_at_that_very_speed(
    curvature: float, weather: Weather
) -> None:
    care = minding(weather)
    v_sq = care_.bend_speed_sq(care, curvature, 100.0)  # no other bound
    left = left_at(care.grip, float(np.sqrt(v_sq))) * care.grip.mu_ref  # of a dry road's
    share = v_sq * curvature / (G * left)
    assert 0.85 * care_.CURVE_SHARE < share <= care_.CURVE_SHARE * (1.0 + 1e-9)


@given(weather=st.sampled_from([DRY, WET, WHITE, ICY]), v=st.floats(1.0, 30.0))
def test_one_stops_within_sight(weather: Weather, v: float) -> None:
    care = minding(weather)._replace(sight=60.0)
    most = care_.sight_speed(care, v)
    braking = care_.FIRM_SHARE * G * mu_at(care.grip, v)
    assert most * care_.REACTION + most**2 / (2.0 * braking) == pytest.approx(50.0)


def test_fog_slows_whoever_minds_it() -> None:
    clear, fog = minding(DRY), minding(replace(DRY, fog_density=100.0))
    assert care_.sight_speed(fog, 20.0) < 0.7 * care_.sight_speed(clear, 20.0)


@given(
    fog=st.floats(0.0, 100.0),
    rain=st.floats(0.0, 100.0),
    begins=st.sampled_from([0.0, 20.0, 200.0]),
)
def test_sight_is_that_of_the_air_that_the_sensors_look_through(
    fog: float, rain: float, begins: float
) -> None:
    weather = replace(DRY, fog_density=fog, precipitation=rain, fog_distance=begins)
    seen = minding(weather).sight
    assert transmission(weather, seen) == pytest.approx(0.05)
    assert seen > depth_range(weather)  # a car's contrast is half of what people are taken to see
    if begins == 0.0:
        assert seen == sight(weather)


def test_fog_that_begins_far_ahead_slows_nobody() -> None:
    near, far = (
        minding(replace(DRY, fog_density=100.0, fog_distance=begins)) for begins in (0.0, 200.0)
    )
    assert care_.sight_speed(far, 20.0) == care_.sight_speed(minding(DRY), 20.0)
    assert care_.sight_speed(near, 20.0) < 20.0


@pytest.mark.parametrize(("slide", "share"), [(0.0, 1.0), (0.017, 1.0), (0.04, 0.5), (-0.07, 0.0)])
def test_who_feels_the_tail_step_out_lifts(slide: float, share: float) -> None:
    care = minding(ICY)
    full = care_.traction_limit(care, 8.0, 0.4, 0.0)
    assert care_.traction_limit(care, 8.0, 0.4, slide) == pytest.approx(share * full)


def test_room_lets_the_faster_one_brake_down_to_the_slower_one() -> None:
    states = ActorStates.empty(2)
    states.vx[:] = 0.0, 20.0
    care = minding(WHITE)
    standing, alike = room(care, 20.0, states)
    b = care_.FIRM_SHARE * G * mu_at(care.grip, 20.0)
    assert standing == pytest.approx(10.0 + 20.0 + 400.0 / (2.0 * b))
    assert alike == pytest.approx(45.0)
    assert (room(careless(), 20.0, states) == 45.0).all()


def test_on_ice_a_town_is_driven_without_a_scratch() -> None:
    # tight corners at walking speed; before, cars ran wide there, in 545 of 1000 km off the road
    row = measure(TrafficBench(map="town", km=60.0, vehicles=60), "icy_30")
    assert row.km >= 60.0
    assert (row.contacts, row.static) == (0, 0)


def test_who_comes_from_a_joining_lane_is_seen_behind() -> None:
    net = network_of(MAP)
    lane = int(np.flatnonzero((net.lane["prevs"] > 1) & (net.lane["behind"] >= 0))[0])
    row = net.lane[lane]
    joining = [int(p) for p in net.prev_lane[row["prev_first"] :][: row["prevs"]]]
    other = next(p for p in joining if p != row["behind"])
    occ, placed = occupancy(len(net.lane), 2), places_for(np.full(2, 4.0), np.full(2, 1.8))
    assert find_behind(net, occ, placed, lane, 5.0, 0, 120.0) == (NOBODY, np.inf)
    add(occ, 1, other, net.lane[other]["length"] - 10.0)
    assert find_behind(net, occ, placed, lane, 5.0, 0, 120.0) == (1, pytest.approx(11.0))
