"""VehicleControl: what a driver last told a vehicle."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(slots=True)
class Control:
    """A vehicle's control as last applied, until the next one; ISO steer."""

    throttle: float = 0.0
    steer: float = 0.0
    brake: float = 0.0
    hand_brake: bool = False
    reverse: bool = False
    manual: bool = False
    gear: int = 0
