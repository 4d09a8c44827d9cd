"""Pedestrians led by the client's own navigation, on the mesh that it loads from us (K-9)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

Serve = Callable[..., Any]

WALKING = """
synchronous()
world.set_pedestrians_seed(3)
roads, library = world.get_map(), world.get_blueprint_library()

def under(place):
    return roads.get_waypoint(place, lane_type=carla.LaneType.Any).lane_type

places = [world.get_random_location_from_navigation() for _ in range(100)]
on_foot = sum(under(p) in (carla.LaneType.Sidewalk, carla.LaneType.Shoulder) for p in places)
assert on_foot >= 97, on_foot  # some lie on the very border of two lanes
kinds = library.filter("walker.pedestrian.*")
walkers = [world.try_spawn_actor(kinds[i], carla.Transform(p)) for i, p in enumerate(places[:20])]
walkers = [w for w in walkers if w is not None]
assert len(walkers) >= 15
kind = library.find("controller.ai.walker")
spawn = carla.command.SpawnActor
results = client.apply_batch_sync([spawn(kind, carla.Transform(), w.id) for w in walkers], True)
assert not any(r.error for r in results), [r.error for r in results]
leaders = list(world.get_actors([r.actor_id for r in results]))
world.set_pedestrians_cross_factor(0.0)
for leader in leaders:
    leader.start()
    leader.go_to_location(world.get_random_location_from_navigation())
    leader.set_max_speed(1.4)
start = [w.get_location() for w in walkers]
for tick in range(400):
    world.tick()
    if tick % 40 == 39:
        for walker in walkers:
            here = walker.get_location()
            lane = roads.get_waypoint(here, lane_type=carla.LaneType.Any)
            box = walker.bounding_box.extent.z
            assert abs(here.z - box - lane.transform.location.z) < 0.5, (here, lane)
"""


def test_ai_walkers_walk_at_their_speed(serve: Serve) -> None:
    """On shoulders of a map whose roads cross above each other."""
    serve("--strict").client(
        WALKING
        + """
way = sorted(w.get_location().distance(s) for w, s in zip(walkers, start))
assert way[len(way) // 2] > 20.0 and way[-1] < 29.0, way
speeds = [w.get_velocity().length() for w in walkers]
assert max(speeds) < 1.5 and sorted(speeds)[len(speeds) // 2] > 1.2, speeds
for leader in leaders:
    leader.stop()
    leader.destroy()
"""
    )


@pytest.mark.slow
def test_walkers_of_a_town_cross_where_they_may(serve: Serve) -> None:
    """Only those that may cross roads ever stand on a driving lane away from a zebra."""
    serve("--strict", "--map", "town").client(
        WALKING
        + """
zebras = roads.get_crosswalks()

def jaywalks(walker):
    here = walker.get_location()
    on_road = under(here) == carla.LaneType.Driving
    lane = roads.get_waypoint(here, lane_type=carla.LaneType.Driving)
    beside = lane.transform.location.distance(here) > lane.lane_width / 2.0
    return on_road and not beside and min(here.distance(z) for z in zebras) > 8.0

for _ in range(600):
    world.tick()
    assert not any(jaywalks(w) for w in walkers)
world.set_pedestrians_cross_factor(1.0)
bold = carla.Transform(carla.Location(x=-100.0, y=7.0))
walker = world.spawn_actor(kinds[30], bold)
leader = world.spawn_actor(kind, carla.Transform(), walker)
world.tick()
leader.start()
leader.go_to_location(carla.Location(x=-100.0, y=-7.0))
leader.set_max_speed(1.4)
seen = set()
for _ in range(600):
    world.tick()
    seen.add(under(walker.get_location()))
    if walker.get_location().y < -6.0:
        break
assert walker.get_location().y < -6.0 and carla.LaneType.Driving in seen, seen
"""
    )
