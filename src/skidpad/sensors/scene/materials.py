"""Materials: what a surface looks like. One byte of every pixel's key; labels are separate.

Colours are sRGB grey levels under noon light. The palette is our own, chosen by eye so that day,
rain and night read at a glance; it copies no simulator's.
"""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

MATERIALS = 256


class Material(IntEnum):
    """Fixed materials; numbers from `FIRST_FREE` to `END_FREE` - 1 are given out for box colours."""

    SKY = 0
    ASPHALT = 1
    SHOULDER = 2
    MARKING = 3
    GRASS = 4
    EMBANKMENT = 5
    SIDEWALK = 6
    STEEL = 7
    CONCRETE = 8
    KERB = 9
    FENCE = 10
    LAMP_HOUSING = 11
    LAMP_DARK = 12
    LAMP_RED = 13
    LAMP_YELLOW = 14
    LAMP_GREEN = 15
    PAINT = 16  # coloured by the actor's own paint
    GLASS = 17
    TYRE = 18
    RIM = 19
    HEADLAMP = 20
    TAIL_LAMP = 21  # brightens when the actor brakes
    PLATE = 22
    TRIM = 23
    SKIN = 24
    TROUSERS = 25
    CLOTH = 26  # coloured by the actor's own paint
    CARGO = 27
    MEDIAN = 28
    LIT_WINDOW = 29  # shines at night
    ROOF = 30
    FRAME = 31  # of doors and windows
    FIRST_FREE = 32
    # from the end of the byte, of dressed maps only: fields; per asphalt, what wheels polish and oil darkens
    HAY = 241
    CROP = 242
    PLOUGHED = 243
    ASPHALT_TRACK = 244
    ASPHALT_OIL = 245
    NEW_TRACK = 246
    NEW_OIL = 247
    WORN_TRACK = 248
    WORN_OIL = 249
    NEW_ASPHALT = 250  # darker than what lies about it
    WORN_ASPHALT = 251  # paler
    # and of shaped bodies only
    LAMP_GLASS = 252  # of head lamps: glass by day, and as bright as they are when they shine
    BRAKE_LAMP = 253  # shines when the actor brakes, and at no other time
    INDICATOR_LEFT = 254
    INDICATOR_RIGHT = 255


BASE_COLOUR: dict[Material, tuple[int, int, int]] = {
    Material.SKY: (150, 185, 225),
    Material.ASPHALT: (92, 93, 97),
    Material.SHOULDER: (110, 109, 106),
    Material.MARKING: (232, 232, 226),
    Material.GRASS: (98, 122, 62),
    Material.EMBANKMENT: (112, 124, 72),
    Material.SIDEWALK: (158, 154, 146),
    Material.STEEL: (166, 172, 178),
    Material.CONCRETE: (150, 148, 142),
    Material.KERB: (172, 170, 164),
    Material.FENCE: (120, 112, 98),
    Material.LAMP_HOUSING: (32, 34, 32),
    Material.LAMP_DARK: (44, 42, 38),
    Material.LAMP_RED: (255, 36, 22),
    Material.LAMP_YELLOW: (255, 190, 10),
    Material.LAMP_GREEN: (20, 240, 120),
    Material.PAINT: (128, 128, 128),
    Material.GLASS: (38, 46, 56),
    Material.TYRE: (28, 28, 30),
    Material.RIM: (150, 152, 156),
    Material.HEADLAMP: (236, 238, 242),
    Material.TAIL_LAMP: (150, 18, 20),
    Material.PLATE: (226, 222, 196),
    Material.TRIM: (40, 41, 44),
    Material.SKIN: (196, 152, 122),
    Material.TROUSERS: (48, 54, 78),
    Material.CLOTH: (128, 128, 128),
    Material.CARGO: (214, 214, 210),
    Material.MEDIAN: (106, 124, 70),
    Material.LIT_WINDOW: (122, 112, 88),
    Material.ROOF: (126, 74, 58),
    Material.FRAME: (196, 194, 188),
    Material.NEW_ASPHALT: (70, 70, 73),
    Material.WORN_ASPHALT: (116, 113, 108),
    Material.HAY: (138, 132, 78),
    Material.CROP: (84, 118, 50),
    Material.PLOUGHED: (106, 92, 70),
    Material.ASPHALT_TRACK: (112, 110, 107),
    Material.ASPHALT_OIL: (74, 74, 77),
    Material.NEW_TRACK: (84, 83, 82),
    Material.NEW_OIL: (55, 55, 59),
    Material.WORN_TRACK: (132, 128, 121),
    Material.WORN_OIL: (92, 92, 93),
    Material.LAMP_GLASS: (132, 140, 150),
    Material.BRAKE_LAMP: (96, 14, 16),
    Material.INDICATOR_LEFT: (170, 92, 24),
    Material.INDICATOR_RIGHT: (170, 92, 24),
}

END_FREE = int(Material.HAY)  # box colours have the numbers before it

FIELDS = (Material.HAY, Material.CROP, Material.PLOUGHED)
TRACKS = {  # what wheels polish, and what drips between them, on each asphalt
    Material.ASPHALT: (Material.ASPHALT_TRACK, Material.ASPHALT_OIL),
    Material.NEW_ASPHALT: (Material.NEW_TRACK, Material.NEW_OIL),
    Material.WORN_ASPHALT: (Material.WORN_TRACK, Material.WORN_OIL),
}
POLISHED = tuple(track for track, _ in TRACKS.values())
ASPHALTS = tuple(m for asphalt, others in TRACKS.items() for m in (asphalt, *others))
# Lamps shine of themselves: neither sun nor headlights change them.
EMISSIVE = (Material.LAMP_RED, Material.LAMP_YELLOW, Material.LAMP_GREEN)
# Painted in the colour of the actor's table row.
ACTOR_PAINTED = (Material.PAINT, Material.CLOTH)


def base_palette() -> NDArray[np.float32]:
    """Returns (256, 3) grey levels of the fixed materials; free numbers are mid grey."""
    palette = np.full((MATERIALS, 3), 128.0, dtype=np.float32)
    for material, rgb in BASE_COLOUR.items():
        palette[material] = rgb
    return palette
