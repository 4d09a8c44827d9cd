"""Traffic lights as clients see them: an actor at the stop line for each light of the world."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import cos, pi, sin

from skidpad.core.geometry import Pose
from skidpad.roads.queries import RoadMap
from skidpad.simulation.world.lights import Light, Lights

SAME_LINE = 10.0  # m along the road within which stop lines of one light are one


@dataclass(frozen=True, slots=True, eq=False)
class Post:
    """Where a light's actor stands, and its trigger volume."""

    light: Light
    pole: int  # index within its group
    pose: Pose  # origin at the stop line; x along it, as `get_stop_waypoints` walks
    half_width: float  # m, of the governed lanes


class Posts:
    """All lights of a map by their actors' ids."""

    def __init__(self, lights: Lights) -> None:
        self.lights = lights
        self._by_actor: dict[int, Post] = {}
        self._actors: dict[int, int] = {}  # by signal

    def __iter__(self) -> Iterator[tuple[int, Post]]:
        return iter(self._by_actor.items())

    def add(self, actor: int, post: Post) -> None:
        """Notes which actor stands for a light."""
        self._by_actor[actor] = post
        self._actors[post.light.signal] = actor

    def light(self, actor: int) -> Light:
        """Returns the light of an actor id; KeyError where it is none's."""
        return self._by_actor[actor].light

    def actor(self, light: Light) -> int:
        """Returns the actor id of a light."""
        return self._actors[light.signal]


def posts_of(roads: RoadMap, lights: Lights) -> list[Post]:
    """Returns the posts of all lights, in the order of the map's signals."""
    found = []
    for group in lights.groups.values():
        for pole, light in enumerate(group.lights()):
            found.append(Post(light, pole, *_stop_line(roads, light)))
    return sorted(found, key=lambda post: post.light.rows[0])


def _stop_line(roads: RoadMap, light: Light) -> tuple[Pose, float]:
    """Returns the pose along the line across the lanes that a light governs, and half its length in m."""
    signals = roads.signals
    places = [roads.at(int(signals.lane[row]), float(signals.s[row])) for row in light.rows]
    middle = places[len(places) // 2].pose
    c, s = cos(middle.yaw), sin(middle.yaw)
    left = right = 0.0
    for p in places:
        along = (p.x - middle.x) * c + (p.y - middle.y) * s
        across = (p.y - middle.y) * c - (p.x - middle.x) * s
        if abs(along) < SAME_LINE and cos(p.heading - middle.yaw) > 0.5:
            left = max(left, across + p.width / 2.0)
            right = min(right, across - p.width / 2.0)
    centre = middle.moved(left=(left + right) / 2.0)
    return Pose(centre.x, centre.y, centre.z, yaw=centre.yaw - pi / 2.0), (left - right) / 2.0
