"""Whether two entities are in contact."""

from __future__ import annotations

from math import hypot

from skidpad.scenarios.movement.measures import overlap
from skidpad.scenarios.scene import Scene

TOUCHING = 0.05  # m, bodies that the physics keeps apart are this near


def are_in_contact(scene: Scene, a: str, b: str) -> bool:
    """Returns whether two entities are in contact now; never one that is absent or a ghost."""
    if (a == scene.ego and b in scene.contacts) or (b == scene.ego and a in scene.contacts):
        return True
    one, other = scene.actors[a], scene.actors[b]
    if not (one.present and other.present) or one.entity.is_ghost or other.entity.is_ghost:
        return False
    away = hypot(one.pose.x - other.pose.x, one.pose.y - other.pose.y)
    if away > one.nearness(other):
        return False
    reach = 0.0 if one.placed_by_file and other.placed_by_file else TOUCHING
    if overlap(one.outline(), other.outline()) > reach:
        return False
    (low, body), (high, _) = sorted((_stands(scene, a), _stands(scene, b)))
    return high - low < body


def _stands(scene: Scene, name: str) -> tuple[float, float]:
    """Returns the height of the road under an entity, and of its body; m.

    The road's, because a place without z means the ground and is read as z = 0.
    """
    actor = scene.actors[name]
    lane = scene.network.place_of(actor.pose).lane
    return actor.pose.z if lane is None else lane.z, actor.entity.box.height
