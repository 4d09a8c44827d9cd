"""What holds for all actors of a world during a run."""

from __future__ import annotations

from dataclasses import dataclass

from skidpad.core.setup import DT, Wind
from skidpad.core.vocabulary import AntiLock, StabilityControl
from skidpad.physics.grip import GripParams
from skidpad.simulation.world.ground import ROAD_NOISE


@dataclass(frozen=True, slots=True, kw_only=True)
class Conditions:
    """What holds for all actors of a world."""

    seed: int = 0
    dt: float = DT
    grip: GripParams
    stability: bool = False  # vehicles have stability and traction control
    anti_lock: AntiLock = AntiLock.IDEAL  # of vehicles that have them
    stability_control: StabilityControl = StabilityControl.IDEAL
    roll_over: bool = False  # vehicles can tip over their outer wheels
    wind: Wind | None = None  # None: no air moves
    wakes: bool = False  # lorries, buses and vans push air aside
    road_noise: float = ROAD_NOISE  # rad of cross slope, decision M-11
    all_lanes: bool = False  # actors stand on sidewalks and shoulders too
