"""The grip of all wheels of a world: of the road in its weather, in patches and in friction zones."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates
from skidpad.physics.fleet import Fleet
from skidpad.physics.grip import GripParams, Road
from skidpad.physics.wakes import displacing
from skidpad.simulation.world.patches import (
    NO_PATCH,
    FrictionZone,
    Patches,
    wheel_places,
    zoned_tyres,
)
from skidpad.simulation.world.placed import Places
from skidpad.simulation.world.step import Wheeled


class WheelGrip:
    """Writes the grip of each vehicle's wheels into the arrays that a step reads.

    Attributes:
        road: what was laid last; None: one grip was set for all vehicles.
        patches: None for none.
        zones: in force from the next step on.
        was_zoned: whether some were in force in the last step.
        tyres: (w, 4) tire_friction outside of zones.
    """

    def __init__(self, grip: GripParams) -> None:
        self._grip = grip
        self.road: Road | None = None
        self.patches: Patches | None = None
        self.zones: Sequence[FrictionZone] = ()
        self.was_zoned = False

    def begin(self, fleet: Fleet) -> None:
        """Takes other vehicles, with the tyres of their types."""
        self._fleet, self.tyres = fleet, fleet.tire_friction.copy()

    def carry(self, tyres: Floats, to: NDArray[np.intp], source: NDArray[np.intp]) -> None:
        """Lets vehicles `to` go on with the tyres `source` of earlier ones."""
        self.tyres[to] = tyres[source]
        self._fleet.tire_friction[:] = self.tyres
        if self.patches is not None:
            self.patches.set_vehicles(self._fleet.types)

    def make_arrays(self, wakes: bool) -> Wheeled:
        """Returns what a step reads of the vehicles; grips are written into it from now on."""
        fleet, w = self._fleet, len(self._fleet.types)
        self._arrays = Wheeled(
            fleet.wheels,
            fleet.params,
            fleet.tire_friction,
            np.ones((w, 4)),
            np.zeros((w, 4)),
            np.zeros((w, len(GripParams._fields))),
            np.full((w, 4), NO_PATCH),
            np.full((w, 4), NO_PATCH),
            fleet.feel,
            displacing(fleet.types, wakes),
            np.zeros((w, 2)),
            np.zeros(w, dtype=np.bool_),
        )
        self._fill()
        return self._arrays

    def set_for_all(self, grip: GripParams) -> None:
        """Sets one grip for all vehicles in place of that of the road."""
        if grip is not self._grip:
            self._grip, self.road = grip, None
            self._fill()

    def lay(self, road: Road) -> None:
        """Sets what the weather does to the road from now on, in patches too."""
        self._grip, self.road = road.params(), road
        self._fill()
        if self.patches is not None:
            self.patches.lay(road)

    def lay_patches(self, patches: Patches | None) -> None:
        """Sets other patches from now on, None for none; drivers see them when the road is laid next."""
        self.patches, a = patches, self._arrays
        a.patched[:], a.patch_stiffness[:], a.patch_film[:] = 1.0, NO_PATCH, NO_PATCH
        if patches is not None:
            patches.set_vehicles(self._fleet.types)

    def set_tyres(self, i: int, friction: Sequence[float]) -> None:
        """Sets tire_friction of vehicle i at FL, FR, RL, RR outside friction zones."""
        self.tyres[i] = self._fleet.tire_friction[i] = friction

    def feel(self, states: ActorStates, placed: Places) -> None:
        """Writes what patches under the wheels do, and the tyres' friction in zones."""
        if self.patches is not None:
            a = self._arrays
            self.patches.fill(states, placed, a.patched, a.patch_stiffness, a.patch_film)
        if self.zones or self.was_zoned:
            self._fleet.tire_friction[:] = self.tyres
            if self.zones:
                wheels = wheel_places(self._fleet.types)
                self._fleet.tire_friction[:] = zoned_tyres(
                    self.zones, self.tyres, wheels, self._fleet.states
                )
        self.was_zoned = bool(self.zones)

    def _fill(self) -> None:
        """Gives each vehicle the grip of its own tyres on the road, or else the common grip."""
        for i, body in enumerate(self._fleet.types):
            own = None if self.road is None or not body.tyres else self.road.params(body.tyres)
            self._arrays.grips[i] = self._grip if own is None else own
