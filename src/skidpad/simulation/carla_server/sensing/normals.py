"""Surface normals: the world's x, y, z in CARLA's axes as red, green, blue, -1 to 1 as 0 to 255.

In the world's axes with zero at half grey, as carla-simulator/carla#8810 says; the version before it
had the camera's axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.lefthanded import vectors_to_carla
from skidpad.sensors.rasteriser import AUTO_LEVEL
from skidpad.sensors.view import View, camera_view
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.sensing.images import Camera
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

Floats = NDArray[np.float64]
HALF = 127.5  # grey level of zero


def normals(around: Surroundings, _: Clock, sensor: Sensor) -> list[Message]:
    """One picture; the sky has no normal and is half grey."""
    camera: Camera = sensor.equipment
    view = camera_view(camera.spec, around.actors.pose(sensor.actor))
    around.picture().live.draw(view, around.hidden_for(sensor.actor), AUTO_LEVEL, camera.drawn)
    found = world_normals(view, camera.drawn.inverse.astype(np.float64))
    turned = vectors_to_carla(*found.reshape(-1, 3).T).reshape(found.shape)
    camera.bgra[..., 2::-1] = np.rint(HALF + HALF * turned)
    camera.bgra[..., 3] = 255
    return [(camera.head, camera.bgra.tobytes())]


def world_normals(view: View, inverse: Floats) -> Floats:
    """(H, W, 3) towards the camera, 0 where nothing is; inverse: planar, 1/m.

    Over a plane the inverse depth is linear in the pixels; of the differences to both sides the gentler
    one counts, as the other may cross an edge.
    """
    a, b = (_slope(inverse, axis) * view.focal for axis in (1, 0))
    u = (np.arange(view.width) + 0.5 - view.cx) / view.focal
    v = (np.arange(view.height) + 0.5 - view.cy) / view.focal
    away = np.stack((a, b, inverse - a * u[None, :] - b * v[:, None]), axis=-1)
    length = np.linalg.norm(away, axis=-1, keepdims=True)
    solid = (inverse > 0.0)[..., None] & (length > 0.0)
    towards = np.where(solid, -away / np.where(solid, length, 1.0), 0.0)
    found: Floats = towards @ view.rotation
    return found


def _slope(inverse: Floats, axis: int) -> Floats:
    ahead = np.diff(inverse, axis=axis)
    none = np.full_like(np.take(inverse, [0], axis=axis), np.inf)
    after = np.concatenate((ahead, none), axis=axis)
    before = np.concatenate((none, ahead), axis=axis)
    slope: Floats = np.where(np.abs(after) < np.abs(before), after, before)
    return np.where(np.isfinite(slope), slope, 0.0)
