"""Slush: snow that water fills, which a tyre has to push aside before it touches the road.

It is pushed aside and lifts a tyre as water of the same weight does. That its drag grows with the square of
speed and linearly with depth, in slush as in water, is measured (NASA TN D-552, 1960, abstract). Depth
times specific gravity as the depth of that water: theairlinepilots.com, t=630, whose example has 0.6. While
it carries the tyre, it grips and shears like packed snow, and hides what is below as snow does: assumptions.
A tyre can float below 40 km/h in it (TRID 638563, abstract), which this law does not give: it loses half of
its grip at 60 km/h in 5 mm and more. Valid: to 15 mm, which is 9 mm of water.
"""

from __future__ import annotations

from dataclasses import replace

from skidpad.physics.grip import SNOW_COVER_MM, GripParams, Road, RoadSurface

SPECIFIC_GRAVITY = 0.6  # over water


def slush_grip(road: Road, surface: RoadSurface, slush_mm: float, tyres: str) -> GripParams:
    """Returns the grip of these tyres where slush lies on a surface, mm deep."""
    water = max(surface.film_mm, slush_mm * SPECIFIC_GRAVITY)
    below = road.params(tyres, replace(surface, film_mm=water))
    snow = road.params(tyres, replace(surface, snow_mm=SNOW_COVER_MM))
    cover = min(slush_mm / SNOW_COVER_MM, 1.0)
    slushy = below._replace(
        firm=(1.0 - cover) * below.firm, bare=(1.0 - cover) * below.bare + cover * snow.firm
    )
    if not road.stiffness:
        return slushy
    return slushy._replace(
        firm_stiffness=(1.0 - cover) * below.firm_stiffness,
        bare_stiffness=(1.0 - cover) * below.bare_stiffness + cover * snow.firm_stiffness,
    )
