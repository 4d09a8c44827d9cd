"""How many background vehicles are on the road, changed while a run is driven.

Who leaves and who comes back follows from the moment alone, so the same inputs at the same ticks
give the same run. Vehicles come back where they left, as soon as there is room; if more are wanted
than the run began with, its reserve is called in, and enters where traffic lets in those who are late.
"""

from __future__ import annotations

import numpy as np

from skidpad.core.setup import RESERVE_NAME, ActorCommand
from skidpad.core.states import WorldTruth

ROOM = 25.0  # m to everybody, which a vehicle needs to come back
FROM_EGO = 60.0  # m to the ego, so that nobody appears before its bumper


class Density:
    """State: how many vehicles are wanted (None: as the run has them), which were sent away or called."""

    def __init__(self, vehicles: int = 0) -> None:
        """vehicles: that the run begins with."""
        self.vehicles = vehicles
        self.wanted: int | None = None
        self.away: set[int] = set()
        self.called = 0  # of the reserve

    def words(self, truth: WorldTruth) -> list[ActorCommand]:
        """What actors are told in this tick: the farthest leave first, the nearest come first."""
        if self.wanted is None:
            return []
        return [*self._call(truth), *self._leave_or_come(truth, self.wanted)]

    def _call(self, truth: WorldTruth) -> list[ActorCommand]:
        """Calls vehicles of the reserve that are wanted for the first time; all they need is room."""
        assert self.wanted is not None
        reserve = [name for name in truth.table.names if name.startswith(RESERVE_NAME)]
        first, self.called = self.called, max(self.called, self.wanted - self.vehicles)
        return [ActorCommand(name, present=True) for name in reserve[first : self.called]]

    def _leave_or_come(self, truth: WorldTruth, wanted: int) -> list[ActorCommand]:
        """Sends vehicles away, or calls back those that were there."""
        states, names = truth.states, truth.table.names
        here = [i for i in np.flatnonzero(states.present).tolist() if i > 0]
        from_ego = np.hypot(states.x - states.x[0], states.y - states.y[0])
        if len(here) > wanted:
            leaving = sorted(here, key=lambda i: (-from_ego[i], i))[: len(here) - wanted]
            self.away.update(leaving)
            return [ActorCommand(names[i], present=False) for i in leaving]
        coming: list[int] = []
        for i in sorted(self.away, key=lambda i: (from_ego[i], i)):
            if len(here) == wanted:
                break
            others = [0, *here]
            near = np.hypot(states.x[others] - states.x[i], states.y[others] - states.y[i])
            if near.min() > ROOM and from_ego[i] > FROM_EGO:
                coming.append(i)
                here.append(i)
        self.away.difference_update(coming)
        return [ActorCommand(names[i], present=True) for i in coming]
