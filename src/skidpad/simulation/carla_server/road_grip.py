"""Friction at every wheel: weather once (decision K-2), tire_friction per wheel, triggers on top."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from skidpad.core.vocabulary import GripModel
from skidpad.core.weather import Weather
from skidpad.physics.grip import GripParams, fill_mu, grip_params
from skidpad.simulation.carla_server.catalogue import Family

if TYPE_CHECKING:
    from skidpad.simulation.carla_server.world import World


class RoadGrip:
    """mu of a tyre with tire_friction 3.5; the fleet applies each wheel's own scale."""

    def __init__(self, model: GripModel, mu_ref: float) -> None:
        self.model = model
        self.mu_ref = mu_ref
        self._weather: Weather | None = None
        self._params: GripParams = grip_params(Weather(), model, mu_ref)
        self._mu = np.zeros((0, 4))

    def params(self, weather: Weather) -> GripParams:
        """Grip in this weather, computed once per change."""
        if weather is not self._weather:
            self._weather = weather
            self._params = grip_params(weather, self.model, self.mu_ref)
        return self._params

    def per_wheel(self, world: World) -> NDArray[np.float64]:
        """(n, 4) for all vehicles; valid until the next call."""
        states = world.vehicles.fleet.states
        if len(self._mu) != len(states.x):
            self._mu = np.zeros((len(states.x), 4))
        fill_mu(self.params(world.sky.weather), states.vx, states.vy, self._mu)
        apply_triggers(world)
        return self._mu


def apply_triggers(world: World) -> None:
    """Vehicles inside a friction trigger have its tire_friction, all others their own."""
    triggers = world.actors.of(Family.TRIGGER)
    fleet = world.vehicles.fleet
    for i, vehicle in enumerate(world.vehicles.members):
        fleet.tire_friction[i] = vehicle.physics.tire_friction
    s = fleet.states
    for trigger in triggers:
        half = trigger.half
        pose = trigger.pose
        c, sn = np.cos(pose.yaw), np.sin(pose.yaw)
        dx, dy = s.x - pose.x, s.y - pose.y
        inside = (
            (np.abs(dx * c + dy * sn) <= half[0])
            & (np.abs(dy * c - dx * sn) <= half[1])
            & (np.abs(s.z - pose.z) <= half[2] + 1.0)
        )
        fleet.tire_friction[inside] = trigger.extra
