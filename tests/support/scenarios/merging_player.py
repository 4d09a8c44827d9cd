"""How esmini reads trajectories by default, written from its description: an oracle for exports.

The first and the last vertex of a trajectory stay. A vertex nearer than 0.1 m to the one kept before
it, with about the same heading, is left out; where the next far one comes a second or more after the
kept one, the stand is kept to the time of the last near one. Trajectories of two vertices are left
alone. Time chooses the length along the remaining polygon.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from math import hypot, pi
from pathlib import Path

from lxml import etree

RADIUS, STAND, TURN, SMALL = 0.1, 1.0, 0.1, 1e-6


def alike(a, b):
    turn = (a[3] - b[3] + pi) % (2 * pi) - pi
    return hypot(a[1] - b[1], a[2] - b[2]) < RADIUS + SMALL and turn < TURN + SMALL


def merged(rows):
    """Rows t, x, y, h without those that esmini merges."""
    if len(rows) <= 2:
        return rows
    kept, k = [rows[0]], 1
    while k < len(rows):
        if k == len(rows) - 1 or not alike(kept[-1], rows[k]):
            kept.append(rows[k])
            k += 1
            continue
        far = next((j for j in range(k + 1, len(rows)) if not alike(kept[-1], rows[j])), None)
        if far is None:
            return [*kept, rows[-1]]
        if rows[far][0] - kept[-1][0] >= STAND + SMALL:
            kept.append((rows[far - 1][0], *kept[-1][1:]))
        kept.append(rows[far])
        k = far + 1
    return kept


@dataclass
class Led:
    """One trajectory and when its event begins."""

    begin: float
    rows: list

    def at(self, t):
        times = [r[0] for r in self.rows]
        k = bisect_right(times, t) - 1
        if k < 0:
            return self.rows[0][1:3]
        if k >= len(times) - 1:
            return self.rows[-1][1:3]
        a, b = self.rows[k], self.rows[k + 1]
        u = (t - a[0]) / (b[0] - a[0])
        return a[1] + u * (b[1] - a[1]), a[2] + u * (b[2] - a[2])


def led(file: Path) -> dict[str, list[Led]]:
    """Entity -> its trajectories as they are followed, in the order of their begins."""
    found = {}
    for group in etree.parse(str(file)).getroot().iter("ManeuverGroup"):
        name = group.find("Actors/EntityRef").get("entityRef")
        mine = []
        for event in group.iter("Event"):
            rows = []
            for v in event.iter("Vertex"):
                place = v.find(".//WorldPosition")
                rows.append((float(v.get("time")), *(float(place.get(k)) for k in "xyh")))
            if rows:
                begin = float(event.find(".//SimulationTimeCondition").get("value"))
                mine.append(Led(begin, merged(rows)))
        found[name] = sorted(mine, key=lambda led: led.begin)
    return found


def place(mine: list[Led], t: float):
    """Where an entity is at time t: the last trajectory that began before leads it."""
    return [one for one in mine if one.begin < t - SMALL or one is mine[0]][-1].at(t)
