"""What vehicles run into, and what they roll over."""

from __future__ import annotations

import pytest

from skidpad.simulation.carla_server.actors.touches import touches
from skidpad.simulation.carla_server.episode import Wanted
from skidpad.simulation.carla_server.served import Served

V = 10.0  # m/s
AHEAD = 12.0  # m


def passed(served: Served, prop: str) -> tuple[float, list[int]]:
    """Speed after a car has met a prop on its lane, and who touched whom."""
    episode = served.episode
    place = episode.map.spawn_points[0]
    car = episode.spawn(Wanted("vehicle.tesla.model3", {}), place)
    thing = episode.spawn(Wanted(prop, {}), place.moved(forward=AHEAD))
    episode.moving.fleet.states.vx[:] = V
    touched = []
    for _ in range(40):
        served.tick()
        met = touches(episode.moving, episode.actors)
        touched += [t.other.id for t in met if t.actor is car and t.other is thing]
    return float(episode.moving.fleet.states.vx[0]), touched


@pytest.mark.parametrize("flat", ["static.prop.dirtdebris01", "static.prop.ironplank"])
def test_wheels_roll_over_what_lies_flat(served: Served, flat: str) -> None:
    v, touched = passed(served, flat)
    assert v > 0.8 * V  # rolling, without throttle
    assert touched == []


def test_what_stands_up_stops_a_car(served: Served) -> None:
    v, touched = passed(served, "static.prop.streetbarrier")
    assert abs(v) < 0.5 * V
    assert touched
