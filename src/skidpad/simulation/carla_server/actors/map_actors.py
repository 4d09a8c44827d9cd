"""Actors that every map brings along: traffic lights, signs, and the free camera."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from skidpad.core.geometry import Pose, kmh_from_mps
from skidpad.core.vocabulary import SemanticClass
from skidpad.roads.lanes import SignalKind
from skidpad.roads.queries import RoadMap
from skidpad.simulation.carla_server.actors.catalogue import Blueprint, Family
from skidpad.simulation.carla_server.actors.posts import Post
from skidpad.simulation.carla_server.actors.registry import Actor

BOX_DEPTH = 1.5  # m, half depth of a trigger volume
BOX_HEIGHT = 1.0  # m, half
SIGNS = {
    SignalKind.STOP: "traffic.stop",
    SignalKind.YIELD: "traffic.yield",
    SignalKind.SPEED_LIMIT: "traffic.speed_limit",
}
LIGHT = Blueprint(
    "traffic.traffic_light", Family.TRAFFIC_LIGHT, {}, label=SemanticClass.TRAFFIC_LIGHT
)


def spectator(id: int, start: Pose) -> Actor:
    """Returns the free camera that every world has, behind and above `start`."""
    blueprint = Blueprint("spectator", Family.SPECTATOR, {})
    return Actor(id, blueprint, {"role_name": "spectator"}, start.moved(forward=-8.0, up=4.0))


def light_actor(id: int, post: Post) -> Actor:
    """Returns the actor of a traffic light, whose box is its trigger volume."""
    actor = Actor(id, LIGHT, {"role_name": "default"}, post.pose)
    actor.half = (post.half_width, BOX_DEPTH, BOX_HEIGHT)
    return actor


@dataclass(frozen=True, slots=True)
class Sign:
    """A traffic sign of the map."""

    signal: int  # OpenDRIVE id
    name: str
    pose: Pose


def signs_of(roads: RoadMap) -> Iterator[Sign]:
    """Yields all signs that clients know (SIGNS), each once; limits with their km/h in the name."""
    signals = roads.signals
    seen = set()
    for row in range(len(signals.id)):
        kind, id = SignalKind(int(signals.kind[row])), int(signals.id[row])
        if kind not in SIGNS or id in seen:
            continue
        seen.add(id)
        name, value = SIGNS[kind], float(signals.value[row])
        if kind is SignalKind.SPEED_LIMIT and value == value:
            name = f"{name}.{round(kmh_from_mps(value))}"
        x, y, z = float(signals.x[row]), float(signals.y[row]), float(signals.z[row])
        yield Sign(id, name, Pose(x, y, z, yaw=float(signals.heading[row])))


def sign_actor(id: int, sign: Sign) -> Actor:
    """Returns the actor of a traffic sign."""
    blueprint = Blueprint(sign.name, Family.TRAFFIC_SIGN, {}, label=SemanticClass.TRAFFIC_SIGN)
    actor = Actor(id, blueprint, {"role_name": "default"}, sign.pose)
    actor.half = (BOX_DEPTH, BOX_DEPTH, BOX_HEIGHT)
    return actor
