"""How uneven materials look in colour pictures of maps with generated scenery, by eye."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.scene.materials import MATERIALS, Material

NO_GRAIN = np.zeros((0, 3), dtype=np.float32)

# shares by which grains, patches and tints change a colour: about three standard deviations
GRAIN: dict[Material, tuple[float, float, float]] = {
    Material.ASPHALT: (0.22, 0.66, 0.16),
    Material.SHOULDER: (0.22, 0.66, 0.18),
    Material.MARKING: (0.16, 0.44, 0.05),
    Material.GRASS: (0.34, 0.70, 0.34),
    Material.EMBANKMENT: (0.34, 0.70, 0.36),
    Material.MEDIAN: (0.34, 0.66, 0.32),
    Material.SIDEWALK: (0.10, 0.50, 0.13),
    Material.CONCRETE: (0.08, 0.40, 0.07),
    Material.KERB: (0.10, 0.22, 0.03),
    Material.FENCE: (0.12, 0.20, 0.05),
    Material.ROOF: (0.16, 0.24, 0.07),
}
LEAVES, WALLS = (0.70, 0.70, 0.26), (0.08, 0.50, 0.14)


def grain_table(boxes: Iterable[tuple[int, int]]) -> Floats32:
    """Returns (256, 3) strengths by material; boxes: class and material of what stands beside the road."""
    table = np.zeros((MATERIALS, 3), dtype=np.float32)
    for material, strengths in GRAIN.items():
        table[material] = strengths
    for label, number in boxes:
        table[number] = LEAVES if label == SemanticClass.VEGETATION else WALLS
    return table
