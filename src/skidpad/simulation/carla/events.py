"""Collisions and lane invasions as CARLA's event sensors tell them (A-029, A-030)."""

from __future__ import annotations

import re
from collections import deque
from collections.abc import Sequence
from math import hypot
from typing import Any

from skidpad.core.lefthanded import vector_from_carla
from skidpad.core.states import ActorStates, ContactEvent, LaneInvasion
from skidpad.roads.lanes import Marking
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla.cast import Player

HOLD = 0.5  # s: bodies that bounce apart and touch again within this are one contact
CROSSING = 2.0  # s: CARLA tells each corner of the outline; those of one crossing are one invasion
QUIET = 3  # ticks after a relocation in which crossing markings is no invasion
EGO = 0


class EgoEvents:
    """What the ego's two event sensors said; callbacks of the wheel's threads only append."""

    def __init__(self, map: RoadMap, players: Sequence[Player], dt: float) -> None:
        self._map, self._players = map, players
        self._hold = round(HOLD / dt)
        self._collisions: deque[Any] = deque()
        self._invasions: deque[Any] = deque()
        self._last: dict[int | str, int] = {}
        self._crossing = round(CROSSING / dt)
        self._crossed: dict[str, int] = {}  # tick in which a marking was last told
        self._quiet_until = 0

    def hear_collision(self, event: Any) -> None:
        """Callback of sensor.other.collision."""
        self._collisions.append(event)

    def hear_invasion(self, event: Any) -> None:
        """Callback of sensor.other.lane_invasion."""
        self._invasions.append(event)

    def forget(self, tick: int) -> None:
        """The ego was put somewhere else: the way there crossed nothing."""
        self._quiet_until = tick + QUIET

    def contacts(self, tick: int, before: ActorStates) -> tuple[ContactEvent, ...]:
        """Contacts that began. before: states of the previous tick, for the closing speed."""
        rows = {p.actor.id: i for i, p in enumerate(self._players) if p.actor is not None}
        found: dict[int | str, ContactEvent] = {}
        touched: set[int | str] = set()
        for event in drain(self._collisions):
            other = event.other_actor
            row = -1 if other is None else rows.get(other.id, -1)
            static = "" if row >= 0 else thing(other)
            key = static or row
            began = tick - self._last.get(key, -self._hold - 1) > self._hold
            touched.add(key)
            push = event.normal_impulse
            impulse = hypot(push.x, push.y, push.z)
            if began and (key not in found or impulse > found[key].impulse):
                v_closing = closing(before, row, vector_from_carla(push.x, push.y, push.z))
                place = event.transform.location
                x, y, _ = vector_from_carla(place.x, place.y, place.z)
                found[key] = ContactEvent(tick, row, static, impulse, v_closing, x, y)
        self._last.update(dict.fromkeys(touched, tick))
        return tuple(found.values())

    def invasions(self, tick: int, states: ActorStates) -> tuple[LaneInvasion, ...]:
        """Markings that the ego's outline began to cross."""
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
    """`solid_broken` of carla.LaneMarkingType.SolidBroken, `other` for what our maps do not know."""
    words = re.findall("[A-Z][a-z]*", str(kind).rsplit(".", 1)[-1])
    name = "_".join(words).upper()
    return name.lower() if name in Marking.__members__ else "other"


def drain(queue: deque[Any]) -> list[Any]:
    """Everything that has arrived by now."""
    return [queue.popleft() for _ in range(len(queue))]


def thing(other: Any) -> str:
    """`guardrail` of `static.guardrail`; what has no name is "static"."""
    name = "" if other is None else str(other.type_id).rsplit(".", 1)[-1]
    return name or "static"


def closing(before: ActorStates, row: int, push: tuple[float, float, float]) -> float:
    """Speed along the impulse with which the ego and the other came together, m/s, >= 0."""
    size = hypot(push[0], push[1])
    vx, vy = before.vx[EGO], before.vy[EGO]
    if row >= 0:
        vx, vy = vx - before.vx[row], vy - before.vy[row]
    if size == 0.0:
        return float(hypot(vx, vy))
    return float(abs(vx * push[0] + vy * push[1]) / size)
