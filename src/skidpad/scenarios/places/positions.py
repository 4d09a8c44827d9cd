"""Positions: one small class each, found through the table at the end.

A place that does not depend on anything that moves is worked out when the file is read.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from math import cos, pi
from typing import Protocol

from skidpad.core.errors import ConfigError
from skidpad.core.geometry import Pose, wrap_angle
from skidpad.roads.projection import map_place
from skidpad.scenarios.context import Context
from skidpad.scenarios.movement.network import END_SLACK, Place, next_lane_id
from skidpad.scenarios.reading.document import Node
from skidpad.scenarios.reading.findings import Kind
from skidpad.scenarios.scene import Scene


class Position(Protocol):
    """A place, perhaps relative to something that moves."""

    def place(self, scene: Scene) -> Place:
        """Returns the place where it is now."""
        ...


class Frame(Enum):
    """What an orientation counts from."""

    ABSOLUTE = "absolute"
    RELATIVE = "relative"


@dataclass(frozen=True, slots=True)
class Orientation:
    """The heading of an <Orientation>; None where the file says nothing."""

    heading: float | None
    frame: Frame

    def to_world_heading(self, base: float) -> float:
        """Returns the heading in the world in rad, where `base` is that of what it may be relative to."""
        if self.heading is None:
            return base
        return wrap_angle(self.heading + (base if self.frame is Frame.RELATIVE else 0.0))


def orientation(node: Node) -> Orientation:
    """Reads the orientation of a position; without one it faces the way its reference faces."""
    found = node.find("Orientation")
    if found is None:
        return Orientation(None, Frame.RELATIVE)
    heading = found.number("h") if found.has("h") else None
    return Orientation(heading, found.choice("type", Frame, Frame.ABSOLUTE))


@dataclass(frozen=True, slots=True)
class Fixed:
    """A place that never changes."""

    fixed: Place

    def place(self, scene: Scene) -> Place:
        """Returns the same place at all times."""
        del scene
        return self.fixed


def _world(node: Node, ctx: Context) -> Position:
    """Compiles a position in world coordinates in m, with its heading in rad."""
    pose = Pose(
        node.number("x"), node.number("y"), node.number("z", 0.0),
        yaw=wrap_angle(node.number("h", 0.0)),
    )  # fmt: skip
    return Fixed(ctx.network.place_of(pose))


def _lane(node: Node, ctx: Context) -> Position:
    """Compiles a position in lane coordinates (s, offset in m); an s beyond the lane is cut, with a note."""
    road, lane = ctx.road(node), node.whole("laneId")
    s, offset = node.number("s"), node.number("offset", 0.0)
    try:
        if lane == 0:  # the line in the middle, where no lane is
            return Fixed(_facing(ctx.network.on_road(road, s, offset), orientation(node)))
        inside = ctx.network.within(road, lane, s)
        place = ctx.network.on_lane(road, lane, inside, offset)
    except ConfigError as error:
        raise node.error(str(error)) from None
    if abs(inside - s) > END_SLACK:
        what = f"s = {s:g} lies beyond the lane; its end at {inside:g} is taken"
        ctx.findings.append(node.finding(what, Kind.NOTE))
    return Fixed(_facing(place, orientation(node)))


def _road(node: Node, ctx: Context) -> Position:
    """Compiles a position in road coordinates (s and t in m)."""
    try:
        place = ctx.network.on_road(ctx.road(node), node.number("s"), node.number("t"))
    except ConfigError as error:
        raise node.error(str(error)) from None
    return Fixed(_facing(place, orientation(node)))


def _geo(node: Node, ctx: Context) -> Position:
    """Compiles a position in degrees of latitude and longitude, by the projection of the map."""
    lat = node.number("latitudeDeg") if node.has("latitudeDeg") else node.number("latitude")
    lon = node.number("longitudeDeg") if node.has("longitudeDeg") else node.number("longitude")
    try:
        x, y = map_place(ctx.network.map.geo_reference, lat, lon)
    except ConfigError as error:
        raise node.error(str(error)) from None
    place = ctx.network.place_of(Pose(x, y, node.number("altitude", 0.0)))
    return Fixed(_facing(place, orientation(node)))


def _facing(place: Place, facing: Orientation) -> Place:
    """Returns the place with its yaw turned to the given orientation."""
    return replace(place, pose=replace(place.pose, yaw=facing.to_world_heading(place.pose.yaw)))


@dataclass(frozen=True, slots=True)
class RelativeLane:
    """A place some metres along and some lanes aside of an entity.

    along_lane: ds is measured along the lane, and ds, dLane and offset count in its driving
    direction; else ds is measured along the road's reference line, and all count as the road runs.
    """

    other: str
    lanes: int
    ds: float
    offset: float
    along_lane: bool
    facing: Orientation

    def place(self, scene: Scene) -> Place:
        """Returns the place seen from the entity's lane now; on its own lane where there is no other."""
        network = scene.network
        at = scene.actors[self.other].place(network)
        pose, here = at.pose, at.lane
        if here is None:
            moved = pose.moved(forward=self.ds, left=self.offset)
            return Place(replace(moved, yaw=self.facing.to_world_heading(pose.yaw)))
        forward = network.forward(here)
        backwards = not (forward or self.along_lane)
        sign = -1 if self.along_lane and not forward else 1
        way = -self.ds if backwards else self.ds
        if self.along_lane:
            point = network.ahead(here, way) or here
        else:
            point = network.ahead_on_roads(here, way, ())
        if self.lanes:
            point = network.beside(point, next_lane_id(here.lane_id, sign * self.lanes)) or point
        aligned = network.forward(point)
        left = self.offset if (aligned or self.along_lane) else -self.offset
        base = point.heading if (aligned or self.along_lane) else point.heading + pi
        spot = network.aside(point, left)
        pose = replace(spot, yaw=self.facing.to_world_heading(wrap_angle(base)))
        return Place(pose, replace(point, offset=left))


@dataclass(frozen=True, slots=True)
class RelativeRoad:
    """Shifted from an entity in the road's s and t."""

    other: str
    ds: float
    dt: float
    facing: Orientation

    def place(self, scene: Scene) -> Place:
        """Seen from the entity now; the shift goes on along connecting roads and ends with the last one."""
        network, pose = scene.network, scene.actors[self.other].pose
        at, here = network.coordinates(pose), network.place_of(pose).lane
        if at is None or here is None:
            return Place(pose.moved(forward=self.ds, left=self.dt))
        t, s = at.t + self.dt, at.s + self.ds
        if 0.0 <= s <= network.roads[at.road].length:
            return _facing(network.on_road(at.road, s, t), self.facing)
        forward = network.forward(here)
        point = network.ahead_on_roads(here, self.ds if forward else -self.ds, ())
        turns = network.forward(point) is not forward  # the next road runs the other way
        found = network.on_road(point.road, network.map.s_road(point), -t if turns else t)
        if turns:
            found = replace(found, pose=replace(found.pose, yaw=wrap_angle(found.pose.yaw + pi)))
        return _facing(found, self.facing)


@dataclass(frozen=True, slots=True)
class RelativeObject:
    """Ahead and left of an entity, in its own axes, or in those of the world."""

    other: str
    dx: float
    dy: float
    own_axes: bool
    facing: Orientation

    def place(self, scene: Scene) -> Place:
        """Returns the place as seen from the entity's present pose."""
        pose = scene.actors[self.other].pose
        if self.own_axes:
            roll = scene.network.slopes(pose)[1] if scene.network.is_banked else 0.0
            moved = pose.moved(forward=self.dx, left=self.dy * cos(roll))
        else:
            moved = replace(pose, x=pose.x + self.dx, y=pose.y + self.dy)
        return scene.network.place_of(replace(moved, yaw=self.facing.to_world_heading(pose.yaw)))


def _relative_lane(node: Node, ctx: Context) -> Position:
    """Compiles a position some lanes beside and some m along from an entity (`ds` or `dsLane`)."""
    along_lane = node.has("dsLane")
    return RelativeLane(
        ctx.entity(node),
        node.whole("dLane"),
        node.number("dsLane" if along_lane else "ds", 0.0),
        node.number("offset", 0.0),
        along_lane,
        orientation(node),
    )


def _relative_road(node: Node, ctx: Context) -> Position:
    """Compiles a position at (ds, dt) in m in road coordinates from an entity."""
    return RelativeRoad(ctx.entity(node), node.number("ds"), node.number("dt"), orientation(node))


def _relative_object(node: Node, ctx: Context) -> Position:
    """Compiles a position at (dx, dy) in m from an entity, in its axes or in those of the world."""
    own = node.tag == "RelativeObjectPosition"
    dx, dy = node.number("dx"), node.number("dy")
    return RelativeObject(ctx.entity(node), dx, dy, own, orientation(node))


POSITIONS: Mapping[str, Callable[[Node, Context], Position]] = {
    "WorldPosition": _world,
    "LanePosition": _lane,
    "RoadPosition": _road,
    "GeoPosition": _geo,
    "RelativeLanePosition": _relative_lane,
    "RelativeRoadPosition": _relative_road,
    "RelativeObjectPosition": _relative_object,
    "RelativeWorldPosition": _relative_object,
}


def position(node: Node, ctx: Context) -> Position:
    """Compiles the position inside a <Position>; raises an error for an unsupported one."""
    inner = node.only()
    make = POSITIONS.get(inner.tag) or ctx.further_positions.get(inner.tag)
    if make is None:
        raise inner.unsupported_fault()
    return make(inner, ctx)
