"""A driver who sees nothing, for runs that must end in a collision."""

from __future__ import annotations

from skidpad.core.states import VehicleCommand


class Blind:
    def __init__(self, specs, map, settings):
        pass

    def tick(self, frame):
        return VehicleCommand(throttle=0.25)
