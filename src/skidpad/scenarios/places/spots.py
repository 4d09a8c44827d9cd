"""Places on driving lanes where traffic may appear, and the regions that files draw around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from skidpad.core.arrays import Flags
from skidpad.core.geometry import Pose
from skidpad.roads.lanes import LaneKind
from skidpad.roads.queries import LanePoint, RoadMap
from skidpad.scenarios.movement.measures import between
from skidpad.scenarios.places.positions import Position
from skidpad.scenarios.scene import Actor, Scene

SPACING = 5  # samples, each at most 1 m, from one spot to the next
ABREAST = 2.0  # m, nearer than this sideways is in the same lane
Array = NDArray[Any]


class Spots(NamedTuple):
    """N places on lanes, in the direction of their traffic; arrays (N,), m and rad."""

    x: Array
    y: Array
    heading: Array
    road: Array
    lane_id: Array
    s_road: Array
    lane: Array
    s: Array

    def where(self, mask: Flags) -> Spots:
        """Returns the spots that a mask (N,) chooses."""
        return Spots(*(column[mask] for column in self))

    def free(self, actor: Actor, before: float, behind: float) -> Flags:
        """Returns (N,) whether a spot has room to an actor's centre in its lane: m before and behind it."""
        dx, dy = actor.pose.x - self.x, actor.pose.y - self.y
        c, s = np.cos(self.heading), np.sin(self.heading)
        forward = dx * c + dy * s
        along = (forward < before) & (forward > -behind)
        away: Flags = ~along | (np.abs(dy * c - dx * s) > ABREAST)
        return away


def spots_of(map: RoadMap) -> Spots:
    """Returns a spot at each SPACING-th sample of all driving lanes outside junctions."""
    lanes, samples = map.lanes, map.samples
    usable = (lanes.kind == LaneKind.DRIVING) & (lanes.junction < 0)
    k = np.flatnonzero(usable[samples.lane])[::SPACING]
    lane = samples.lane[k].astype(np.int64)
    return Spots(
        samples.x[k], samples.y[k], samples.heading[k], lanes.road[lane], lanes.lane_id[lane],
        samples.s_road[k], lane, samples.s[k],
    )  # fmt: skip


def spot_at(map: RoadMap, point: LanePoint) -> Spots:
    """Returns one lane point as spots of length 1."""
    values = (
        point.x, point.y, point.heading, point.road, point.lane_id, map.s_road(point), point.lane,
        point.s,
    )  # fmt: skip
    return Spots(*(np.array([value]) for value in values))


class Region(Protocol):
    """A part of the world, perhaps around something that moves."""

    def inside(self, scene: Scene, spots: Spots) -> Flags:
        """Returns the mask of the spots that lie in the region now."""
        ...


@dataclass(frozen=True, slots=True)
class Disc:
    """The area within a radius in m of a place."""

    centre: Position
    radius: float

    def inside(self, scene: Scene, spots: Spots) -> Flags:
        """Returns which spots lie within the radius of the centre."""
        pose = self.centre.place(scene).pose
        near: Flags = np.hypot(spots.x - pose.x, spots.y - pose.y) <= self.radius
        return near


@dataclass(frozen=True, slots=True)
class Oval:
    """An ellipse around an entity without a disc about it, all in m.

    offset: of the centre along the entity's x axis, which the major axis lies on (the standard does
    not say); rim: only from this share of the ellipse on.
    """

    entity: str
    offset: float
    major: float
    minor: float
    inner: float
    rim: float = 0.0

    def inside(self, scene: Scene, spots: Spots) -> Flags:
        """Returns which spots lie between the inner disc, or the rim, and the ellipse."""
        centre = scene.actors[self.entity].pose.moved(forward=self.offset)
        forward, left = between(centre, spots.x, spots.y)
        share = np.hypot(forward / self.major, left / self.minor)
        far: Flags = (np.hypot(forward, left) >= self.inner) & (share >= self.rim) & (share <= 1.0)
        return far


@dataclass(frozen=True, slots=True)
class Outline:
    """The area within a polygon of places."""

    corners: tuple[Position, ...]

    def inside(self, scene: Scene, spots: Spots) -> Flags:
        """Returns which spots lie inside, by the edges that a ray along x crosses (even and odd)."""
        poses = [corner.place(scene).pose for corner in self.corners]
        odd = np.zeros(len(spots.x), np.bool_)
        for a, b in zip(poses, [*poses[1:], poses[0]], strict=True):
            if a.y == b.y:
                continue
            spans = (a.y > spots.y) != (b.y > spots.y)
            odd ^= spans & (spots.x < a.x + (spots.y - a.y) * (b.x - a.x) / (b.y - a.y))
        return odd


class Stretch(NamedTuple):
    """Some lanes of a road, or all where none is named, between two places of its s in m."""

    road: int
    low: float
    high: float
    lanes: frozenset[int]


@dataclass(frozen=True, slots=True)
class Stretches:
    """An area that consists of stretches of roads."""

    parts: tuple[Stretch, ...]

    def inside(self, scene: Scene, spots: Spots) -> Flags:
        """Returns which spots lie inside, by road, lane and s."""
        del scene
        found = np.zeros(len(spots.x), np.bool_)
        for part in self.parts:
            on = (
                (spots.road == part.road) & (spots.s_road >= part.low) & (spots.s_road <= part.high)
            )
            if part.lanes:
                on &= np.isin(spots.lane_id, list(part.lanes))
            found |= on
        return found


def along(pose: Pose, spots: Spots) -> Flags:
    """Returns (N,) whether a spot's traffic runs as the pose looks."""
    same: Flags = np.cos(spots.heading - pose.yaw) > 0.0
    return same
