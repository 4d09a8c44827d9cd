"""`skidpad carla-server --govern`: an ego of any client stays inside the envelope; others are left alone."""

import pytest

from skidpad.campaign.driving.served_egos import SERVED, GovernedEgos
from skidpad.core.errors import ConfigError
from skidpad.core.vocabulary import Govern
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.vehicles.control import Control

CAR = "vehicle.mini.cooper_s"


def place_car(served, role, index):
    """A car with this role at a spawn point."""
    point = served.episode.map.spawn_points[index]
    actor = served.episode.spawn(Wanted(CAR, {"role_name": role}), point)
    return served.episode.vehicles.of(actor.id)


def speed_of(served, vehicle):
    s, i = served.episode.moving.fleet.states, served.episode.vehicles.row(vehicle.actor)
    return float((s.vx[i] ** 2 + s.vy[i] ** 2) ** 0.5)


def drive(served, role, seconds=18.0):
    """The speed in m/s after some time of full throttle on ice, whose grip allows some 13.5 m/s."""
    served.episode.sky.set_ice(30.0)
    served.before_tick = GovernedEgos(Govern.ENVELOPE, 1)
    vehicle = place_car(served, role, 0)
    for _ in range(round(seconds / 0.05)):
        vehicle.control = Control(throttle=1.0)
        served.tick()
    return speed_of(served, vehicle)


@pytest.mark.parametrize(("role", "is_held"), [("hero", True), ("autopilot", False)])
def test_an_ego_of_a_client_is_held_back_on_ice_and_other_vehicles_are_not(served, role, is_held):
    v = drive(served, role)
    (vehicle,) = served.episode.vehicles
    assert (vehicle.most_throttle < 1.0 or vehicle.least_brake > 0.0) is is_held
    assert (v < 14.5) is is_held, v


def test_it_adds_brake_and_takes_throttle_and_never_the_reverse(served):
    vehicle = place_car(served, "hero", 0)
    for most, least, throttle, brake in ((0.3, 0.0, 0.8, 0.1), (1.0, 0.5, 0.2, 0.7)):
        vehicle.most_throttle, vehicle.least_brake = most, least
        vehicle.control = Control(throttle=throttle, brake=brake, steer=0.4)
        got = vehicle.command(speed=10.0, mu=1.0, dt=0.05)
        assert got[0] == min(throttle, most)
        assert got[1] == max(brake, least)
        assert got[2] == 0.4


def test_watching_holds_nothing_back_and_a_new_episode_begins_anew(served):
    egos = served.before_tick = GovernedEgos(Govern.WATCH, 1)
    vehicle = place_car(served, "ego_vehicle", 0)
    for _ in range(5):
        vehicle.control = Control(throttle=1.0)
        served.tick()
    assert (vehicle.most_throttle, vehicle.least_brake) == (1.0, 0.0)
    assert egos.egos[vehicle.actor].stack.allowed.speed > 0.0
    served.load("", reset_settings=False)
    served.tick()
    assert egos.egos == {}


@pytest.mark.parametrize("govern", [g for g in Govern if g not in SERVED])
def test_what_a_server_cannot_give_is_refused_in_a_sentence(govern):
    with pytest.raises(ConfigError, match="--govern"):
        GovernedEgos(govern, 1)
