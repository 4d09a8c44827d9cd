"""Events of the ego: contacts that begin, and lane markings that its outline crosses."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from skidpad.core.kernels.jit import inner_kernel
from skidpad.core.states import ContactEvent, LaneInvasion, TrafficContact
from skidpad.physics.contact import Contacts
from skidpad.roads.kernels import WIDTH, LaneArrays
from skidpad.roads.lanes import Marking
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.placed import Places

HOLD = 0.5  # s: bodies that bounce apart and touch again within this are one contact
EGO = 0  # row and id of the first actor of a run
LEFT, RIGHT = 1, 2  # bits of crossed markings


class Touches(NamedTuple):
    """Contacts that began in a tick."""

    ego: tuple[ContactEvent, ...] = ()
    others: tuple[TrafficContact, ...] = ()


class ContactBook:
    """Which contacts are new: a pair (or the ego and a kind of obstacle) begins once (A-029)."""

    def __init__(self, names: tuple[str, ...], dt: float) -> None:
        self.names = names
        self.hold = round(HOLD / dt)
        self.last: dict[tuple[int, int | str], int] = {}

    def arrange(self, rows: Mapping[int, int]) -> None:
        """Carries what is noted over to other rows; rows: the new one by the old one of actors that stay."""
        self.last = {
            (rows[i], j if isinstance(j, str) else rows[j]): tick
            for (i, j), tick in self.last.items()
            if i in rows and (isinstance(j, str) or j in rows)
        }

    def update(self, tick: int, contacts: Contacts, count: int) -> Touches:
        """Returns the contacts that began in this tick; for the ego's the largest impulse speaks.

        count: rows of `contacts` that are valid. Touching again within HOLD s begins no contact.
        """
        events: dict[tuple[int, int | str], ContactEvent] = {}
        others: list[TrafficContact] = []
        touched: set[tuple[int, int | str]] = set()
        for k in range(count):
            if contacts.impulse[k] <= 0.0:
                continue  # side by side, or parting already
            i, j = int(contacts.i[k]), int(contacts.j[k])
            static = self.names[int(contacts.segment[k])] if j < 0 else ""
            pair: tuple[int, int | str] = (i, static if j < 0 else j)
            began = tick - self.last.get(pair, -self.hold - 1) > self.hold
            if i != EGO:
                if began and pair not in touched:
                    others.append(TrafficContact(tick, i, j, float(contacts.v_closing[k])))
            elif began and (pair not in events or contacts.impulse[k] > events[pair].impulse):
                events[pair] = ContactEvent(
                    tick,
                    j,
                    static,
                    float(contacts.impulse[k]),
                    float(contacts.v_closing[k]),
                    float(contacts.x[k]),
                    float(contacts.y[k]),
                )
            touched.add(pair)
        for pair in touched:
            self.last[pair] = tick
        return Touches(tuple(events.values()), tuple(others))


class Markings(NamedTuple):
    """What the ego's outline stands across: arrays that a step reads and writes."""

    left: NDArray[np.uint8]  # (N,) Marking at each lane sample
    right: NDArray[np.uint8]
    standing: NDArray[np.int64]  # (3,) lane, -1: unknown; across its left, its right marking


def markings_of(map: RoadMap) -> Markings:
    """Returns the markings of a map; nothing is crossed yet."""
    return Markings(
        map.samples.marking_left, map.samples.marking_right, np.array([-1, 0, 0], dtype=np.int64)
    )


def forget(markings: Markings) -> None:
    """Forgets what the ego stands across, as it was put elsewhere: that is no invasion there."""
    markings.standing[0] = -1


@inner_kernel
def cross_markings(m: Markings, lanes: LaneArrays, placed: Places) -> int:
    """Returns the markings that the ego's outline began to cross (A-030): LEFT and RIGHT as bits.

    Keeps in `m.standing` what it now stands across.
    """
    if len(placed) == 0:
        return 0
    ego, standing = placed[EGO], m.standing
    lane = ego.lane
    if lane < 0:
        standing[0] = -1
        return 0
    turn = ego.yaw - ego.heading
    reach = ego.half_width * abs(cos(turn)) + ego.half_length * abs(sin(turn))
    half = lanes.sample[ego.sample, WIDTH] / 2.0
    left, right = ego.offset + reach > half, ego.offset - reach < -half
    was_left, was_right = standing[1] != 0, standing[2] != 0
    if standing[0] < 0:
        was_left = was_right = True
    elif lane != standing[0]:
        if lane == lanes.left[standing[0]]:
            was_left, was_right = False, was_left
        elif lane == lanes.right[standing[0]]:
            was_left, was_right = was_right, False
    standing[0], standing[1], standing[2] = lane, left, right
    return LEFT * (left and not was_left) + RIGHT * (right and not was_right)


def invasions(
    m: Markings, map: RoadMap, placed: Places, tick: int, crossed: int
) -> tuple[LaneInvasion, ...]:
    """Returns the ego's lane invasion for each side in the bits `crossed`."""
    at, road = int(placed["sample"][EGO]), int(map.lanes.road[placed["lane"][EGO]])
    sides = [column[at] for bit, column in ((LEFT, m.left), (RIGHT, m.right)) if crossed & bit]
    return tuple(LaneInvasion(tick, Marking(int(kind)).name.lower(), road) for kind in sides)
