"""Drives CARLA's BehaviorAgent over routes on a running `skidpad carla-server` and prints a line for each.

The agent comes from the user's copy of CARLA: `--agents DIR` holds the folder `agents` of PythonAPI/carla (it
needs networkx and shapely). The ego has the role_name hero, so that a server with --govern holds it back:

    skidpad carla-server --port 2000 --scenery none --bodywork plain --mu-ref 0.9 --govern envelope
    python tools/carla_agent_routes.py --agents DIR --port 2000 --weather ice
"""

from __future__ import annotations

import argparse
import importlib
import itertools
import json
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

STEP, APART, NEAR, BLOCKED = 0.05, 60, 8.0, 20.0  # s, ticks from contact to contact, m, s
CAR = "vehicle.mini.cooper_s"
ICE = "30"  # percent of 2 cm


def turn(a: Any, b: Any) -> float:
    """Returns the angle in degrees between two waypoints' directions."""
    difference = b.transform.rotation.yaw - a.transform.rotation.yaw
    return abs(float((difference + 180.0) % 360.0 - 180.0))


def lay_way(first: Any, km: float) -> list[Any]:
    """Returns waypoints every 10 m, straight on at junctions."""
    way = [first]
    while len(way) * 10.0 < km * 1000.0 and (further := way[-1].next(10.0)):
        way.append(min(further, key=lambda w: turn(way[-1], w)))
    return way


def drive(carla: Any, world: Any, start: Any, km: float, behavior: str) -> dict[str, float]:
    """Drives one route and returns what came of it."""
    navigation = importlib.import_module("agents.navigation.behavior_agent")
    planner = importlib.import_module("agents.navigation.local_planner")
    roads, library = world.get_map(), world.get_blueprint_library()
    blueprint = library.find(CAR)
    blueprint.set_attribute("role_name", "hero")
    ego = world.spawn_actor(blueprint, start)
    world.tick()
    touched: dict[str, list[int]] = defaultdict(list)
    bumper = world.spawn_actor(
        library.find("sensor.other.collision"), carla.Transform(), attach_to=ego
    )
    bumper.listen(lambda e: touched[e.other_actor.type_id].append(e.frame))
    way = lay_way(roads.get_waypoint(start.location), km)
    agent = navigation.BehaviorAgent(ego, behavior=behavior)
    plan = [(w, planner.RoadOption.LANEFOLLOW) for w in way]
    agent._local_planner.set_global_plan(plan, stop_waypoint_creation=True, clean_queue=True)
    reached = departures = ticks = still = 0
    was_off, distance, last = False, 0.0, start.location
    while not (agent.done() and ticks > 40) and ticks * STEP < 900.0 and still * STEP < BLOCKED:
        ego.apply_control(agent.run_step())
        world.tick()
        ticks += 1
        here = ego.get_location()
        step = here.distance(last)
        distance, last = distance + step, here
        still = still + 1 if step < 0.1 * STEP else 0
        for k in range(reached, min(reached + 8, len(way))):
            if way[k].transform.location.distance(here) < NEAR:
                reached = k
        is_off = roads.get_waypoint(here, project_to_road=False) is None
        departures += is_off and not was_off
        was_off = is_off
    contacts = sum(
        1 + sum(b - a > APART for a, b in itertools.pairwise(at)) for at in touched.values()
    )
    bumper.destroy()
    ego.destroy()
    world.tick()
    return {
        "completion_pct": round(100.0 * reached / (len(way) - 1), 1), "km": round(distance / 1000.0, 2),
        "mean_kmh": round(3.6 * distance / max(ticks * STEP, STEP), 1), "contacts": contacts,
        "departures": departures,
    }  # fmt: skip


def main() -> None:
    """Drive all starts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--agents", type=Path, required=True, help="folder that holds `agents`")
    parser.add_argument("--port", type=int, default=2000)
    parser.add_argument("--weather", choices=("dry", "rain", "ice"), default="ice")
    parser.add_argument("--km", type=float, default=3.0)
    parser.add_argument("--starts", type=int, default=10, help="every seventh spawn point")
    parser.add_argument("--behavior", default="aggressive")
    ask = parser.parse_args()
    if not (ask.agents / "agents").is_dir():
        parser.error(f"--agents: {ask.agents} holds no folder `agents`")
    sys.path.insert(0, str(ask.agents))
    carla = importlib.import_module("carla")
    client = carla.Client("127.0.0.1", ask.port)
    client.set_timeout(120.0)
    world = client.get_world()
    settings = world.get_settings()
    settings.synchronous_mode, settings.fixed_delta_seconds = True, STEP
    world.apply_settings(settings)
    wet = {
        "cloudiness": 90.0,
        "precipitation": 80.0,
        "precipitation_deposits": 80.0,
        "wetness": 100.0,
    }
    world.set_weather(carla.WeatherParameters(**(wet if ask.weather == "rain" else {})))
    grip = None
    if ask.weather == "ice":
        blueprint = world.get_blueprint_library().find("skidpad.weather.grip")
        blueprint.set_attribute("ice_thickness", ICE)
        grip = world.spawn_actor(blueprint, carla.Transform())
    points = world.get_map().get_spawn_points()
    for k in range(0, 7 * ask.starts, 7):
        told = drive(carla, world, points[k % len(points)], ask.km, ask.behavior)
        print(json.dumps({"weather": ask.weather, "start": k} | told), flush=True)
    if grip is not None:
        grip.destroy()
    world.tick()


if __name__ == "__main__":
    main()
