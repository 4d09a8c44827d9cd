"""Collisions and lane invasions as CARLA's event sensors tell them (A-029, A-030)."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Sequence
from math import hypot
from typing import Any

from skidpad.core.arrays import Floats
from skidpad.core.states import ActorStates, ContactEvent, LaneInvasion
from skidpad.roads.lanes import Marking
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla.actor_rows import ActorRow
from skidpad.simulation.carla.axes import from_vector

HOLD = 0.5  # s: bodies that bounce apart and touch again within this are one contact
CROSSING = 2.0  # s: CARLA tells each corner of the outline; those of one crossing are one invasion
PAST = 10  # frames that are remembered
QUIET = 3  # ticks after a relocation in which crossing markings is no invasion
EGO = 0


class EgoEvents:
    """What the ego's two event sensors said; callbacks of the wheel's threads only append."""

    def __init__(self, map: RoadMap, players: Sequence[ActorRow], dt: float) -> None:
        self._map, self._players = map, players
        self._hold = round(HOLD / dt)
        self._collisions: deque[Any] = deque()
        self._invasions: deque[Any] = deque()
        self._past: dict[int, tuple[Floats, Floats]] = {}  # vx, vy by the server's frame
        self._last: dict[int | str, int] = {}
        self._crossing = round(CROSSING / dt)
        self._crossed: dict[str, int] = {}  # tick in which a marking was last told
        self._quiet_until = 0

    def hear_collision(self, event: Any) -> None:
        """Stores a message of sensor.other.collision."""
        self._collisions.append(event)

    def hear_invasion(self, event: Any) -> None:
        """Stores a message of sensor.other.lane_invasion."""
        self._invasions.append(event)

    def forget(self, tick: int) -> None:
        """Ignores lane invasions for QUIET ticks: the ego was put elsewhere and crossed nothing."""
        self._quiet_until = tick + QUIET

    def remember(self, frame: int, states: ActorStates) -> None:
        """Notes the velocities of a frame, as an event that comes late is about an earlier one.

        frame: the server's number; PAST frames are kept.
        """
        self._past[frame] = (states.vx.copy(), states.vy.copy())
        self._past.pop(frame - PAST, None)

    def contacts(self, tick: int, frame: int) -> tuple[ContactEvent, ...]:
        """Returns the contacts that began since the last call, the hardest of each pair; () for none.

        Touching again within HOLD s begins no contact. frame: the server's number of this tick.
        """
        rows = {p.actor.id: i for i, p in enumerate(self._players) if p.actor is not None}
        found: dict[int | str, ContactEvent] = {}
        touched: dict[int | str, int] = {}
        for event in drain(self._collisions):
            at = tick - max(frame - event.frame, 0)
            other = event.other_actor
            row = -1 if other is None else rows.get(other.id, -1)
            static = "" if row >= 0 else thing(other)
            key = static or row
            began = at - self._last.get(key, -self._hold - 1) > self._hold
            touched[key] = at
            push = from_vector(event.normal_impulse)
            impulse = hypot(*push)
            if began and (key not in found or impulse > found[key].impulse):
                x, y, _ = from_vector(event.transform.location)
                v_closing = self._closing(event.frame, row, push)
                found[key] = ContactEvent(at, row, static, impulse, v_closing, x, y)
        self._last.update(touched)
        return tuple(found.values())

    def _closing(self, frame: int, row: int, push: tuple[float, float, float]) -> float:
        """Returns the closing speed in m/s with actor `row` before a frame; 0.0 without earlier states."""
        before = [f for f in self._past if f < frame] or list(self._past)
        if not before:
            return 0.0
        vx, vy = self._past[max(before)]
        return closing(vx, vy, row, push)

    def invasions(self, tick: int, states: ActorStates) -> tuple[LaneInvasion, ...]:
        """Returns markings that the ego's outline began to cross since the last call; () for none.

        One told again within CROSSING s is the same crossing.
        """
        events = drain(self._invasions)
        if not events or tick <= self._quiet_until:
            return ()
        names = {marking_name(m.type): None for e in events for m in e.crossed_lane_markings}
        begun = [
            n for n in names if tick - self._crossed.get(n, -self._crossing - 1) > self._crossing
        ]
        self._crossed.update(dict.fromkeys(names, tick))
        point = self._map.project(states.x[EGO], states.y[EGO], states.z[EGO])
        road = -1 if point is None else point.road
        return tuple(LaneInvasion(tick, name, road) for name in begun)


def marking_name(kind: Any) -> str:
    """Returns `solid_broken` of carla.LaneMarkingType.SolidBroken, `other` for one our maps do not know."""
    words = re.findall("[A-Z][a-z]*", str(kind).rsplit(".", 1)[-1])
    name = "_".join(words).upper()
    return name.lower() if name in Marking.__members__ else "other"


def drain(queue: deque[Any]) -> list[Any]:
    """Removes and returns everything that has arrived in the queue by now."""
    return [queue.popleft() for _ in range(len(queue))]


def thing(other: Any) -> str:
    """Returns `guardrail` of `static.guardrail`; "static" for None and what has no name."""
    name = "" if other is None else str(other.type_id).rsplit(".", 1)[-1]
    return name or "static"


def closing(vx: Floats, vy: Floats, row: int, push: tuple[float, float, float]) -> float:
    """Returns the speed along the impulse with which the ego and the other came together, m/s, >= 0.

    vx, vy: (n,) before the contact. row: of the other, -1: it stands still. push: impulse; without one the
    whole speed counts.
    """
    size = hypot(push[0], push[1])
    x, y = vx[EGO], vy[EGO]
    if row >= 0:
        x, y = x - vx[row], y - vy[row]
    if size == 0.0:
        return float(hypot(x, y))
    return float(abs(x * push[0] + y * push[1]) / size)
