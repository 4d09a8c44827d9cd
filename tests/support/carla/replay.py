"""The same commands on both backends, without traffic; printed as JSON (decision K-6 a)."""

from __future__ import annotations

import json
import sys
from math import atan2, radians, sin
from typing import Any

import numpy as np

from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control, SensorLevel
from skidpad.physics import types
from skidpad.physics.presets import find_weather
from skidpad.roads.bundled import load_map
from skidpad.simulation.backend import Backend
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions
from skidpad.simulation.carla_server.actors.catalogue import load_catalogue
from skidpad.simulation.carla_server.vehicles.vehicles import model_of
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.simulation.world.ground import NOISE_SALT, ROAD_NOISE
from skidpad.simulation.world.traffic.path import uniform

EGO = "vehicle.mini.cooper_s"
SECONDS, SEED = 60.0, 3
V, LOOK_AHEAD = 15.0, 12.0  # m/s, m
WHEELBASE, STEER_MAX = 2.47, radians(70.0)
MAP = load_map("figure8")


def same_model(id: str = EGO) -> None:
    """Let the embedded simulator know a car of the server by its blueprint's name."""
    types.vehicle_types()[id] = model_of(load_catalogue()[id])


def without_road_noise(backend: EmbeddedBackend) -> None:
    """The server's road has none; ours has 1e-4 rad of cross slope (decision M-11)."""
    world = backend.world
    for i, key in enumerate(world.rows.keys):
        world.bank[i] -= ROAD_NOISE * (2.0 * uniform(key, world.tick, NOISE_SALT) - 1.0)


def setup_for(weather: str) -> Setup:
    """An empty figure8."""
    assert MAP.ego_start is not None
    return Setup(
        map="figure8",
        weather=find_weather(weather),
        specs=(),
        ego=ActorSetup(name="ego", type=EGO, place=MAP.ego_start, driver=Control.SCRIPTED),
        level=SensorLevel.OBJECTS,
    )


def record(setup: Setup) -> list[VehicleCommand]:
    """What a lane keeper commands on the embedded simulator: pure pursuit at 54 km/h."""
    backend, commands = EmbeddedBackend(), []
    ego = backend.reset(setup, SEED).ego
    for _ in range(round(SECONDS / setup.dt)):
        here = MAP.project(ego.pose.x, ego.pose.y, ego.pose.z)
        there = None if here is None else MAP.ahead(here, LOOK_AHEAD)
        assert there is not None
        bearing = atan2(there.y - ego.pose.y, there.x - ego.pose.x) - ego.pose.yaw
        steer = 2.0 * WHEELBASE * sin(bearing) / LOOK_AHEAD / STEER_MAX
        throttle = min(max(0.3 * (V - ego.speed), 0.0), 1.0)
        commands.append(VehicleCommand(throttle=throttle, steer=steer))
        ego = backend.step(commands[-1]).ego
    return commands


def poses(backend: Backend, setup: Setup, commands: list[VehicleCommand]) -> list[list[float]]:
    backend.reset(setup, SEED)
    out = []
    for command in commands:
        if isinstance(backend, EmbeddedBackend):
            without_road_noise(backend)
        backend.step(command)
        pose = backend.truth().states.pose(0)
        out.append([pose.x, pose.y, pose.z, pose.yaw])
    backend.close()
    return out


def main(port: int, weather: str) -> dict[str, Any]:
    same_model()
    setup = setup_for(weather)
    commands = record(setup)
    ours = np.array(poses(EmbeddedBackend(), setup, commands))
    theirs = np.array(poses(CarlaBackend(CarlaOptions(port=port)), setup, commands))
    apart = np.hypot(*(ours - theirs)[:, :2].T)
    way = np.hypot(*np.diff(ours[:, :2], axis=0).T).sum()
    turned = np.ptp(np.unwrap(ours[:, 3]))
    return {"apart": apart.tolist(), "way": float(way), "turned": float(turned)}


if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1]), sys.argv[2])), flush=True)
