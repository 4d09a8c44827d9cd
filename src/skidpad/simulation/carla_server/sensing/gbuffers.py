"""G-buffers: what a deferred renderer knows of each pixel, eight bits per channel as blue, green, red, alpha.

Contents after the documentation of carla.GBufferTextureID (0.9.16), scales after the public source of
CARLA (SceneCaptureSensor, ImageUtil) and Unreal 4 (FReadSurfaceDataFlags, EncodeVelocityToTexture).
What our renderer knows nothing of is black, as CARLA sends textures that were not rendered.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from skidpad.core.arrays import Bytes, Floats32
from skidpad.sensors.pictures.blocks import GLOSS, WETTABLE
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import Material
from skidpad.simulation.carla_server.actors.registry import Actor
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.protocol.streams import StreamHub
from skidpad.simulation.carla_server.sensing import pixels
from skidpad.simulation.carla_server.sensing.images import Camera, make_camera, picture
from skidpad.simulation.carla_server.sensing.motion import Memory
from skidpad.simulation.carla_server.sensing.normals import (
    bgra_from_normals,
    camera_normals,
    world_normals,
)
from skidpad.simulation.carla_server.sensing.occlusion import ambient_occlusion
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Pictured, Surroundings

WHITE = 255.0
FARTHEST = 160.0  # m, white: 16 000 cm of FReadSurfaceDataFlags
STILL, PER_SCREEN = 32767.0 / 65535.0, 0.499 * 0.5  # EncodeVelocityToTexture; 0 is "does not move"
SPECULAR = 0.5  # Unreal's own, of what is no metal
METALS = (Material.STEEL, Material.RIM)
ROUGH, GLOSSY, METAL, WATER = 0.85, 0.2, 0.4, 0.05  # roughness, by eye as the palette is
LIT = 1  # MSM_DefaultLit; the sky is MSM_Unlit, 0


class Texture(IntEnum):
    """Numbers of textures, as carla.GBufferTextureID."""

    SCENE_COLOUR = 0
    SCENE_DEPTH = 1
    SCENE_STENCIL = 2
    NORMAL = 3  # GBufferA
    MATERIAL = 4  # GBufferB
    BASE_COLOUR = 5  # GBufferC
    SHADING_DATA = 6  # GBufferD
    SHADOW_FACTORS = 7  # GBufferE
    TANGENT = 8  # GBufferF
    VELOCITY = 9
    AMBIENT_OCCLUSION = 10
    CUSTOM_DEPTH = 11
    CUSTOM_STENCIL = 12


@dataclass(slots=True, eq=False)
class ColourCamera:
    """A camera that also sends G-buffers when clients say so."""

    camera: Camera
    gbuffers: bool = False
    memory: Memory = field(default_factory=Memory)


def make_colour_camera(actor: Actor, seed: int) -> ColourCamera:
    """Returns a colour camera made from an actor's attributes; errors as of `make_camera`."""
    return ColourCamera(make_camera(actor, seed))


def stream_of(sensor: Sensor, texture: int, hub: StreamHub) -> int:
    """Returns the stream of a texture, opened at the first request for it."""
    if texture not in sensor.textures:
        sensor.textures[texture] = hub.create()
    return sensor.textures[texture]


def colour_image(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns one colour image as a message."""
    return [picture(around, clock, sensor, sensor.equipment.camera)]


def textures(
    around: Surroundings, clock: Clock, sensor: Sensor, wanted: list[int]
) -> list[Message]:
    """Returns a message with one picture for each wanted texture; [] while they are not enabled."""
    made: ColourCamera = sensor.equipment
    if not made.gbuffers:
        return []
    camera = made.camera
    scene, view = camera.look(around, clock, sensor)
    told: list[Message] = []
    for texture in wanted:
        out = np.zeros_like(camera.bgra)
        if texture == Texture.SCENE_COLOUR:
            camera.paint(around, sensor.actor, scene, view)
            camera.effects.add_noise(camera.rgb)
            pixels.bgra_from_rgb(camera.rgb, out)
        elif texture == Texture.VELOCITY:
            _velocity(made.memory.since(scene, view, camera.drawn), camera, out)
        elif texture in DRAWN:
            DRAWN[Texture(texture)](scene, view, camera, out)
        solid = camera.drawn.inverse > 0.0
        out[..., 3] = LIT * solid if texture == Texture.MATERIAL else 255
        told.append((camera.head, out.tobytes()))
    return told


def _depth(_: Pictured, __: View, camera: Camera, out: Bytes) -> None:
    """Writes depth as grey: planar, linear to FARTHEST m, and then as sRGB encodes light."""
    inverse = camera.drawn.inverse
    share = np.minimum(1.0 / np.maximum(inverse * FARTHEST, 1e-9), 1.0)
    out[..., :3] = np.rint(WHITE * srgb(share))[..., None]


def srgb(linear: Floats32) -> Floats32:
    """Returns linear light of 0 to 1 encoded as sRGB of 0 to 1 (IEC 61966-2-1)."""
    encoded: Floats32 = np.where(
        linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055
    )
    return encoded


def _normal(_: Pictured, view: View, camera: Camera, out: Bytes) -> None:
    """Writes normals of the world, in CARLA's axes, as the camera of normals sends them."""
    bgra_from_normals(world_normals(view, camera.drawn.inverse), out)


def _material(scene: Pictured, _: View, camera: Camera, out: Bytes) -> None:
    """Writes metallic into red, specular into green and roughness into blue of the picture `out`."""
    drawn = camera.drawn
    surfaces = scene.shading.surfaces(drawn.key)
    metal = np.isin(drawn.key & 255, METALS)
    rough = np.where(metal, METAL, ROUGH + surfaces[..., GLOSS] * (GLOSSY - ROUGH))
    rough += scene.shading.light.wet * surfaces[..., WETTABLE] * (WATER - rough)
    solid = drawn.inverse > 0.0
    for channel, values in ((2, metal), (1, np.full(metal.shape, SPECULAR)), (0, rough)):
        out[..., channel] = np.rint(WHITE * values * solid)


def _base_colour(scene: Pictured, _: View, camera: Camera, out: Bytes) -> None:
    """Writes colours of the surface without light, as sRGB."""
    colours = scene.shading.surfaces(camera.drawn.key)[..., :3]
    solid = (camera.drawn.inverse > 0.0)[..., None]
    out[..., 2::-1] = np.rint(WHITE * np.sqrt(np.minimum(colours, 1.0)) * solid)


def _velocity(flow: Floats32, camera: Camera, out: Bytes) -> None:
    """Writes the motion of actors: red to the right, green up, in half pictures per reading, -2 to 2."""
    encoded = np.rint(WHITE * np.clip(STILL + PER_SCREEN * flow, 0.0, 1.0))
    out[..., 2:0:-1] = encoded * (camera.drawn.instances > 0)[..., None]


def _occlusion(_: Pictured, view: View, camera: Camera, out: Bytes) -> None:
    """Writes the ambient occlusion of the view into the picture `out` as shades of grey."""
    inverse = camera.drawn.inverse
    grey = np.empty(inverse.shape, dtype=np.uint8)
    ambient_occlusion(view, inverse, camera_normals(view, inverse), grey)
    out[..., :3] = grey[..., None]


def _labels(_: Pictured, __: View, camera: Camera, out: Bytes) -> None:
    """Writes the tags of the semantic camera as grey."""
    out[..., :3] = camera.drawn.labels[..., None]


DRAWN: dict[Texture, Callable[[Pictured, View, Camera, Bytes], None]] = {
    Texture.SCENE_DEPTH: _depth,
    Texture.NORMAL: _normal,
    Texture.MATERIAL: _material,
    Texture.BASE_COLOUR: _base_colour,
    Texture.AMBIENT_OCCLUSION: _occlusion,
    Texture.CUSTOM_DEPTH: _depth,
    Texture.CUSTOM_STENCIL: _labels,
}
