"""Speeds one after the other: the action of a speed profile."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import inf

from skidpad.scenarios.actions.base import Following, note_bound
from skidpad.scenarios.actions.jerk import (
    Jerk,
    Piece,
    SmoothProfile,
    pieces_under_way,
    round_corners,
    smooth_pieces,
)
from skidpad.scenarios.actions.speed import (
    MAX_SPEED,
    acceleration_under_way,
    finish_step,
    limit_speed,
)
from skidpad.scenarios.context import Context
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.entities import Performance, read_limits
from skidpad.scenarios.scene import Actor, Running, Scene

ELEMENT = "SpeedProfileAction"
DEFAULT_CHANGE = 10.0  # m/s^2, where a profile's file and its vehicle set no limit


@dataclass(frozen=True, slots=True)
class Profile:
    """Speeds one after the other; a time of None means as fast as the entity can."""

    entries: tuple[tuple[float, float | None], ...]  # speed in m/s, seconds
    other: str | None
    limits: Performance
    jerk: Jerk = Jerk()
    following: Following = Following.POSITION

    def begin(self, scene: Scene, actor: Actor) -> Running:
        """Begins the profile from the speed demanded so far; returns it running."""
        finish_step(scene, actor)
        own = actor.entity.performance if self.following is Following.FOLLOW else Performance()
        jerk = Jerk(min(self.jerk.up, own.a_rate), min(self.jerk.down, own.b_rate))
        if jerk.is_limited:
            going: Running = self._smooth(scene, actor, jerk)
        else:
            going = self._straight(scene, actor)
        actor.pace_by(going, scene)
        return going

    def _smooth(self, scene: Scene, actor: Actor, jerk: Jerk) -> Running:
        """Returns the profile with limits of jerk, several speeds with rounded corners.

        Where corners overlap the acceleration is 0 at each of its speeds.
        """
        if going := self._round_off(scene, actor, jerk):
            return going
        base = 0.0 if self.other is None else scene.actors[self.other].v_told
        own, v = actor.entity.performance, actor.guide.v
        pieces: list[Piece] = []
        for entry, duration in self.entries:
            end = limit_speed(base + entry, own)
            note_bound(scene, actor, ELEMENT, base + entry, end, MAX_SPEED)
            most = (self.limits.a_max, own.a_max) if end > v else (self.limits.b_max, own.b_max)
            pieces += smooth_pieces(v, end, min(*most, DEFAULT_CHANGE), jerk, duration)
            v = end
        return SmoothProfile(actor, scene.t, pieces, v)

    def _round_off(self, scene: Scene, actor: Actor, jerk: Jerk) -> Running | None:
        """Returns the profile as straight lines with rounded corners; None where that cannot be.

        A first entry at time 0 says nothing: it has the speed that it has.
        """
        base = 0.0 if self.other is None else scene.actors[self.other].v_told
        own, v = actor.entity.performance, actor.guide.v
        points: list[tuple[float, float]] = []
        for entry, duration in self.entries[self.entries[0][1] == 0.0 :]:
            end = limit_speed(base + entry, own)
            least = abs(end - v) / self._largest_change(own, end > v)
            takes = least if duration is None else max(duration, least)
            note_bound(scene, actor, ELEMENT, base + entry, end, MAX_SPEED)
            if duration:
                of = "duration, s, limits of <Performance> and of the file"
                note_bound(scene, actor, ELEMENT, duration, takes, of)
            if takes > 0.0:
                points.append((takes, end))
            elif end != v or duration is not None:
                return None
            v = end
        a, now = acceleration_under_way(actor), actor.guide.v
        pieces = None
        if len(self.entries) > 1 and points:
            pieces = round_corners(now, a, points, jerk)
        elif points and a != 0.0:
            limit = self._largest_change(own, v > now)
            pieces = pieces_under_way(now, a, v, limit, jerk, self.entries[0][1])
        return None if pieces is None else SmoothProfile(actor, scene.t, pieces, v)

    def _straight(self, scene: Scene, actor: Actor) -> Running:
        """Returns the profile as straight lines between its speeds."""
        base = 0.0 if self.other is None else scene.actors[self.other].v_told
        own = actor.entity.performance
        a = self._most(scene, actor, "maxAcceleration", self.limits.a_max, own.a_max)
        b = self._most(scene, actor, "maxDeceleration", self.limits.b_max, own.b_max)
        times, speeds = [scene.t], [actor.guide.v]
        for entry, duration in self.entries:
            v = limit_speed(base + entry, own)
            note_bound(scene, actor, ELEMENT, base + entry, v, MAX_SPEED)
            needed = abs(v - speeds[-1]) / (a if v > speeds[-1] else b)
            times.append(times[-1] + (needed if duration is None else duration))
            speeds.append(v)
        return Profiled(actor, times, speeds)

    def _largest_change(self, own: Performance, is_faster: bool) -> float:
        """Return the largest acceleration, or deceleration, of the profile, m/s^2."""
        if is_faster:
            return min(self.limits.a_max, own.a_max, DEFAULT_CHANGE)
        return min(self.limits.b_max, own.b_max, DEFAULT_CHANGE)

    def _most(self, scene: Scene, actor: Actor, name: str, asked: float, own: float) -> float:
        """Returns the m/s^2 of an entry without a time; notes where it is not the file's."""
        most = min(asked, own, DEFAULT_CHANGE)
        if asked < inf and any(duration is None for _, duration in self.entries):
            of = f"{name}, m/s^2, that of its <Performance> or {DEFAULT_CHANGE:g}"
            note_bound(scene, actor, ELEMENT, asked, most, of)
        return most


class Profiled:
    """A profile under way: straight lines between its speeds."""

    def __init__(self, actor: Actor, times: list[float], speeds: list[float]) -> None:
        self.actor, self.rows = actor, list(zip(times, speeds, strict=True))

    def step(self, scene: Scene) -> bool:
        """Sets the speed demanded for the end of this step; True when the last speed is reached."""
        if self.actor.longitudinal is not self:
            return True
        t, guide = scene.t + scene.dt, self.actor.guide
        for (t0, v0), (t1, v1) in pairwise(self.rows):
            if t0 <= t < t1:
                guide.a = (v1 - v0) / (t1 - t0)
                guide.v = v0 + guide.a * (t - t0)
                return False
        guide.v, guide.a = self.rows[-1][1], 0.0
        return True


def compile_profile(node: Node, ctx: Context) -> Profile:
    """Compiles a <SpeedProfileAction> with its entries (m/s, s) and its limits."""
    following = node.choice("followingMode", Following, Following.POSITION)
    entries = []
    for entry in node.children("SpeedProfileEntry"):
        duration = entry.number("time") if entry.has("time") else None
        if duration is not None and duration < 0.0:
            raise entry.error(f"time must be >= 0, got {duration:g}")
        entries.append((entry.number("speed"), duration))
    if not entries:
        raise node.error("needs a <SpeedProfileEntry>")
    limits = read_limits(node.find("DynamicConstraints"), rates=following is Following.FOLLOW)
    jerk = Jerk(*(rate if rate > 0.0 else inf for rate in (limits.a_rate, limits.b_rate)))
    other = ctx.entity(node) if node.has("entityRef") else None
    return Profile(tuple(entries), other, limits, jerk, following)
