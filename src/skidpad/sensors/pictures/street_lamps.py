"""The light of street lamps on what a block of pixels shows."""

from __future__ import annotations

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.kernels.jit import inner_kernel
from skidpad.sensors.pictures.blocks import ONE, ZERO, P, U, W
from skidpad.sensors.pictures.roughness import A, C, F
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.street_light import StreetLight

_FARTHEST = np.float32(1e-5)
_NOWHERE, _NEXT = np.float32(-1.0), np.uint64(1)


@inner_kernel
def lay_street_light(
    view: View, v: np.float32, count: int, share: np.float32, lamps: StreetLight, work: Floats32
) -> None:
    """Writes the light of street lamps on level ground, `share` of it, into lane P of a block's `work`."""
    r = view.rotation
    x_u, x_1 = np.float32(r[0, 0]), np.float32(r[1, 0]) * v + np.float32(r[2, 0])
    y_u, y_1 = np.float32(r[0, 1]), np.float32(r[1, 1]) * v + np.float32(r[2, 1])
    x_0, y_0 = np.float32(view.centre[0] - lamps.x0), np.float32(view.centre[1] - lamps.y0)
    per, rows, columns = (
        np.float32(lamps.per_cell),
        np.float32(lamps.rows - 1),
        np.float32(lamps.columns),
    )
    for x in range(count):
        u, w = work[U + x], work[W + x]
        z = ONE / (w if w > _FARTHEST else _FARTHEST)
        a, b = (x_0 + z * (x_u * u + x_1)) * per, (y_0 + z * (y_u * u + y_1)) * per
        i, j = np.floor(a), np.floor(b)
        inside = i >= ZERO and i < rows and j >= ZERO and j < columns - ONE and w > ZERO
        work[A + x] = i * columns + j if inside else _NOWHERE
        work[C + x], work[F + x] = a - i, b - j
    beyond = np.uint64(lamps.columns)
    for x in range(count):
        work[P + x] = ZERO
        if work[A + x] >= ZERO:  # between four nodes, or the grid would be seen
            at, a, b = np.uint64(work[A + x]), work[C + x], work[F + x]
            low = lamps.light[at] + b * (lamps.light[at + _NEXT] - lamps.light[at])
            at += beyond
            high = lamps.light[at] + b * (lamps.light[at + _NEXT] - lamps.light[at])
            work[P + x] = share * (low + a * (high - low))
