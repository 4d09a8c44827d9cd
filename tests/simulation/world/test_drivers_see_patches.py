"""Background drivers slow for what lies on the road ahead, where they are told to, and only there."""

import numpy as np
import pytest

from skidpad.core.environment.surface import SurfacePatch
from skidpad.core.setup import ActorSetup, LanePosition, Setup, TrafficSetup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control
from skidpad.core.weather import Weather
from skidpad.physics.grip import Road
from skidpad.physics.types import EGO_TYPE
from skidpad.roads.bundled import load_map
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.world.patches import Patches
from skidpad.simulation.world.traffic.care import care_of, sight_speed, speed_choice

ROAD = load_map("straight")
PLACE = ROAD.project(*(float(v[500]) for v in (ROAD.samples.x, ROAD.samples.y, ROAD.samples.z)))
S = ROAD.s_road(PLACE)
CLEAR = Weather()
ICE = SurfacePatch(ice_mm=3.0, road=PLACE.road, s=(S - 200.0, S - 150.0))
WATER = SurfacePatch(water_mm=2.0, road=PLACE.road, s=(S - 200.0, S - 150.0))


def drive(*surface, sees=True, minds=True, seconds=22.0, weather=CLEAR):
    """Way along its lane in m, against the road, and speed in m/s of a background car, tick by tick."""
    lane = int(ROAD.lanes.lane_id[PLACE.lane])
    place = LanePosition(PLACE.road, lane, S)
    back = LanePosition(PLACE.road, lane, S + 100.0)
    setup = Setup(
        map="straight", weather=weather, specs=(), patches=surface,
        ego=ActorSetup(name="ego", type=EGO_TYPE, place=back),
        actors=(
            ActorSetup(name="car", type="hatchback", place=place, speed=20.0, driver=Control.AUTOPILOT),
        ),
        traffic=TrafficSetup(vehicles=0, slow_in_weather=minds, sees_patches=sees),
    )  # fmt: skip
    backend = EmbeddedBackend()
    backend.reset(setup, 1)
    found = []
    for _ in range(round(seconds / 0.05)):
        backend.step(VehicleCommand(brake=1.0))
        s = backend.truth().states
        here = ROAD.project(float(s.x[1]), float(s.y[1]), float(s.z[1]))
        found.append((S - ROAD.s_road(here), float(np.hypot(s.vx[1], s.vy[1]))))
    backend.close()
    return np.array(found)


def speed_at(found, way):
    return float(np.interp(way, found[:, 0], found[:, 1]))


def test_a_driver_is_slower_on_ice_that_it_sees_and_as_fast_again_behind_it():
    blind, seeing = drive(ICE, sees=False), drive(ICE)
    assert speed_at(seeing, 40.0) == pytest.approx(speed_at(blind, 40.0), abs=0.3)
    assert speed_at(seeing, 152.0) < 0.75 * speed_at(blind, 152.0)
    assert speed_at(seeing, 320.0) > 1.2 * speed_at(seeing, 180.0)


def test_it_slows_as_the_factor_of_friction_says():
    road = Road(Weather(), Setup.__dataclass_fields__["grip"].default)
    share = float(Patches(ROAD, [ICE], road).lane_shares().min())
    setup = Setup(map="straight", weather=CLEAR, specs=(), ego=None)
    v, limit = (speed_at(found, 195.0) for found in (drive(ICE), drive(sees=False)))
    wanted = limit * speed_choice(care_of(setup, slow_in_weather=True), v, share)
    assert wanted < v < 1.2 * wanted  # it still slows, as little as ice lets it


@pytest.mark.parametrize(
    ("surface", "options"), [((), {}), ((ICE,), {"minds": False}), ((ICE,), {"sees": False})]
)
def test_without_patches_without_care_and_unseen_nothing_changes(surface, options):
    plain = drive(*surface, **{**options, "sees": False}, seconds=6.0)
    assert np.array_equal(drive(*surface, **{"sees": True, **options}, seconds=6.0), plain)


def test_materials_and_sheet_flow_are_part_of_what_drivers_see():
    """They reach the tyres through the same shares as patches do."""
    road = Road(Weather(), Setup.__dataclass_fields__["grip"].default)
    key = (PLACE.road, int(ROAD.lanes.lane_id[PLACE.lane]))
    shares = Patches(ROAD, [], road, {key: [(S - 200.0, S - 150.0, 0.5)]}).lane_shares()
    here = ROAD.samples.lane == PLACE.lane
    assert set(shares[~here]) == {1.0}
    assert set(shares[here]) == {0.5, 1.0}


@pytest.mark.parametrize("begins", [0.0, 200.0])
def test_in_fog_it_drives_as_fast_as_it_can_stop_within_sight(begins):
    fog = Weather(fog_density=100.0, fog_distance=begins)
    clear, v = (drive(weather=w)[-1, 1] for w in (Weather(), fog))
    care = care_of(Setup(map="straight", weather=fog, specs=(), ego=None), slow_in_weather=True)
    if begins:
        assert v == clear
    else:
        assert v < 0.9 * clear
        assert v == pytest.approx(sight_speed(care, v), abs=0.3)


def test_deep_water_is_seen_too():
    seen = drive(WATER)
    assert speed_at(seen, 160.0) < 0.95 * speed_at(drive(WATER, sees=False), 160.0)
