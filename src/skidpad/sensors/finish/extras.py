"""The additions to a picture for people, each with its switch."""

from __future__ import annotations

from enum import Enum


class Extra(str, Enum):
    """One addition; none of them touches depth or classes."""

    SHADOWS = "shadows"  # of vehicles and of what stands beside the road, and where they touch it
    LAMPS = (
        "lamps"  # bloom of all lamps and of the sun, their light in fog, and a beam without an edge
    )
    REFLECTIONS = "reflections"  # of those lamps on a wet road
    RETRO = "retro"  # markings, signs and plates send the headlights back
    CLOUDS = "clouds"  # and stars, where there are few of them at night
    FOG = "fog"  # thins with height, takes contrast by Koschmieder's law and lies before the sky; rain too
    FALLING = "falling"  # rain and snow in the air, with depth, instead of the published strokes
    SPRAY = "spray"  # behind fast vehicles on a wet road
    EDGES = "edges"  # softened where one surface meets another
    SNOW = "snow"  # on the road, not only beside it; ice, and frost beside the road
    TONE = "tone"  # the contrast of a camera by day, and less light towards the corners
    CALM = "calm"  # less of the published camera effect, so that a night can be read


# what a draft leaves out: each reads or writes pixels of the whole picture
COSTLY = frozenset(
    (Extra.SHADOWS, Extra.REFLECTIONS, Extra.CLOUDS, Extra.SPRAY, Extra.EDGES, Extra.TONE)
)
NO_EXTRAS: frozenset[Extra] = frozenset()
ALL_EXTRAS = frozenset(Extra)
