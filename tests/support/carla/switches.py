"""The same drive with and without each optimisation: equal readings, fewer calls; JSON."""

from __future__ import annotations

import hashlib
import json
import sys
from dataclasses import replace
from typing import Any

from skidpad.core.setup import Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import SensorLevel
from skidpad.physics.presets import find_weather
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions, Optimisation
from support.backend_contract import ALONE, lead

TICKS = 12
ALL = frozenset(Optimisation)


class Counting:
    """A world that counts how often its actors are asked for."""

    def __init__(self, world: Any) -> None:
        self._world, self.asked = world, 0

    def get_actors(self) -> Any:
        self.asked += 1
        return self._world.get_actors()

    def __getattr__(self, name: str) -> Any:
        return getattr(self._world, name)


def drive(port: int, setup: Setup, optimisations: frozenset[Optimisation]) -> dict[str, Any]:
    backend = CarlaBackend(CarlaOptions(port=port, optimisations=optimisations))
    digest = hashlib.sha256()
    frame = backend.reset(setup, 4)
    world = Counting(backend.session.world)
    backend.session.world = world
    backend.session.lights._world = world
    for _ in range(TICKS):
        frame = backend.step(VehicleCommand(throttle=0.7))
        for id in frame.images:
            rgb = frame.images[id].rgb
            if rgb is not None:
                digest.update(rgb.tobytes())
        for column in backend.truth().states:
            digest.update(column.tobytes())
        digest.update(str(sorted(frame.lights.items())).encode())
    pool = backend.session.pictures is not None and backend.session.pictures._pool is not None
    backend.close()
    return {"content": digest.hexdigest(), "asked": world.asked, "pool": pool}


def main(port: int) -> dict[str, Any]:
    setup = replace(
        ALONE,
        weather=find_weather("rain-night"),
        level=SensorLevel.PIXELS,
        render_all=True,
        actors=(lead(30.0),),
    )
    return {"all": drive(port, setup, ALL)} | {
        one.value: drive(port, setup, ALL - {one}) for one in Optimisation
    }


if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1]))), flush=True)
