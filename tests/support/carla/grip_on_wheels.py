"""What the adapter does to wheels, as the client reads them back; printed as JSON."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from typing import Any

from skidpad.core.setup import ActorSetup, Setup
from skidpad.core.states import VehicleCommand
from skidpad.core.vocabulary import Control, GripModel
from skidpad.core.weather import Weather
from skidpad.physics.presets import find_weather
from skidpad.simulation.carla.backend import CarlaBackend
from skidpad.simulation.carla.options import CarlaOptions
from support.backend_contract import ALONE, lead

MEMBERS = ("damping_rate", "max_steer_angle", "radius", "max_brake_torque", "long_stiff_value")


def wheels(actor: Any) -> dict[str, Any]:
    control = actor.get_physics_control()
    return {
        "friction": [w.tire_friction for w in control.wheels],
        "others": [[round(getattr(w, m), 4) for m in MEMBERS] for w in control.wheels],
        "mass": control.mass,
    }


def measure(backend: CarlaBackend, setup: Setup) -> dict[str, Any]:
    """Wheels after the reset, after a second application, what was logged, and a full stop."""
    backend.reset(setup, 1)
    session = backend.session
    cars = [p.actor for p in session.players if p.is_vehicle]
    once = [wheels(a) for a in cars]
    notices = backend.truth().notices
    mu = backend.truth().mu.tolist()
    for actor in cars:
        session.grip.apply(actor)
    session.world.tick()
    twice = [wheels(a) for a in cars]
    way = stop(backend, setup)
    backend.close()
    return {"once": once, "twice": twice, "notices": notices, "mu": mu, "stop": way}


def stop(backend: CarlaBackend, setup: Setup) -> float:
    """Way in m from 20 m/s with full brake."""
    frame = backend.reset(replace(setup, ego=replace(setup.ego, speed=20.0), actors=()), 1)
    start = frame.ego.pose.x
    for _ in range(300):
        frame = backend.step(VehicleCommand(brake=1.0))
        if frame.ego.speed < 0.1:
            break
    return frame.ego.pose.x - start


def main(port: int, grip: str) -> dict[str, Any]:
    backend = CarlaBackend(CarlaOptions(port=port))
    walker = ActorSetup(
        name="walker", type="pedestrian", place=lead(60.0).place, driver=Control.SCRIPTED
    )
    dry = replace(ALONE, actors=(lead(30.0, "van"), walker), grip=GripModel.NONE)
    rain = replace(dry, weather=find_weather("rain-noon"), grip=GripModel(grip))
    ice = replace(dry, weather=ICE, grip=GripModel(grip))
    return {name: measure(backend, s) for name, s in (("dry", dry), ("rain", rain), ("ice", ice))}


ICE = Weather(name="icy", ice_thickness=50.0, air_temperature_c=-5.0, road_temperature_c=-5.0)

if __name__ == "__main__":
    print("RESULT", json.dumps(main(int(sys.argv[1]), sys.argv[2])), flush=True)
