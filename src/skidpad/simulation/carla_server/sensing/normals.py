"""Surface normals: the world's x, y, z in CARLA's axes as red, green, blue, -1 to 1 as 0 to 255.

In the world's axes with zero at half grey, as carla-simulator/carla#8810 says; the version before it
had the camera's axes.
"""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.maths.lefthanded import vectors_to_carla
from skidpad.sensors.raster.view import View
from skidpad.simulation.carla_server.clock import Clock
from skidpad.simulation.carla_server.sensing.images import Camera
from skidpad.simulation.carla_server.sensing.sensor import Message, Sensor
from skidpad.simulation.carla_server.sensing.surroundings import Surroundings

HALF = 127.5  # grey level of zero


def normals(around: Surroundings, clock: Clock, sensor: Sensor) -> list[Message]:
    """Returns one picture of normals as a message; the sky has no normal and is half grey."""
    camera: Camera = sensor.equipment
    _, view = camera.look(around, clock, sensor)
    bgra_from_normals(world_normals(view, camera.drawn.inverse), camera.bgra)
    return [(camera.head, camera.see_bent(camera.bgra))]


def bgra_from_normals(found: Floats, out: NDArray[np.uint8]) -> None:
    """Writes normals (H, W, 3) of the world, ISO 8855, as colours into out (H, W, 4)."""
    turned = vectors_to_carla(*found.reshape(-1, 3).T).reshape(found.shape)
    out[..., 2::-1] = np.rint(HALF + HALF * turned)
    out[..., 3] = 255


def world_normals(view: View, inverse: NDArray[np.float32]) -> Floats:
    """Returns (H, W, 3) unit normals in world axes, towards the camera, 0 where nothing is.

    inverse (H, W): planar inverse depth, 1/m.
    """
    found: Floats = camera_normals(view, inverse) @ view.rotation
    return found


def camera_normals(view: View, inverse: NDArray[np.float32]) -> Floats:
    """Returns (H, W, 3) unit normals in the camera's axes, 0 where nothing is."""
    found = np.zeros((*inverse.shape, 3))
    _camera_normals(view, inverse, found)
    return found


@kernel
def _camera_normals(view: View, inverse: NDArray[np.float32], out: Floats) -> None:
    """Writes normals into out (H, W, 3): over a plane the inverse depth is linear in the pixels."""
    height, width = inverse.shape
    for y in range(height):
        v = (y + 0.5 - view.cy) / view.focal
        for x in range(width):
            here = float(inverse[y, x])
            if here <= 0.0:
                continue
            u = (x + 0.5 - view.cx) / view.focal
            left = here - inverse[y, x - 1] if x > 0 else inf
            right = inverse[y, x + 1] - here if x + 1 < width else inf
            above = here - inverse[y - 1, x] if y > 0 else inf
            below = inverse[y + 1, x] - here if y + 1 < height else inf
            a, b = _gentler(left, right) * view.focal, _gentler(above, below) * view.focal
            c = here - a * u - b * v
            length = sqrt(a * a + b * b + c * c)
            out[y, x, 0], out[y, x, 1], out[y, x, 2] = -a / length, -b / length, -c / length


@inner_kernel
def _gentler(before: float, after: float) -> float:
    """Returns the smaller difference, which does not cross an edge; 0 without neighbours (both inf)."""
    found = after if abs(after) < abs(before) else before
    return found if found < inf and found > -inf else 0.0
