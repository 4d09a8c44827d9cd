"""Positions: one small class each, found through the table at the end."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Protocol

from skidpad.core.geometry import Pose, wrap_angle
from skidpad.core.setup import LanePosition
from skidpad.scenarios.reader import Node, Unsupported
from skidpad.scenarios.scene import Scene


class Position(Protocol):
    """A place, perhaps relative to something that moves."""

    def pose(self, scene: Scene, actor: str) -> Pose:
        """Where it is now."""
        ...


class World:
    """Coordinates of the world."""

    def __init__(self, node: Node) -> None:
        self.fixed = Pose(
            node.number("x"),
            node.number("y"),
            node.number("z", 0.0),
            yaw=wrap_angle(node.number("h", 0.0)),
        )

    def pose(self, scene: Scene, actor: str) -> Pose:
        """The same at all times."""
        del scene, actor
        return self.fixed


class Lane:
    """A place on a lane; heading along it, turned by a relative <Orientation>."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.place = LanePosition(
            int(node.number("roadId")),
            int(node.number("laneId")),
            node.number("s"),
            node.number("offset", 0.0),
        )
        self.turn = _relative_heading(node)

    def pose(self, scene: Scene, actor: str) -> Pose:
        """By the map; FileError when the lane is not there."""
        del actor
        try:
            point = scene.map.place(self.place)
        except ValueError as error:
            raise self.node.error(str(error)) from None
        left = point.offset if self.place.lane < 0 else -point.offset
        pose = point.pose.moved(left=left)
        return replace(pose, yaw=wrap_angle(pose.yaw + self.turn))


class RelativeLane:
    """So many metres along and lanes aside of an entity."""

    def __init__(self, node: Node) -> None:
        self.node, self.other = node, node.text("entityRef")
        self.lanes = int(node.number("dLane"))
        self.ds, self.offset = node.number("ds"), node.number("offset", 0.0)
        self.turn = _relative_heading(node)

    def pose(self, scene: Scene, actor: str) -> Pose:
        """Seen from the entity's lane now."""
        del actor
        m = scene.actors[self.other].motion
        here = scene.map.project(m.x, m.y, 0.0)
        beside = scene.map.shifted(here, self.lanes) if here is not None else None
        place = scene.map.ahead(beside, self.ds) if beside is not None else None
        if place is None:
            raise self.node.error(f"there is no such lane beside {self.other}")
        pose = place.pose.moved(left=self.offset)
        return replace(pose, yaw=wrap_angle(pose.yaw + self.turn))


class RelativeObject:
    """Ahead and left of an entity, in its own axes."""

    def __init__(self, node: Node) -> None:
        self.other = node.text("entityRef")
        self.dx, self.dy = node.number("dx"), node.number("dy")
        self.turn = _relative_heading(node)

    def pose(self, scene: Scene, actor: str) -> Pose:
        """Seen from the entity now."""
        del actor
        m = scene.actors[self.other].motion
        pose = Pose(m.x, m.y, yaw=m.yaw).moved(forward=self.dx, left=self.dy)
        return replace(pose, yaw=wrap_angle(pose.yaw + self.turn))


class RelativeWorld:
    """Shifted from an entity in the axes of the world."""

    def __init__(self, node: Node) -> None:
        self.other = node.text("entityRef")
        self.dx, self.dy = node.number("dx"), node.number("dy")
        self.turn = _relative_heading(node)

    def pose(self, scene: Scene, actor: str) -> Pose:
        """Seen from the entity now."""
        del actor
        m = scene.actors[self.other].motion
        return Pose(m.x + self.dx, m.y + self.dy, yaw=wrap_angle(m.yaw + self.turn))


POSITIONS: dict[str, Callable[[Node], Position]] = {
    "WorldPosition": World,
    "LanePosition": Lane,
    "RelativeLanePosition": RelativeLane,
    "RelativeObjectPosition": RelativeObject,
    "RelativeWorldPosition": RelativeWorld,
}


def position(node: Node) -> Position:
    """The place inside a <Position>."""
    inner = node.only()
    if inner.tag not in POSITIONS:
        raise Unsupported(inner)
    return POSITIONS[inner.tag](inner)


def _relative_heading(node: Node) -> float:
    orientation = node.find("Orientation")
    if orientation is None:
        return 0.0
    orientation.choice("type", ("relative",), "absolute")
    return orientation.number("h", 0.0)
