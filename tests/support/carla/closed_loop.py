"""A stack in closed loop on both backends: empty road, scripted lead; printed as JSON (K-6 c)."""

from __future__ import annotations

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from skidpad.campaign.runs.run import run
from skidpad.core.frames import Frame
from skidpad.core.setup import ActorCommand
from skidpad.core.states import VehicleCommand
from skidpad.evidence.drive.metrics import run_metrics
from skidpad.evidence.grip.scores import grip_metrics
from skidpad.physics import types
from skidpad.physics.presets import find_weather
from skidpad.roads.bundled import load_map
from skidpad.scenarios.playing.player import setups
from skidpad.scenarios.scenario import compile_scenario
from skidpad.scenarios.shipped import scenario_file
from skidpad.simulation.backend import Backend
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.blueprints import STANDS_FOR
from skidpad.simulation.carla.options import CarlaOptions
from skidpad.simulation.carla_server.actors.catalogue import load_catalogue
from skidpad.simulation.carla_server.vehicles.vehicles import model_of
from skidpad.simulation.embedded.engine import EmbeddedBackend
from support.carla.replay import without_road_noise
from support.runs import adas_run, scenario_run

SECONDS = 90.0
BEFORE_CONTACT = 25.0  # s that configuration 2 drives before it meets the first guardrail
TWO_CONTACTS = 65.0  # s: guardrails at 27 and 54 s, the next at 77 s
Numbers = dict[str, Any]


class SmoothRoad(EmbeddedBackend):
    """The server's road has no noise; ours has (decision M-11)."""

    def step(self, command: VehicleCommand, actor_commands: Sequence[ActorCommand] = ()) -> Frame:
        without_road_noise(self)
        return super().step(command, actor_commands)


def empty(config: int, seconds: float, backend: Backend) -> Numbers:
    """Nobody else on figure8; no vehicle of a CARLA server has stability control."""
    spec = adas_run(config, vehicles=0, seed=1, duration=seconds, settings={"esc": False})
    return asdict(run_metrics(run(spec, backend=backend).log, load_map("figure8")))


def behind_lead(backend: Backend) -> Numbers:
    """The lead of the friction study slows down; a scenario player moves it."""
    driven = run(scenario_run("lead_slowdown", weather=find_weather("rain_0")), backend=backend)
    metrics = grip_metrics(
        driven.log,
        driven.outcome,
        triggered=driven.triggered,
        route_length=driven.route_length,
        ratio=1.0,
    )
    return {"outcome": driven.outcome.value, **asdict(metrics)}


def main(port: int) -> Any:
    script = compile_scenario(scenario_file("lead_slowdown"))
    ego, actors = setups(script)
    for setup in (ego, *actors):
        types.vehicle_types()[setup.type] = model_of(load_catalogue()[STANDS_FOR[setup.type][0]])

    def both(driven: Any) -> list[Numbers]:
        return [driven(SmoothRoad()), driven(CarlaBackend(CarlaOptions(port=port)))]

    return {
        "empty 2": both(lambda b: empty(2, BEFORE_CONTACT, b)),
        "empty 4": both(lambda b: empty(4, SECONDS, b)),
        "contacts": both(lambda b: empty(2, TWO_CONTACTS, b)),
        "lead": both(behind_lead),
    }


if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1])), default=str), flush=True)
