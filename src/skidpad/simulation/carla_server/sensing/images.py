"""Cameras: any size, field of view and pose, from our rasteriser."""

from __future__ import annotations

import struct
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.kernels.depthcode import bgra_from_inverse_depth
from skidpad.core.specs import CameraSpec, Modality
from skidpad.sensors.raster.passes import Pass
from skidpad.sensors.raster.rasteriser import AUTO_LEVEL
from skidpad.sensors.raster.view import View, camera_view
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol import wire
from skidpad.simulation.carla_server.sensing import pixels
from skidpad.simulation.carla_server.sensing.camera_effects import CameraEffects
from skidpad.simulation.carla_server.sensing.optics import ColourOptics, Lens
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import (
    WIDEST,
    Pictured,
    Surroundings,
    headlights,
)

IMAGE_HEAD = struct.Struct("<IIf")  # width, height, field of view in deg
MAX_PIXELS = 16_000_000
MODALITIES = {
    "sensor.camera.rgb": Modality.RGB,
    "sensor.camera.depth": Modality.DEPTH,
    "sensor.camera.semantic_segmentation": Modality.SEMANTIC,
    "sensor.camera.instance_segmentation": Modality.INSTANCE,
    "sensor.camera.optical_flow": Modality.DEPTH,
    "sensor.camera.normals": Modality.DEPTH,
    "sensor.camera.dvs": Modality.RGB,
}


@dataclass(slots=True, eq=False)
class Camera:
    """A camera's geometry and its buffers."""

    spec: CameraSpec
    own: Pass
    drawn: Pass  # its own, or that of a camera with the same view, which has drawn it
    rgb: NDArray[np.uint32]  # packed red, green, blue, 255
    bgra: NDArray[np.uint8]
    head: bytes
    effects: CameraEffects
    lens: Lens
    optics: ColourOptics
    frame: int = -1  # that is drawn

    def look(self, around: Surroundings, clock: Clock, sensor: Sensor) -> tuple[Pictured, View]:
        """Draws depth and keys, once per frame, and returns what is pictured and the view."""
        actor = sensor.actor
        pose = around.actors.pose(actor)
        scene, view = around.picture(), camera_view(self.spec, pose)
        if self.frame != clock.frame:
            self.frame = clock.frame
            speed = around.speed_of_carrier(actor)
            self.effects.move(around.weather, scene.live.ground, speed, sensor.share(clock))
            hidden = around.hidden_for(actor)
            seen = (self.spec.view, pose, hidden, self.effects.sight)
            if seen not in around.drawn:
                scene.live.draw(view, hidden, AUTO_LEVEL, self.own)
                self.effects.limit_sight(view, self.own)
                around.drawn[seen] = self.own
            self.drawn = around.drawn[seen]
        return scene, view

    def paint(self, around: Surroundings, actor: Actor, scene: Pictured, view: View) -> None:
        """Colours the drawn picture, in `rgb`, with its carrier's lamps and the weather's effects."""
        lamps = headlights(around.actors, actor)
        shading = self.effects.shading(scene)
        shading.paint(view, lamps, self.drawn.inverse, self.drawn.key, self.rgb)
        self.effects.add_weather(scene, view, self.drawn, self.rgb)

    def finish(self, scene: Pictured, view: View, dt: float) -> NDArray[np.uint32]:
        """Returns the painted picture as optics and sensor of the camera make it, `dt` s after the last."""
        self.optics.apply(scene, view, self.drawn, dt, self.rgb)
        bent: NDArray[np.uint32] = self.lens.bend(self.rgb)
        self.effects.add_noise(bent)
        return bent

    def see_bent(self, picture: NDArray[Any]) -> bytes:
        """Returns the bytes of a picture (H, W, ...) as the lens shows it; no value is mixed with another."""
        whole = picture.reshape(*picture.shape[:2], -1)
        pixel = np.dtype(f"<u{whole.itemsize * whole.shape[2]}")
        return self.lens.bend(whole.view(pixel)[..., 0]).tobytes()


def make_camera(actor: Actor, seed: int) -> Camera:
    """Returns a camera made from an actor's attributes; WireError or ConfigError when they are unusable."""
    width = wire.integer(int(actor.attributes["image_size_x"]), "image_size_x", 1, WIDEST)
    height = wire.integer(int(actor.attributes["image_size_y"]), "image_size_y", 1, WIDEST)
    if width * height > MAX_PIXELS:
        raise wire.WireError(f"image_size: at most {MAX_PIXELS} pixels, got {width}x{height}")
    fov = float(actor.attributes["fov"])
    modality = MODALITIES[actor.blueprint.id]
    spec = CameraSpec(str(actor.id), modality, width, height, fov, Pose(0.0, 0.0))
    drawn = Pass(spec)
    return Camera(
        spec,
        drawn,
        drawn,
        np.zeros((height, width), dtype=np.dtype("<u4")),
        np.zeros((height, width, 4), dtype=np.uint8),
        IMAGE_HEAD.pack(width, height, fov),
        CameraEffects(actor, spec, seed),
        Lens(actor, spec),
        ColourOptics(actor, spec),
    )


def view_of(around: Surroundings, sensor: Sensor) -> Hashable:
    """Returns what decides what a camera draws, but for weather: cameras of one value share it."""
    camera: Camera = getattr(sensor.equipment, "camera", sensor.equipment)
    return camera.spec.view, around.actors.pose(sensor.actor)


def image(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns one image of the camera's modality as a list of messages."""
    return [picture(around, clock, sensor, sensor.equipment)]


def picture(around: Surroundings, clock: Clock, sensor: Sensor, camera: Camera) -> Message:
    """Renders one image of the camera's modality as a message."""
    scene, view = camera.look(around, clock, sensor)
    drawn, bgra = camera.drawn, camera.bgra
    if camera.spec.modality is Modality.RGB:
        camera.paint(around, sensor.actor, scene, view)
        finished = camera.finish(scene, view, sensor.share(clock))
        pixels.bgra_from_rgb(finished, bgra)
        return camera.head, bgra.tobytes()
    if camera.spec.modality is Modality.DEPTH:
        bgra_from_inverse_depth(drawn.inverse, bgra)
    elif camera.spec.modality is Modality.SEMANTIC:
        pixels.bgra_from_labels(drawn.labels, bgra)
    else:
        pixels.bgra_from_instances(drawn.labels, drawn.instances, scene.ids, bgra)
    return camera.head, camera.see_bent(bgra)
