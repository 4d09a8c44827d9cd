"""The graph of vehicles of background traffic that wait for each other, as their drivers note it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from skidpad.core.arrays import Flags, Ints32
from skidpad.simulation.world.traffic.state import Held
from skidpad.simulation.world.world import World


@dataclass(frozen=True, slots=True)
class Wait:
    """A vehicle that stands, for what, and for which other vehicle."""

    actor: int
    cause: Held
    blocker: int | None
    lane: int
    s: float  # m along the lane
    seconds: float  # of standing before a line

    def __str__(self) -> str:
        place = f"{self.actor} on lane {self.lane} at {self.s:.0f} m for {self.seconds:.0f} s"
        whom = "" if self.blocker is None else f" of {self.blocker}"
        return f"{place}: {cause_name(self.cause)}{whom}"


def cause_name(cause: Held) -> str:
    """The cause of standing in words."""
    return cause.name.lower().replace("_", " ")


def wait_graph(world: World, stands: Flags) -> list[Wait]:
    """Returns for each vehicle that stands (n,) for what and whom it waits."""
    assert world.traffic is not None
    state, path = world.traffic.drivers.state, world.traffic.drivers.path
    return [
        Wait(
            actor=i,
            cause=Held(int(state["held"][i])),
            blocker=int(state["blocker"][i]) if state["blocker"][i] >= 0 else None,
            lane=int(path[i, 0]),
            s=float(state["s"][i]),
            seconds=float(state["stood"][i]),
        )
        for i in np.flatnonzero(stands).tolist()
    ]


def root_of(blocker: Ints32, stands: Flags, i: int) -> int:
    """Returns the last vehicle that stands in the chain of those for whom vehicle i waits.

    In a circle it is the one before the first that comes twice.
    """
    chain = {i}
    while blocker[i] >= 0 and stands[blocker[i]] and int(blocker[i]) not in chain:
        i = int(blocker[i])
        chain.add(i)
    return i


def wait_circles(blocker: Ints32, stands: Flags) -> list[tuple[int, ...]]:
    """Returns the circles of vehicles that stand and wait for each other, each from its least row on.

    None of them can go before another one does: they stand until a rule lets one go first.
    """
    circles, seen = [], set[int]()
    for start in np.flatnonzero(stands).tolist():
        way: list[int] = []
        here = start
        while here >= 0 and stands[here] and here not in seen:
            seen.add(here)
            way.append(here)
            here = int(blocker[here])
        if here in way:
            circle = way[way.index(here) :]
            first = circle.index(min(circle))
            circles.append(tuple(circle[first:] + circle[:first]))
    return circles
