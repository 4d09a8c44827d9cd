"""The same commands on both backends, without traffic; printed as JSON (decision K-6 a)."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from typing import Any

import numpy as np

from skidpad.campaign.cells import Cell, Driver
from skidpad.campaign.drive import Drive, prepare
from skidpad.core.setup import Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics import types
from skidpad.physics.presets import find_weather
from skidpad.simulation.backend import Backend
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions
from skidpad.simulation.carla_server.catalogue import load_catalogue
from skidpad.simulation.carla_server.vehicles import model_of
from skidpad.simulation.embedded.engine import EmbeddedBackend
from skidpad.stack.configurations import functions_of
from skidpad.stack.settings import load_profile

EGO = "vehicle.mini.cooper_s"
SECONDS = 60.0


def same_model() -> None:
    """Let the embedded simulator know the server's car by its blueprint's name."""
    types.vehicle_types()[EGO] = model_of(load_catalogue()[EGO])


def cell(weather: str, level: SensorLevel = SensorLevel.OBJECTS) -> Cell:
    return Cell(
        driver=Driver(label="4", functions=functions_of(4)),
        weather=find_weather(weather),
        seed=3,
        profile="recommended",
        settings=load_profile("recommended"),
        vehicles=0,
        duration=SECONDS,
        level=level,
    )


def with_ego(setup: Setup) -> Setup:
    return replace(setup, ego=replace(setup.ego, type=EGO))


def ready(weather: str) -> Drive:
    made = prepare(cell(weather))
    return replace(made, setup=with_ego(made.setup))


def record(weather: str) -> tuple[Setup, list[VehicleCommand]]:
    """What the stack commands on the embedded simulator."""
    made = ready(weather)
    backend, commands = EmbeddedBackend(), []
    frame = backend.reset(made.setup, 3)
    for _ in range(round(SECONDS / made.setup.dt)):
        commands.append(made.stack.tick(frame))
        frame = backend.step(commands[-1])
    return made.setup, commands


def poses(backend: Backend, setup: Setup, commands: list[VehicleCommand]) -> list[list[float]]:
    backend.reset(setup, 3)
    out = []
    for command in commands:
        backend.step(command)
        pose = backend.truth().states.pose(0)
        out.append([pose.x, pose.y, pose.z, pose.yaw])
    backend.close()
    return out


def main(port: int, weather: str) -> dict[str, Any]:
    same_model()
    setup, commands = record(weather)
    ours = np.array(poses(EmbeddedBackend(), setup, commands))
    theirs = np.array(poses(CarlaBackend(CarlaOptions(port=port)), setup, commands))
    apart = np.hypot(*(ours - theirs)[:, :2].T)
    way = np.hypot(*np.diff(ours[:, :2], axis=0).T).sum()
    return {"apart": apart.tolist(), "way": float(way), "turned": float(np.ptp(ours[:, 3]))}


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]), sys.argv[2])), flush=True)
