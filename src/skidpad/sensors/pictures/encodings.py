"""How other programs write the same images: views for compatibility, never for our own stack."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Bytes
from skidpad.core.vocabulary import SemanticClass

# CityScapes colours as documented for CARLA 0.9.15.
CITYSCAPES: dict[SemanticClass, tuple[int, int, int]] = {
    SemanticClass.NONE: (0, 0, 0),
    SemanticClass.ROAD: (128, 64, 128),
    SemanticClass.SIDEWALK: (244, 35, 232),
    SemanticClass.BUILDING: (70, 70, 70),
    SemanticClass.WALL: (102, 102, 156),
    SemanticClass.FENCE: (190, 153, 153),
    SemanticClass.POLE: (153, 153, 153),
    SemanticClass.TRAFFIC_LIGHT: (250, 170, 30),
    SemanticClass.TRAFFIC_SIGN: (220, 220, 0),
    SemanticClass.VEGETATION: (107, 142, 35),
    SemanticClass.TERRAIN: (152, 251, 152),
    SemanticClass.SKY: (70, 130, 180),
    SemanticClass.PEDESTRIAN: (220, 20, 60),
    SemanticClass.RIDER: (255, 0, 0),
    SemanticClass.CAR: (0, 0, 142),
    SemanticClass.TRUCK: (0, 0, 70),
    SemanticClass.BUS: (0, 60, 100),
    SemanticClass.TRAIN: (0, 80, 100),
    SemanticClass.MOTORCYCLE: (0, 0, 230),
    SemanticClass.BICYCLE: (119, 11, 32),
    SemanticClass.STATIC: (110, 190, 160),
    SemanticClass.DYNAMIC: (170, 120, 50),
    SemanticClass.OTHER: (55, 90, 80),
    SemanticClass.WATER: (45, 60, 150),
    SemanticClass.ROAD_LINE: (157, 234, 50),
    SemanticClass.GROUND: (81, 0, 81),
    SemanticClass.BRIDGE: (150, 100, 100),
    SemanticClass.RAIL_TRACK: (230, 150, 140),
    SemanticClass.GUARD_RAIL: (180, 165, 180),
}
_COLOURS: Bytes = np.zeros((256, 3), dtype=np.uint8)
for _label, _rgb in CITYSCAPES.items():
    _COLOURS[_label] = _rgb


def cityscapes_colours(labels: Bytes) -> Bytes:
    """Returns (H, W, 3) red, green, blue of (H, W) class ids (A-034); unknown classes are black."""
    return _COLOURS[labels]


def vehicle_mask(rgb: Bytes) -> NDArray[np.bool_]:
    """Returns (H, W) whether class colours (H, W, 3) are those of car, truck or bus, by boxes (A-035).

    For images whose colours have been through lossy coding; labels need no mask.
    """
    r, g, b = (rgb[..., i].astype(np.int16) for i in range(3))
    dark = (g < 50) & (r < 50)
    car = (b > 100) & (b < 160) & dark
    truck = (b > 50) & (b < 90) & dark
    bus = (b > 80) & (b < 120) & (g > 40) & (g < 80) & (r < 50)
    mask: NDArray[np.bool_] = car | truck | bus
    return mask
