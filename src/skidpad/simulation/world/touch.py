"""Events of the ego: contacts that begin, and lane markings that its outline crosses."""

from __future__ import annotations

from collections.abc import Mapping
from math import cos, sin

from skidpad.core.states import ActorTable, ContactEvent, LaneInvasion
from skidpad.physics.contact import Contacts
from skidpad.roads.lanes import Marking
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.traffic.occupancy import PLACE, Places

HOLD = 0.5  # s: bodies that bounce apart and touch again within this are one contact
EGO = 0
FIELDS = PLACE.names or ()


class ContactBook:
    """Which contacts are new: a pair (or the ego and a kind of obstacle) begins once (A-029)."""

    def __init__(self, names: tuple[str, ...], dt: float) -> None:
        self.names = names
        self.hold = round(HOLD / dt)
        self.last: dict[tuple[int, int | str], int] = {}
        self.background = 0  # contacts among the others that began so far

    def arrange(self, rows: Mapping[int, int]) -> None:
        """The actors have other rows; rows: the new one by the old one of those who stay."""
        self.last = {
            (rows[i], j if isinstance(j, str) else rows[j]): tick
            for (i, j), tick in self.last.items()
            if i in rows and (isinstance(j, str) or j in rows)
        }

    def update(self, tick: int, contacts: Contacts, count: int) -> tuple[ContactEvent, ...]:
        """Contacts of the ego that began in this tick; the largest impulse speaks for each."""
        events: dict[tuple[int, int | str], ContactEvent] = {}
        touched: set[tuple[int, int | str]] = set()
        for k in range(count):
            if contacts.impulse[k] <= 0.0:
                continue  # side by side, or parting already
            i, j = int(contacts.i[k]), int(contacts.j[k])
            static = self.names[int(contacts.segment[k])] if j < 0 else ""
            pair: tuple[int, int | str] = (i, static if j < 0 else j)
            began = tick - self.last.get(pair, -self.hold - 1) > self.hold
            if i != EGO:
                self.background += int(began and pair not in touched)
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
        return tuple(events.values())


class MarkingWatch:
    """Reports a marking when the ego's outline begins to lie across it (A-030)."""

    def __init__(self, map: RoadMap, table: ActorTable) -> None:
        self.map = map
        self.half_length = float(table.length[EGO]) / 2.0
        self.half_width = float(table.width[EGO]) / 2.0
        self.lane = -1
        self.across = (False, False)  # left, right marking of the present lane

    def forget(self) -> None:
        """The ego was put somewhere else: what it stands across there is no invasion."""
        self.lane = -1

    def update(self, tick: int, placed: Places) -> tuple[LaneInvasion, ...]:
        """Markings that the outline began to cross in this tick."""
        place = dict(zip(FIELDS, placed[EGO].item(), strict=True))
        lane = place["lane"]
        if lane < 0:
            self.lane = -1
            return ()
        turn = place["yaw"] - place["heading"]
        reach = self.half_width * abs(cos(turn)) + self.half_length * abs(sin(turn))
        lanes = self.map.lanes
        at, offset = place["sample"], place["offset"]
        half = float(self.map.samples.width[at]) / 2.0
        across = (offset + reach > half, offset - reach < -half)
        before = self._before(lane)
        self.lane, self.across = lane, across
        samples = self.map.samples
        events = []
        for now, was, marking in zip(
            across, before, (samples.marking_left[at], samples.marking_right[at]), strict=True
        ):
            if now and not was:
                name = Marking(int(marking)).name.lower()
                events.append(LaneInvasion(tick, name, int(lanes.road[lane])))
        return tuple(events)

    def _before(self, lane: int) -> tuple[bool, bool]:
        """Of the markings of `lane`, those across which the ego already stood."""
        if self.lane < 0:
            return (True, True)
        if lane == self.lane:
            return self.across
        left, right = self.across
        if lane == int(self.map.lanes.left[self.lane]):
            return (False, left)
        if lane == int(self.map.lanes.right[self.lane]):
            return (right, False)
        return self.across  # the next lane of the same strip
