"""How uneven materials look in colour pictures of maps with generated scenery, by eye."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.scene.materials import MATERIALS, Material

NO_GRAIN = np.zeros((0, 4), dtype=np.float32)

# shares by which grains, patches, tints and repairs change a colour: about three standard deviations
GRAIN: dict[Material, tuple[float, float, float, float]] = {
    Material.ASPHALT: (0.26, 0.95, 0.18, 0.30),
    Material.NEW_ASPHALT: (0.20, 0.70, 0.14, 0.0),
    Material.WORN_ASPHALT: (0.30, 0.95, 0.18, 0.36),
    Material.SHOULDER: (0.26, 0.95, 0.22, 0.0),
    Material.MARKING: (0.20, 0.60, 0.06, 0.10),
    Material.GRASS: (0.38, 1.00, 0.56, 0.0),
    Material.EMBANKMENT: (0.38, 1.00, 0.58, 0.0),
    Material.MEDIAN: (0.38, 0.95, 0.54, 0.0),
    Material.SIDEWALK: (0.14, 0.70, 0.18, 0.22),
    Material.CONCRETE: (0.12, 0.55, 0.12, 0.0),
    Material.KERB: (0.10, 0.22, 0.06, 0.0),
    Material.FENCE: (0.12, 0.20, 0.08, 0.0),
    Material.ROOF: (0.16, 0.40, 0.16, 0.0),
}
LEAVES, WALLS = (0.70, 0.90, 0.40, 0.0), (0.10, 0.70, 0.20, 0.0)


def grain_table(boxes: Iterable[tuple[int, int]]) -> Floats32:
    """Returns (256, 4) strengths by material; boxes: class and material of what stands beside the road."""
    table = np.zeros((MATERIALS, 4), dtype=np.float32)
    for material, strengths in GRAIN.items():
        table[material] = strengths
    for label, number in boxes:
        table[number] = LEAVES if label == SemanticClass.VEGETATION else WALLS
    return table
