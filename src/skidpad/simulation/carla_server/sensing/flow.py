"""Optical flow: how far each surface moved on the picture since the sensor's last reading, as of `motion`."""

from __future__ import annotations

from dataclasses import dataclass, field

from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.sensing.images import Camera, make_camera
from skidpad.simulation.carla_server.sensing.motion import Memory
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings


@dataclass(slots=True, eq=False)
class FlowCamera:
    """A camera, and what it saw of whom at its last reading."""

    camera: Camera
    memory: Memory = field(default_factory=Memory)


def make_flow_camera(actor: Actor, seed: int) -> FlowCamera:
    """Returns an optical-flow camera made from an actor's attributes; errors as of `make_camera`."""
    return FlowCamera(make_camera(actor, seed))


def optical_flow(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns one picture of flow as a message; the first one shows no motion."""
    made: FlowCamera = sensor.equipment
    camera = made.camera
    scene, view = camera.look(around, clock, sensor)
    return [(camera.head, camera.see_bent(made.memory.since(scene, view, camera.drawn)))]
