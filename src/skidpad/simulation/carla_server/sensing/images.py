"""Cameras: any size, field of view and pose, from our rasteriser."""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.specs import CameraSpec, Modality
from skidpad.sensors.passes import Pass
from skidpad.sensors.rasteriser import AUTO_LEVEL, raster
from skidpad.sensors.view import camera_view
from skidpad.simulation.carla_server import wire
from skidpad.simulation.carla_server.actors import Actor
from skidpad.simulation.carla_server.sensing import pixels
from skidpad.simulation.carla_server.sensing.scene import WIDEST

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.sensing.sensors import Sensor
    from skidpad.simulation.carla_server.world import World

IMAGE_HEAD = struct.Struct("<IIf")  # width, height, field of view in deg
MAX_PIXELS = 16_000_000
MODALITIES = {
    "sensor.camera.rgb": Modality.RGB,
    "sensor.camera.depth": Modality.DEPTH,
    "sensor.camera.semantic_segmentation": Modality.SEMANTIC,
    "sensor.camera.instance_segmentation": Modality.INSTANCE,
}


@dataclass(slots=True, eq=False)
class Camera:
    """A camera's geometry and its buffers."""

    spec: CameraSpec
    drawn: Pass
    rgb: NDArray[np.uint32]  # packed red, green, blue, 255
    bgra: NDArray[np.uint8]
    head: bytes


def make_camera(actor: Actor) -> Camera:
    """From an actor's attributes; WireError or ConfigError when they cannot be used."""
    width = wire.integer(int(actor.attributes["image_size_x"]), "image_size_x", 1, WIDEST)
    height = wire.integer(int(actor.attributes["image_size_y"]), "image_size_y", 1, WIDEST)
    if width * height > MAX_PIXELS:
        raise wire.WireError(f"image_size: at most {MAX_PIXELS} pixels, got {width}x{height}")
    fov = float(actor.attributes["fov"])
    modality = MODALITIES[actor.blueprint.id]
    spec = CameraSpec(str(actor.id), modality, width, height, fov, Pose(0.0, 0.0))
    return Camera(
        spec,
        Pass(spec),
        np.zeros((height, width), dtype=np.dtype("<u4")),
        np.zeros((height, width, 4), dtype=np.uint8),
        IMAGE_HEAD.pack(width, height, fov),
    )


def image(world: World, sensor: Sensor) -> list[tuple[bytes | memoryview, ...]]:
    """One picture."""
    camera: Camera = sensor.state
    scene = world.sensors.scene(world)
    pose = world.pose(sensor.actor)
    view = camera_view(camera.spec, pose)
    drawn = camera.drawn
    raster(
        scene.static.chunks,
        scene.keys,
        scene.actors,
        scene.hidden_for(world, sensor.actor),
        view,
        AUTO_LEVEL,
        scene.scratch,
        drawn.inverse,
        drawn.key,
    )
    if camera.spec.modality is Modality.DEPTH:
        pixels.bgra_from_depth(drawn.inverse, camera.bgra)
    elif camera.spec.modality is Modality.SEMANTIC:
        pixels.bgra_from_labels(drawn.labels, camera.bgra)
    elif camera.spec.modality is Modality.INSTANCE:
        pixels.bgra_from_instances(drawn.labels, drawn.instances, scene.ids, camera.bgra)
    else:
        carrier = scene.headlights(world, sensor.actor)
        scene.shading.paint(view, carrier, drawn.inverse, drawn.key, camera.rgb)
        pixels.bgra_from_rgb(camera.rgb, camera.bgra)
    return [(camera.head, camera.bgra.tobytes())]
