"""Which indicators shine in a replay: as the scenario file switches them, and before turns and lane changes.

A log holds the way that follows each moment, so a vehicle that will turn at a junction or change
its lane signals beforehand. The side is read off its logged path and the lanes.
"""

from __future__ import annotations

from math import radians

import numpy as np
from numpy.typing import NDArray

from skidpad.cockpit.replay import RecordedRun
from skidpad.cockpit.source import Source, index_at
from skidpad.core.arrays import Floats
from skidpad.core.setup import DT
from skidpad.core.vocabulary import ActorKind
from skidpad.recording.run.lamps import FLASH, Lamp, newest, read_lamps
from skidpad.recording.run.log import RunLog
from skidpad.roads.queries import LanePoint, RoadMap

SIDES = {Lamp.LEFT: (True, False), Lamp.RIGHT: (False, True), Lamp.WARNING: (True, True)}
LOOK = 0.5  # s between two looks at where vehicles go
LEAD, AFTER = 3.0, 1.5  # s before and after a manoeuvre's middle in which its indicator flashes
NEAR = 100.0  # m from the ego, beyond which no indicator is drawn large enough to be seen
TURN = radians(35.0)  # change of heading in a junction that counts as a turn
LEAST_WAY = 2.0  # m in LEAD, below which a vehicle goes nowhere
NO_SIDES = (False, False)


class TurnSignals:
    """The indicators of the actors of a recorded source, at any of its moments."""

    def __init__(self, source: Source) -> None:
        """Reads the lamps beside the source; FileError where they are damaged."""
        self._source, self._names = source, source.table.names
        rows = {name: i for i, name in enumerate(self._names)}
        self._changes = [
            (rows[c.entity], c)
            for c in read_lamps(source.folder)
            if c.lamp in SIDES and c.entity in rows
        ]
        self._log = source.log if isinstance(source, RecordedRun) else None
        self._intended: tuple[int, NDArray[np.bool_]] | None = None

    def at(self, tick: int) -> NDArray[np.bool_]:
        """Returns whose left and right indicators shine (n, 2) in a tick of the source."""
        t = tick * DT
        lit = np.zeros((len(self._names), 2), dtype=np.bool_)
        if self._log is not None and t % (2.0 * FLASH) < FLASH:
            lit |= self._intend(self._log, int(t / LOOK))
        switched = {row for row, c in self._changes if c.t <= t}
        lit[list(switched)] = False  # the file speaks for its own vehicles
        for change in newest((c for _, c in self._changes), t).values():
            if change.is_lit(t):
                lit[self._names.index(change.entity)] |= SIDES[change.lamp]
        return lit

    def _intend(self, log: RunLog, look: int) -> NDArray[np.bool_]:
        """Returns (n, 2) which sides vehicles near the ego want to go to, at one of the looks."""
        if self._intended is None or self._intended[0] != look:
            ticks = [round((look * LOOK + s) / DT) for s in (-AFTER, 0.0, LEAD)]
            k = tuple(index_at(self._source, tick) for tick in ticks)
            sides = np.zeros((len(self._names), 2), dtype=np.bool_)
            x, y = log.actors.x[k[1]], log.actors.y[k[1]]
            near = np.hypot(x - x[0], y - y[0]) < NEAR
            near &= log.present[list(k)].all(axis=0) & (log.table.kind <= ActorKind.MOTORCYCLE)
            for row in np.flatnonzero(near):
                path = _poses(log, k, int(row))
                sides[row] = find_side(self._source.map, path)
            self._intended = look, sides
        return self._intended[1]


def _poses(log: RunLog, k: tuple[int, ...], row: int) -> Floats:
    """Returns (len(k), 4) x, y, z, yaw of one actor at moments of the log."""
    a = log.actors
    return np.stack([f[list(k), row] for f in (a.x, a.y, a.z, a.yaw)], axis=1).astype(np.float64)


def find_side(map: RoadMap, path: Floats) -> tuple[bool, bool]:
    """Returns whether a vehicle signals to the left, to the right.

    path: (3, 4) x, y, z (m) and yaw (rad): a little ago, now, and in LEAD s.
    """
    if np.hypot(*(path[2, :2] - path[1, :2])) < LEAST_WAY:
        return NO_SIDES
    places = [map.project(*row[:3]) for row in path]
    if any(place is None for place in places):
        return NO_SIDES
    ago, now, then = (place for place in places if place is not None)
    turned = float(np.diff(np.unwrap(path[:, 3])).sum())
    if any(map.lanes.junction[p.lane] >= 0 for p in (ago, now, then)):
        return turned > TURN, turned < -TURN
    for a, b in ((now, then), (ago, now)):
        sides = _changes_lane(map, a, b)
        if any(sides):
            return sides
    return NO_SIDES


def _changes_lane(map: RoadMap, a: LanePoint, b: LanePoint) -> tuple[bool, bool]:
    """Returns whether b lies on a lane to the left, to the right of where the lane of a leads."""
    way = float(np.hypot(b.x - a.x, b.y - a.y))
    reached = map.all_ahead(a, way)
    if any(p.lane == b.lane for p in (a, *reached)):
        return NO_SIDES
    left = any(map.lanes.left[p.lane] == b.lane for p in (a, *reached))
    right = any(map.lanes.right[p.lane] == b.lane for p in (a, *reached))
    return left and not right, right and not left
