"""Markings, signs and plates that send the headlights back to where they came from, for people only.

Road markings and signs hold glass beads or prisms; a plain surface spreads the same light over the
half space. How much brighter they are is chosen by eye, below what EN 1436 and EN 12899-1 ask of
new ones: the picture would otherwise be black beside them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.geometry import Pose
from skidpad.core.kernels.jit import inner_kernel, kernel
from skidpad.core.vocabulary import SemanticClass
from skidpad.physics.optics import air_depth
from skidpad.sensors.finish.glow import add_light
from skidpad.sensors.pictures.headlamps import (
    HEADLAMP_X,
    HEADLAMP_Z,
    beam_at,
    beam_of,
    behind_lamps,
    rise_of_beam,
)
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.raster.view import View
from skidpad.sensors.scene.materials import MATERIALS, Material

MARKING_GAIN, SIGN_GAIN, PLATE_GAIN = 0.9, 2.2, 1.6  # of light that comes back, per light there
SPILL = 0.035  # of the beam's power above the cut-off, by which signs are read at night
FAR = 160.0  # m
WET_SHARE = 0.25  # of a marking's return when water lies over its beads
CLASSES = 256
LINE, SIGN = int(SemanticClass.ROAD_LINE), int(SemanticClass.TRAFFIC_SIGN)
PLATE = int(Material.PLATE)
LEAST = np.float32(0.003)  # light below which nothing is added
BLOCK = 64  # px that are looked through at once
GAIN = np.zeros((CLASSES, MATERIALS), dtype=np.float32)  # by class and material
GAIN[SemanticClass.ROAD_LINE, Material.MARKING] = MARKING_GAIN
GAIN[SemanticClass.TRAFFIC_SIGN, :] = SIGN_GAIN
GAIN[:, Material.PLATE] = PLATE_GAIN


def gains(light: Lighting) -> NDArray[np.float32]:
    """Returns gains by class and material, in one weather."""
    found: NDArray[np.float32] = GAIN.copy()
    found[SemanticClass.ROAD_LINE] *= 1.0 - (1.0 - WET_SHARE) * light.wet
    found[SemanticClass.ROAD_LINE] *= 1.0 - max(light.snow, light.ice)
    return found


def send_back(
    view: View,
    ego: Pose,
    light: Lighting,
    gain: NDArray[np.float32],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Adds what comes back to the rows of a view in `out`. ego: the pose that carries the headlights."""
    body = ego.rotation()
    to_body = np.ascontiguousarray(body.T @ view.rotation.T, dtype=np.float32)
    offset = body.T @ (view.centre - (ego.x, ego.y, ego.z))
    offset -= (HEADLAMP_X, 0.0, HEADLAMP_Z)
    _send_back(view, light, to_body, offset.astype(np.float32), gain, inverse, key, out)


@inner_kernel
def _any(key: NDArray[np.int32]) -> bool:
    """Returns whether any of these pixels may send light back."""
    found = 0
    for i in range(key.size):
        label, material = (key[i] >> 8) & 255, key[i] & 255
        found |= (label == LINE) | (label == SIGN) | (material == PLATE)
    return found != 0


@kernel
def _send_back(
    view: View,
    light: Lighting,
    to_body: NDArray[np.float32],
    offset: NDArray[np.float32],
    gain: NDArray[np.float32],
    inverse: NDArray[np.float32],
    key: NDArray[np.int32],
    out: NDArray[np.uint32],
) -> None:
    """Adds to the picture `out` what retroreflective surfaces send back of the ego's own beam."""
    beam, slope, reach = beam_of(light)
    onset = np.float32(light.onset)
    per = np.float32(1.0 / view.focal)
    nearest = np.float32(1.0 / FAR)
    for row in range(view.top, view.height):
        v = np.float32(row + 0.5 - view.cy) * per
        if behind_lamps(view, v, 0, key.shape[1], to_body, offset[0]):
            continue
        for first in range(0, key.shape[1], BLOCK):
            if not _any(key[row, first : first + BLOCK]):
                continue
            for column in range(first, min(first + BLOCK, key.shape[1])):
                k = key[row, column]
                back = gain[(k >> 8) & 255, k & 255]
                if back <= 0.0 or inverse[row, column] < nearest:
                    continue
                u, z = (
                    np.float32(column + 0.5 - view.cx) * per,
                    np.float32(1.0) / inverse[row, column],
                )
                px = z * (to_body[0, 0] * u + to_body[0, 1] * v + to_body[0, 2]) + offset[0]
                py = z * (to_body[1, 0] * u + to_body[1, 1] * v + to_body[1, 2]) + offset[1]
                pz = z * (to_body[2, 0] * u + to_body[2, 1] * v + to_body[2, 2]) + offset[2]
                back *= rise_of_beam(px, onset)
                cone = back * beam_at(px, py, np.float32(0.0), beam, slope, reach)
                if cone < LEAST:
                    continue
                lit = back * beam_at(px, py, pz, beam, slope, reach) + np.float32(SPILL) * cone
                climb = z * (
                    view.rotation[0, 2] * u + view.rotation[1, 2] * v + view.rotation[2, 2]
                )
                lit *= np.float32(np.exp(-air_depth(light.air, z, view.centre[2], climb)))
                if lit > LEAST:
                    out[row, column] = add_light(out[row, column], lit, lit, lit * 0.85)
