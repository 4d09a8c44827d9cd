"""What vehicles run into, and what they roll over."""

from __future__ import annotations

import pytest

from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.spawning import spawn
from skidpad.simulation.carla_server.world import World

V = 10.0  # m/s
AHEAD = 12.0  # m


def passed(world: World, prop: str) -> tuple[float, list[int]]:
    """Speed after a car has met a prop on its lane, and who touched whom."""
    place = world.map.spawn_points[0]
    car: Actor = spawn(world, [0, "vehicle.tesla.model3", []], place)
    thing = spawn(world, [0, prop, []], place.moved(forward=AHEAD))
    world.vehicles.fleet.states.vx[:] = V
    touched = []
    for _ in range(40):
        world.tick()
        touched += [e.other for e in world.contacts.events if e.actor == car.id]
    return float(world.vehicles.fleet.states.vx[0]), [t for t in touched if t == thing.id]


@pytest.mark.parametrize("flat", ["static.prop.dirtdebris01", "static.prop.ironplank"])
def test_wheels_roll_over_what_lies_flat(world: World, flat: str) -> None:
    v, touched = passed(world, flat)
    assert v > 0.8 * V  # rolling, without throttle
    assert touched == []


def test_what_stands_up_stops_a_car(world: World) -> None:
    v, touched = passed(world, "static.prop.streetbarrier")
    assert abs(v) < 0.5 * V
    assert touched
