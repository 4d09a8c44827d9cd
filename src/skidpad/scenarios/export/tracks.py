"""Hazard worlds as tracks: one per entity, with times, places and headings, for export."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, hypot, sin

import numpy as np

from skidpad.core.arrays import Floats
from skidpad.core.channels import ChannelFrame
from skidpad.core.vocabulary import SemanticClass
from skidpad.recording.hazards.records import HazardRecord

V_STANDING = 0.5  # m/s, below it the heading is held
GAP_MAX = 0.35  # s without the object that still is one track
MATCH_DISTANCE = 3.0  # m between expected and reported place of an object without identity
MIN_SIZE = 0.1  # m


@dataclass(slots=True)
class Track:
    """One entity's motion; times in s from the start of the record."""

    name: str
    channel: str
    is_ego: bool
    label: int  # SemanticClass, -1: unknown
    box: tuple[float, float, float, float]  # length, width, centre x, centre y in its own frame
    t: list[float] = field(default_factory=list)
    x: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)
    heading: list[float] = field(default_factory=list)
    v: list[float] = field(default_factory=list)
    id: int = -1
    z: list[float] = field(default_factory=list)  # empty: on flat ground
    height: float = 0.0  # m; 0: that of its class
    colour: str = "#FFFFFF"
    ghost: bool = False  # it touches nothing

    def stretches(self) -> list[tuple[int, int]]:
        """Returns first index and index after the last one of each time that it is there.

        A gap of more than GAP_MAX ends one.
        """
        breaks = (np.flatnonzero(np.diff(self.t) > GAP_MAX) + 1).tolist()
        return list(zip([0, *breaks], [*breaks, len(self.t)], strict=True))

    def add(self, t: float, state: list[float]) -> None:
        """Appends the state x, y, heading, vx, vy at t s; below V_STANDING the heading is held."""
        x, y, heading, vx, vy = state
        v = hypot(vx, vy)
        if v < V_STANDING and self.heading:
            heading = self.heading[-1]
        elif self.heading:  # no leap of a full turn between vertices
            turns = round((heading - self.heading[-1]) / (2.0 * np.pi))
            heading -= turns * 2.0 * np.pi
        self.t.append(t)
        self.x.append(x)
        self.y.append(y)
        self.heading.append(heading)
        self.v.append(v if vx * cos(heading) + vy * sin(heading) >= 0.0 else -v)

    def distance(self, t: float, x: float, y: float) -> float:
        """Returns the m of a place at t s from where the track would be at its last velocity."""
        ahead = (t - self.t[-1]) * self.v[-1]
        h = self.heading[-1]
        return hypot(x - self.x[-1] - ahead * cos(h), y - self.y[-1] - ahead * sin(h))


def tracks(record: HazardRecord, channels: tuple[str, ...]) -> list[Track]:
    """Returns the egos and objects of `channels` in the worlds of a record, egos first; [] without worlds."""
    egos: list[Track] = []
    objects: list[Track] = []
    if not record.worlds:
        return []
    t0 = record.worlds[0].t
    for c, name in enumerate(record.channels):
        if name not in channels:
            continue
        ego = Track(f"Ego_{name}", name, True, SemanticClass.CAR, (0.0, 0.0, 0.0, 0.0))
        mine: list[Track] = []
        for cycle in record.worlds:
            frame = cycle.frames[c]
            if frame is None:
                continue
            t = round(cycle.t - t0, 3)
            if np.isfinite(frame.ego).all():
                ego.box = _box(frame.ego_polygon)
                ego.add(t, frame.ego.tolist())
            _extend(mine, name, t, frame)
        if ego.t:
            egos.append(ego)
        objects.extend(mine)
    return egos + objects


def _extend(mine: list[Track], channel: str, t: float, frame: ChannelFrame) -> None:
    """Adds the objects of one frame at t s to the tracks of their channel, or begins new ones."""
    free = [track for track in mine if t - track.t[-1] <= GAP_MAX]
    for i, state in enumerate(frame.objects.tolist()):
        if not np.isfinite(state).all():
            continue
        identity = int(frame.ids[i])
        track = _find(free, identity, t, state)
        if track is None:
            shape = frame.polygons[i, : frame.polygon_size[i]]
            track = Track(
                f"{channel}_{len(mine) + 1}", channel, False, int(frame.classes[i]), _box(shape)
            )
            track.id = identity
            mine.append(track)
        else:
            free.remove(track)
        track.add(t, state)


def _find(free: list[Track], identity: int, t: float, state: list[float]) -> Track | None:
    """Returns the track of an object among those not taken yet; None where there is none.

    With an identity the track that has it; for -1 the nearest without one within MATCH_DISTANCE.
    """
    if identity >= 0:
        return next((track for track in free if track.id == identity), None)
    near = [(track.distance(t, state[0], state[1]), k) for k, track in enumerate(free)]
    near = [n for n in near if n[0] <= MATCH_DISTANCE and free[n[1]].id < 0]
    return free[min(near)[1]] if near else None


def _box(polygon: Floats) -> tuple[float, float, float, float]:
    """Returns length, width and centre of the box around a polygon in its own frame, m.

    No size is below MIN_SIZE.
    """
    points = polygon[np.isfinite(polygon).all(axis=1)]
    if len(points) == 0:
        return MIN_SIZE, MIN_SIZE, 0.0, 0.0
    low, high = points.min(axis=0), points.max(axis=0)
    (length, width), (x, y) = np.maximum(high - low, MIN_SIZE), (low + high) / 2.0
    return float(length), float(width), float(x), float(y)
