"""The colours of all actors and materials in one weather: season, snow, frost, ice and lit lamps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats32
from skidpad.core.states import ActorTable
from skidpad.sensors.pictures.blocks import COLUMNS, GLOSS, GLOW, WETTABLE
from skidpad.sensors.pictures.lighting import Lighting
from skidpad.sensors.pictures.settled_snow import NOTHING_SETTLES, SHARE, STEEP
from skidpad.sensors.scene.grain import TINTS
from skidpad.sensors.scene.materials import (
    ACTOR_PAINTED,
    ASPHALTS,
    EMISSIVE,
    FIELDS,
    MATERIALS,
    POLISHED,
    Material,
)

ROADLIKE = (*ASPHALTS, Material.SHOULDER, Material.MARKING, Material.SIDEWALK)
SNOWY = (
    Material.GRASS,
    Material.EMBANKMENT,
    Material.SHOULDER,
    Material.SIDEWALK,
    Material.MEDIAN,
    Material.ROOF,
    *FIELDS,
)
SNOWED = (*ASPHALTS, Material.MARKING)
SNOW_LEFT = 0.72  # share of a driven road that packed snow covers; by eye
SNOW_IN_TRACKS = 0.56  # and of it where wheels roll
ICE_LEFT = 0.62  # share of a driven road that ice hides; by eye
ICE_IN_TRACKS = 0.44  # and of it where wheels roll
FROSTED = 0.5  # share of snow's white that hoar frost has, wherever there is ice; by eye
SETTLED = 0.92  # share of what looks up, off the road, that snow covers
# of 1, how much less evergreens and bare crowns must look up for it
STEEPER, TWIGS_STEEPER = 0.25, 0.08
STAINED = 0.06  # share of the tints of surfaces that is left on snow
GLOSSY = (Material.PAINT, Material.GLASS, Material.LAMP_GLASS)
SNOW = np.array([0.80, 0.83, 0.88], dtype=np.float32)
ICE = np.array([0.52, 0.63, 0.76], dtype=np.float32)
TWIGS = np.array([98, 86, 76], dtype=np.float32)  # grey levels of bare crowns
BARE = 0.85  # share of a crown's colour that twigs make where snow lies


def in_season(palette: Floats32, leafy: NDArray[np.intp], light: Lighting) -> Floats32:
    """Returns the palette with bare crowns in snow and ice; leafy: materials of broad-leaved crowns."""
    winter = max(light.snow, light.ice)
    if winter <= 0.0 or not leafy.size:
        return palette
    result: Floats32 = palette.copy()
    result[leafy] += np.float32(BARE * winter) * (TWIGS - result[leafy])
    return result


def look_up(palette: Floats32, table: ActorTable, light: Lighting, for_people: bool) -> Floats32:
    """Returns ((n + 1) * 256, COLUMNS): colour and behaviour of each material, on the map and each actor."""
    n = len(table)
    out = np.zeros((n + 1, MATERIALS, COLUMNS), dtype=np.float32)
    out[:, :, :3] = np.square(palette / np.float32(255.0))
    for material in ACTOR_PAINTED:
        out[1:, material, :3] = np.square(table.rgb.astype(np.float32) / 255.0)[:, None].squeeze(1)
    for material in EMISSIVE:
        out[:, material, GLOW] = 1.0
    out[:, list(ROADLIKE), WETTABLE] = 1.0
    out[:, list(GLOSSY), GLOSS] = 1.0
    for material in SNOWY:
        out[:, material, :3] += _whiteness(light) * (SNOW - out[:, material, :3])
    if for_people:
        for material in SNOWED:
            is_rolled = material in POLISHED
            ice, snow = (ICE_IN_TRACKS, SNOW_IN_TRACKS) if is_rolled else (ICE_LEFT, SNOW_LEFT)
            out[:, material, :3] += ice * light.ice * (ICE - out[:, material, :3])
            out[:, material, :3] += snow * light.snow * (SNOW - out[:, material, :3])
    out[:, Material.HEADLAMP, GLOW] = 0.9 * light.lamps
    shining = out[:, Material.HEADLAMP, :3] - out[:, Material.LAMP_GLASS, :3]
    out[:, Material.LAMP_GLASS, :3] += min(light.lamps, 1.0) * shining
    out[:, Material.LAMP_GLASS, GLOW] = 0.9 * light.lamps
    out[:, Material.TAIL_LAMP, GLOW] = 0.8 * light.lamps
    pane = out[:, Material.GLASS, :3]  # by day nothing tells which windows will be lit
    out[:, Material.LIT_WINDOW, :3] = pane + min(light.lamps, 1.0) * (
        out[:, Material.LIT_WINDOW, :3] - pane
    )
    out[:, Material.LIT_WINDOW, GLOW] = 1.6 * light.lamps  # of a dull pane, so about a third
    return out.reshape(-1, COLUMNS)


def _whiteness(light: Lighting) -> float:
    """Returns how white the ground beside a driven road is, 0 .. 1: of snow, or of frost where ice is."""
    return max(light.snow, FROSTED * light.ice)


def grain_in(light: Lighting, grain: Floats32, for_people: bool) -> Floats32:
    """Returns the unevenness of surfaces in a weather: snow evens it out, ice and it hide their tints."""
    left = grain * np.float32(1.0 - 0.6 * light.snow)
    if grain.size:
        white = [*SNOWY, *(SNOWED if for_people else ())]
        left[white, TINTS] *= np.float32(1.0 - (1.0 - STAINED) * max(light.snow, light.ice))
    result: Floats32 = left
    return result


def settling_in(light: Lighting, leafy: NDArray[np.intp], green: NDArray[np.intp]) -> Floats32:
    """Returns (256, 2) how snow or frost lies on each material of the map; empty without both.

    leafy, green: materials of bare crowns, and of what keeps its leaves or needles.
    """
    if _whiteness(light) <= 0.0:
        return NOTHING_SETTLES
    shares = np.zeros((MATERIALS, 2), dtype=np.float32)
    shares[:, SHARE] = SETTLED * _whiteness(light)
    shares[leafy, STEEP], shares[green, STEEP] = TWIGS_STEEPER, STEEPER
    shares[[*SNOWY, *SNOWED, *EMISSIVE, Material.LAMP_HOUSING, Material.LAMP_DARK], SHARE] = 0.0
    return shares
