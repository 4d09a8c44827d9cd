"""What the adapter makes of the client's objects: wheels, traffic lights, the Traffic Manager."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from skidpad.core.setup import Setup
from skidpad.core.vocabulary import GripModel, LightState
from skidpad.core.weather import Weather
from skidpad.simulation.carla.grip import prepare_grip
from skidpad.simulation.carla.session import TrafficLights
from skidpad.simulation.carla.traffic import Traffic


class Wheel(SimpleNamespace):
    """A wheel of the client: one friction, and properties that nothing may change."""


@dataclass
class Vehicle:
    """A vehicle as the client has it: physics are read as a copy and applied whole."""

    id: int
    frictions: tuple[float, ...]
    type_id: str = "vehicle.a"
    mass: float = 1500.0

    def get_physics_control(self):
        wheels = [Wheel(tire_friction=f, radius=31.0) for f in self.frictions]
        return SimpleNamespace(wheels=wheels, mass=self.mass)

    def apply_physics_control(self, control):
        self.frictions = tuple(w.tire_friction for w in control.wheels)
        self.mass = control.mass
        assert [w.radius for w in control.wheels] == [31.0] * len(control.wheels)


def grip_of(weather: Weather, model: GripModel):
    """How weather reaches tyres on a server without our blueprint."""
    setup = Setup(map="figure8", weather=weather, specs=(), ego=None, grip=model)
    return prepare_grip(None, SimpleNamespace(get_blueprint_library=list), setup)


@pytest.mark.req("B-063", "B-064", "B-067")
def test_every_wheel_is_scaled_once_however_often_it_is_asked():
    """Wheels of different friction keep their proportions; 0.3 is the model's value for full rain."""
    grip = grip_of(Weather(wetness=100.0, precipitation_deposits=100.0), GripModel.STATISTICAL)
    car, truck = Vehicle(1, (3.5, 3.5, 3.0, 3.0)), Vehicle(2, (2.0,) * 6)
    for vehicle in (car, truck, car):
        grip.apply(vehicle)
    assert car.frictions == pytest.approx((1.05, 1.05, 0.9, 0.9))
    assert truck.frictions == pytest.approx((0.6,) * 6)
    assert (car.mass, truck.mass) == (1500.0, 1500.0)
    assert [grip.scale(actor) for actor in (1, 2, 3)] == pytest.approx([3.25 / 3.5, 2.0 / 3.5, 1.0])
    assert all("x 0.3000 = " in notice for notice in grip.notices)


@pytest.mark.req("B-066")
def test_without_grip_of_weather_wheels_stay_as_they_were():
    grip = grip_of(Weather(ice_thickness=100.0), GripModel.NONE)
    car = Vehicle(1, (3.5, 3.4, 3.3, 3.2))
    grip.apply(car)
    assert car.frictions == (3.5, 3.4, 3.3, 3.2)
    assert grip.notices == []


class World:
    """A world with lights, which counts how often it is asked for its actors."""

    def __init__(self) -> None:
        self.asked, self.shown = 0, {7: LightState.RED, 3: LightState.GREEN}

    def get_actors(self):
        self.asked += 1
        return SimpleNamespace(filter=lambda _: [self.light(name) for name in ("7", "3", "")])

    def light(self, name: str):
        return SimpleNamespace(
            get_opendrive_id=lambda: name, get_state=lambda: self.shown[int(name)]
        )


@pytest.mark.req("A-265")
@pytest.mark.parametrize(("cached", "asked"), [(True, 1), (False, 3)])
def test_lights_are_read_anew_from_actors_that_are_found_once(cached, asked):
    world = World()
    lights = TrafficLights(world, cached)
    assert lights.read() == {3: LightState.GREEN, 7: LightState.RED}
    world.shown[7] = LightState.YELLOW
    assert lights.read() == {3: LightState.GREEN, 7: LightState.YELLOW}
    lights.read()
    assert world.asked == asked


class Manager:
    """The state of a Traffic Manager."""

    def __init__(self) -> None:
        self.synchronous, self.seed, self.running = False, None, True

    def set_synchronous_mode(self, on: bool) -> None:
        self.synchronous = on

    def set_random_device_seed(self, seed: int) -> None:
        self.seed = seed

    def shut_down(self) -> None:
        self.running = False


@pytest.mark.req("A-211")
def test_the_traffic_manager_is_synchronous_and_seeded_by_the_run():
    def begin(seed: int):
        manager = Manager()
        client = SimpleNamespace(get_trafficmanager=lambda port: manager)
        return manager, Traffic(SimpleNamespace(carla=None, client=client), 8000, 0.05, seed)

    (one, traffic), (same, _), (other, _) = begin(5), begin(5), begin(6)
    assert one.synchronous
    assert one.seed == same.seed != other.seed
    huge, _ = begin(2**40 + 5)
    assert 0 <= huge.seed < 2**31  # the client takes 32 bits
    traffic.close()
    assert (one.synchronous, one.running) == (False, False)
