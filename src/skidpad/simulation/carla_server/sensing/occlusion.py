"""Ambient occlusion in the picture: how much of a surface's surroundings stand in front of it.

After the obscurance of McGuire et al. (2011), The Alchemy Screen-Space Ambient Obscurance Algorithm:
around each pixel points of the picture are looked at, and each hides by the cosine to the normal,
less the further away it is. Radius and strength are CARLA's (public source, SceneCaptureSensor).
"""

from __future__ import annotations

from math import cos, pi, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import kernel
from skidpad.sensors.raster.view import View

RADIUS = 1.0  # m
STRENGTH = 0.5
WEIGHT = 5.0  # of a point, so that about half is hidden in a corner of 90 deg
BIAS = 0.03  # m that a point must rise above the surface
WIDEST = 64.0  # px, so that what is near costs no more
RINGS, SPOKES = 2, 8
AROUND = np.array(
    [
        (ring / RINGS * cos(angle), ring / RINGS * sin(angle))
        for ring in range(1, RINGS + 1)
        for angle in (2.0 * pi * (k + 0.5 * ring) / SPOKES for k in range(SPOKES))
    ]
)  # (n, 2) shares of the radius
WHITE = 255.0


@kernel
def ambient_occlusion(
    view: View, inverse: NDArray[np.float32], normals: NDArray[np.float64], out: NDArray[np.uint8]
) -> None:
    """Writes (H, W): 255 where nothing hides a surface, and in the sky, darker elsewhere.

    inverse: 1/m; normals (H, W, 3): camera axes.
    """
    height, width = inverse.shape
    for y in range(height):
        for x in range(width):
            out[y, x] = 255
            if inverse[y, x] <= 0.0:
                continue
            z = 1.0 / inverse[y, x]
            reach = min(view.focal * RADIUS / z, WIDEST)
            if reach < 1.0:
                continue
            px, py = (x + 0.5 - view.cx) / view.focal * z, (y + 0.5 - view.cy) / view.focal * z
            nx, ny, nz = normals[y, x]
            hidden = 0.0
            for k in range(len(AROUND)):
                column, row = int(x + reach * AROUND[k, 0]), int(y + reach * AROUND[k, 1])
                if not (0 <= column < width and 0 <= row < height and inverse[row, column] > 0.0):
                    continue
                depth = 1.0 / inverse[row, column]
                dx = (column + 0.5 - view.cx) / view.focal * depth - px
                dy = (row + 0.5 - view.cy) / view.focal * depth - py
                dz = depth - z
                apart = sqrt(dx * dx + dy * dy + dz * dz)
                above = nx * dx + ny * dy + nz * dz - BIAS
                if above > 0.0 and apart < RADIUS:
                    hidden += above / apart * (1.0 - apart / RADIUS)
            share = min(WEIGHT * hidden / len(AROUND), 1.0)
            out[y, x] = int(WHITE * (1.0 - STRENGTH * share) + 0.5)
