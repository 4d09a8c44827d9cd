"""How uneven materials look in colour pictures of maps with generated scenery, by eye."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from skidpad.core.arrays import Floats32
from skidpad.core.vocabulary import SemanticClass
from skidpad.sensors.scene.materials import MATERIALS, TRACKS, Material

# by material: strengths as in GRAIN, then m of a grain's texel, m beyond which grains fade, and the share of
# light that what looks down has less than what looks up
GRAINS, PATCHES, TINTS, REPAIRS, GRAZING, TEXEL, NEAR, BENEATH = range(8)
COLUMNS = 8
NO_GRAIN = np.zeros((0, COLUMNS), dtype=np.float32)
GROUND_GRAIN, LEAF_GRAIN = (0.04, 9.0, 0.0), (0.16, 45.0, 0.58)

# shares by which grains, patches, tints and repairs change a colour, about three standard deviations, and by
# which it is brighter at grazing angles
GRAIN: dict[Material, tuple[float, float, float, float, float]] = {
    Material.ASPHALT: (0.26, 0.66, 0.11, 0.30, 1.05),
    Material.NEW_ASPHALT: (0.20, 0.56, 0.10, 0.0, 0.95),
    Material.WORN_ASPHALT: (0.30, 0.66, 0.11, 0.34, 1.05),
    Material.SHOULDER: (0.26, 0.45, 0.14, 0.0, 0.95),
    Material.MARKING: (0.20, 0.45, 0.06, 0.10, 0.60),
    Material.GRASS: (0.46, 0.74, 0.34, 0.0, 0.95),
    Material.HAY: (0.46, 0.60, 0.24, 0.0, 0.95),
    Material.CROP: (0.50, 0.60, 0.24, 0.0, 0.95),
    Material.PLOUGHED: (0.40, 0.50, 0.14, 0.0, 0.80),
    Material.EMBANKMENT: (0.46, 0.74, 0.36, 0.0, 0.95),
    Material.MEDIAN: (0.46, 0.70, 0.34, 0.0, 0.90),
    Material.SIDEWALK: (0.14, 0.34, 0.10, 0.20, 0.70),
    Material.CONCRETE: (0.12, 0.30, 0.06, 0.0, 0.30),
    Material.KERB: (0.10, 0.22, 0.06, 0.0, 0.22),
    Material.FENCE: (0.12, 0.20, 0.08, 0.0, 0.20),
    Material.ROOF: (0.20, 0.34, 0.12, 0.0, 0.30),
}
LEAVES, WALLS = (1.20, 0.50, 0.34, 0.0, 0.30), (0.12, 0.36, 0.10, 0.0, 0.30)


def grain_table(boxes: Iterable[tuple[int, int]]) -> Floats32:
    """Returns (256, COLUMNS) grain by material; boxes: class and material of what stands beside the road."""
    table = np.zeros((MATERIALS, COLUMNS), dtype=np.float32)
    for material, strengths in GRAIN.items():
        for one in (material, *TRACKS.get(material, ())):
            table[one] = (*strengths, *GROUND_GRAIN)
    for label, number in boxes:
        if label == SemanticClass.CAR:
            continue
        is_leaf = label == SemanticClass.VEGETATION
        table[number] = (*LEAVES, *LEAF_GRAIN) if is_leaf else (*WALLS, *GROUND_GRAIN)
    return table
