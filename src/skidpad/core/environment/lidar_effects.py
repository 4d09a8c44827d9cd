"""What acts on physical lidars beside the air: kinds of fog, wet ground, the window."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class LidarFog(str, Enum):
    """Whose drops fog has, as a lidar meets them."""

    FIXED = "fixed"  # backscatter 0.046 / sight, whatever the drops
    ADVECTION = "advection"  # large drops, as of fog from the sea
    RADIATION = "radiation"  # small drops, as of fog of a clear night


@dataclass(frozen=True, slots=True, kw_only=True)
class LidarEffects:
    """Effects on lidars with `lidar=physical`; the defaults change nothing."""

    fog: LidarFog = LidarFog.FIXED
    wet_ground: bool = False  # water on the ground mirrors beams away
    dirt: float = 0.0  # share of the window that dirt covers
    drops_s: float = 0.0  # s that drops of rain stay on the window
